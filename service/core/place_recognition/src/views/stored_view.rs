//! A remembered view.

use nalgebra::{Isometry3, Point3};

use super::channel_model::Distance;
use crate::keyframes::SampleKey;
use state::{CorruptState, State, StateReader, StateWriter, state_of_struct};

/// A view as it is remembered.
#[derive(Clone, Debug)]
pub(crate) struct StoredView {
    /// Number of the channel.
    pub(crate) channel: u8,
    pub(crate) sample: SampleKey,
    /// Its number among the agent's views of the channel.
    pub(crate) ordinal: u32,
    /// Pose by motion alone since the session began.
    pub(crate) in_odom: Isometry3<f64>,
    /// Position in the map when it was stored.
    pub(crate) in_map: Point3<f64>,
    /// Uncertainty then: roots of the traces of the covariances of position and rotation \[m,
    /// rad\].
    pub(crate) spread: [f64; 2],
    /// The descriptor, a unit vector.
    pub(crate) vector: Box<[f32]>,
}

impl StoredView {
    /// Whether it is of the same agent and session as a sample, and not earlier.
    pub(crate) fn is_since(&self, since: SampleKey) -> bool {
        let own = self.sample;
        (own.agent, own.session) == (since.agent, since.session) && own.seq >= since.seq
    }
}

state_of_struct!(SampleKey {
    agent,
    session,
    seq
});

impl State for StoredView {
    fn write(&self, out: &mut StateWriter) {
        self.channel.write(out);
        self.sample.write(out);
        self.ordinal.write(out);
        self.in_odom.write(out);
        self.in_map.write(out);
        self.spread.write(out);
        write_vector(&self.vector, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            channel: State::read(input)?,
            sample: State::read(input)?,
            ordinal: State::read(input)?,
            in_odom: State::read(input)?,
            in_map: State::read(input)?,
            spread: State::read(input)?,
            vector: read_vector(input)?,
        })
    }
}

pub(crate) fn write_vector(vector: &[f32], out: &mut StateWriter) {
    // A descriptor has at most 4096 numbers.
    u16::try_from(vector.len())
        .expect("a descriptor's length fits 16 bits")
        .write(out);
    for number in vector {
        number.write(out);
    }
}

pub(crate) fn read_vector(input: &mut StateReader<'_>) -> Result<Box<[f32]>, CorruptState> {
    (0..u16::read(input)?).map(|_| f32::read(input)).collect()
}

/// A remembered view that is similar to a query, and their distance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SimilarView {
    pub(crate) sample: SampleKey,
    pub(crate) distance: Distance,
}

state_of_struct!(SimilarView { sample, distance });

/// One of an agent's latest views.
#[derive(Clone, Debug)]
pub(crate) struct RecentView {
    pub(crate) in_odom: Isometry3<f64>,
    pub(crate) vector: Box<[f32]>,
}

impl State for RecentView {
    fn write(&self, out: &mut StateWriter) {
        self.in_odom.write(out);
        write_vector(&self.vector, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            in_odom: State::read(input)?,
            vector: read_vector(input)?,
        })
    }
}

pub(crate) fn write_all<T: State>(items: &[T], out: &mut StateWriter) {
    (items.len() as u64).write(out);
    for item in items {
        item.write(out);
    }
}

pub(crate) fn read_all<T: State>(input: &mut StateReader<'_>) -> Result<Vec<T>, CorruptState> {
    (0..u64::read(input)?).map(|_| T::read(input)).collect()
}
