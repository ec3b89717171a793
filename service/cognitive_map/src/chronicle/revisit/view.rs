//! A view that is remembered.

use nalgebra::Isometry3;

use crate::state::{CorruptState, State, StateReader, StateWriter};

/// What was seen at a moment of an agent's way.
#[derive(Clone, Debug)]
pub(in crate::chronicle) struct View {
    /// Number of the channel.
    pub(super) channel: u8,
    pub(super) agent: u32,
    /// The run of the agent, and the sample within it.
    pub(super) session: u32,
    pub(super) seq: u64,
    /// Its place among the agent's views of the channel.
    pub(super) ordinal: u32,
    /// Where the agent was by motion alone, since its session began.
    pub(super) in_odom: Isometry3<f64>,
    /// How sure it was of its place and heading then: roots of the traces of their covariances \[m, rad\].
    pub(super) spread: [f64; 2],
    /// What it saw, a unit vector.
    pub(super) vector: Box<[f32]>,
}

impl State for View {
    fn write(&self, out: &mut StateWriter) {
        self.channel.write(out);
        self.agent.write(out);
        self.session.write(out);
        self.seq.write(out);
        self.ordinal.write(out);
        self.in_odom.write(out);
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
            spread: State::read(input)?,
            vector: read_vector(input)?,
        })
    }
}

pub(super) fn write_vector(vector: &[f32], out: &mut StateWriter) {
    // A descriptor has at most 4096 numbers.
    u16::try_from(vector.len())
        .expect("a descriptor's length fits 16 bits")
        .write(out);
    for number in vector {
        number.write(out);
    }
}

pub(super) fn read_vector(input: &mut StateReader<'_>) -> Result<Box<[f32]>, CorruptState> {
    (0..u16::read(input)?).map(|_| f32::read(input)).collect()
}

/// The angle between two unit vectors \[rad\].
pub(super) fn angle_rad(a: &[f32], b: &[f32]) -> f64 {
    f64::from(crate::percept::dot(a, b)).clamp(-1.0, 1.0).acos()
}
