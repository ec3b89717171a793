//! The latest new views, the newest last.

use nalgebra::Isometry3;

use super::sequence_match::SequenceMatch;
use crate::tuning::track as tuning;
use crate::views::{RecentView, read_all, write_all};
use state::{CorruptState, State, StateReader, StateWriter};

/// An agent's latest views of a channel.
#[derive(Clone, Debug)]
pub(crate) struct ViewTrack {
    pub(super) agent: u32,
    pub(super) channel: u8,
    pub(super) session: u32,
    /// The ordinal of the next view.
    pub(super) next: u32,
    /// Pose by motion alone at the latest view.
    pub(super) last: Option<Isometry3<f64>>,
    /// The latest views that were news, the newest last.
    pub(super) recent: Vec<RecentView>,
    /// Sequence matches that are not complete.
    pub(super) matches: Vec<SequenceMatch>,
}

impl ViewTrack {
    pub(super) fn new(agent: u32, channel: u8, session: u32) -> Self {
        Self {
            agent,
            channel,
            session,
            next: 0,
            last: None,
            recent: Vec::new(),
            matches: Vec::new(),
        }
    }

    /// Adds a new view.
    pub(super) fn note(&mut self, in_odom: &Isometry3<f64>, vector: &[f32]) {
        if self.recent.len() >= tuning::RECENT_MAX {
            self.recent.remove(0);
        }
        self.recent.push(RecentView {
            in_odom: *in_odom,
            vector: vector.into(),
        });
    }
}

impl State for ViewTrack {
    fn write(&self, out: &mut StateWriter) {
        self.agent.write(out);
        self.channel.write(out);
        self.session.write(out);
        self.next.write(out);
        self.last.write(out);
        write_all(&self.recent, out);
        write_all(&self.matches, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            agent: State::read(input)?,
            channel: State::read(input)?,
            session: State::read(input)?,
            next: State::read(input)?,
            last: State::read(input)?,
            recent: read_all(input)?,
            matches: read_all(input)?,
        })
    }
}
