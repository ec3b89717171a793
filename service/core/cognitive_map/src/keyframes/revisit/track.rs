//! What an agent saw lately.

use nalgebra::Isometry3;

use super::passage::Passage;
use super::view::{read_vector, write_vector};
use state::{CorruptState, State, StateReader, StateWriter};

/// Views that a new one is compared with to learn how far the channel reaches.
pub(super) const RECENT_MAX: usize = 12;

/// An agent's latest views of a channel.
#[derive(Clone, Debug)]
pub(in crate::keyframes) struct Track {
    pub(super) agent: u32,
    pub(super) channel: u8,
    pub(super) session: u32,
    /// The ordinal of the next view.
    pub(super) next: u32,
    /// Where the agent last saw something, by motion alone.
    pub(super) last: Option<Isometry3<f64>>,
    /// The latest views that were news, the newest last.
    pub(super) recent: Vec<Recent>,
    /// The passages under way.
    pub(super) passages: Vec<Passage>,
}

/// One of the latest views.
#[derive(Clone, Debug)]
pub(in crate::keyframes) struct Recent {
    pub(in crate::keyframes) in_odom: Isometry3<f64>,
    pub(in crate::keyframes) vector: Box<[f32]>,
}

impl Track {
    pub(super) fn new(agent: u32, channel: u8, session: u32) -> Self {
        Self {
            agent,
            channel,
            session,
            next: 0,
            last: None,
            recent: Vec::new(),
            passages: Vec::new(),
        }
    }

    /// A view that was news.
    pub(super) fn note(&mut self, in_odom: &Isometry3<f64>, vector: &[f32]) {
        if self.recent.len() >= RECENT_MAX {
            self.recent.remove(0);
        }
        self.recent.push(Recent {
            in_odom: *in_odom,
            vector: vector.into(),
        });
    }
}

impl State for Recent {
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

impl State for Track {
    fn write(&self, out: &mut StateWriter) {
        self.agent.write(out);
        self.channel.write(out);
        self.session.write(out);
        self.next.write(out);
        self.last.write(out);
        write_all(&self.recent, out);
        write_all(&self.passages, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            agent: State::read(input)?,
            channel: State::read(input)?,
            session: State::read(input)?,
            next: State::read(input)?,
            last: State::read(input)?,
            recent: read_all(input)?,
            passages: read_all(input)?,
        })
    }
}

pub(in crate::keyframes) fn write_all<T: State>(items: &[T], out: &mut StateWriter) {
    (items.len() as u64).write(out);
    for item in items {
        item.write(out);
    }
}

pub(in crate::keyframes) fn read_all<T: State>(
    input: &mut StateReader<'_>,
) -> Result<Vec<T>, CorruptState> {
    (0..u64::read(input)?).map(|_| T::read(input)).collect()
}
