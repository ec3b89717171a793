//! A view that is remembered.

use nalgebra::{Isometry3, Point3};

use super::reach::Distance;
use state::{CorruptState, State, StateReader, StateWriter, state_of_struct};

/// What was seen at a moment of an agent's way.
#[derive(Clone, Debug)]
pub(in crate::keyframes) struct View {
    /// Number of the channel.
    pub(in crate::keyframes) channel: u8,
    pub(in crate::keyframes) agent: u32,
    /// The run of the agent, and the sample within it.
    pub(in crate::keyframes) session: u32,
    pub(in crate::keyframes) seq: u64,
    /// Its place among the agent's views of the channel.
    pub(super) ordinal: u32,
    /// Where the agent was by motion alone, since its session began.
    pub(in crate::keyframes) in_odom: Isometry3<f64>,
    /// Where the agent was thought to be in the map.
    pub(in crate::keyframes) in_map: Point3<f64>,
    /// How sure it was of its place and heading then: roots of the traces of their covariances \[m, rad\].
    pub(in crate::keyframes) spread: [f64; 2],
    /// What it saw, a unit vector.
    pub(in crate::keyframes) vector: Box<[f32]>,
}

impl View {
    /// Whether an agent saw it in a session, from a sample on.
    pub(in crate::keyframes) fn is_of(&self, agent: u32, session: u32, since_seq: u64) -> bool {
        (self.agent, self.session) == (agent, session) && self.seq >= since_seq
    }
}

impl State for View {
    fn write(&self, out: &mut StateWriter) {
        self.channel.write(out);
        self.agent.write(out);
        self.session.write(out);
        self.seq.write(out);
        self.ordinal.write(out);
        self.in_odom.write(out);
        self.in_map.write(out);
        self.spread.write(out);
        write_vector(&self.vector, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            channel: State::read(input)?,
            agent: State::read(input)?,
            session: State::read(input)?,
            seq: State::read(input)?,
            ordinal: State::read(input)?,
            in_odom: State::read(input)?,
            in_map: State::read(input)?,
            spread: State::read(input)?,
            vector: read_vector(input)?,
        })
    }
}

pub(in crate::keyframes) fn write_vector(vector: &[f32], out: &mut StateWriter) {
    // A descriptor has at most 4096 numbers.
    u16::try_from(vector.len())
        .expect("a descriptor's length fits 16 bits")
        .write(out);
    for number in vector {
        number.write(out);
    }
}

pub(in crate::keyframes) fn read_vector(
    input: &mut StateReader<'_>,
) -> Result<Box<[f32]>, CorruptState> {
    (0..u16::read(input)?).map(|_| f32::read(input)).collect()
}

/// The angle between two unit vectors \[rad\].
pub(in crate::keyframes) fn angle_rad(a: &[f32], b: &[f32]) -> f64 {
    f64::from(crate::memory::percept::dot(a, b))
        .clamp(-1.0, 1.0)
        .acos()
}

/// A remembered view, by the sample at which it was seen, and how far from there something like it was seen.
#[derive(Clone, Copy, Debug)]
pub(in crate::keyframes) struct Likeness {
    pub(in crate::keyframes) agent: u32,
    pub(in crate::keyframes) session: u32,
    pub(in crate::keyframes) seq: u64,
    pub(in crate::keyframes) distance: Distance,
}

state_of_struct!(Likeness {
    agent,
    session,
    seq,
    distance
});
