//! The latest new views, the newest last.

use nalgebra::Isometry3;

use super::sequence_match::SequenceMatch;
use crate::tuning::track as tuning;
use crate::views::RecentView;
use state::{Counted, state_of_struct};

/// An agent's latest views of a channel.
#[derive(Clone, Debug)]
pub(crate) struct ViewTrack {
    pub(super) agent: u32,
    pub(super) channel: u8,
    pub(super) session: u32,
    /// The ordinal of the next view.
    pub(super) next: u32,
    /// The ordinal of the next view in the log.
    pub(super) logged: u32,
    /// The number of the stretch under way: the agent was put elsewhere between two of them.
    pub(super) stretch: u32,
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
            logged: 0,
            stretch: 0,
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

state_of_struct!(ViewTrack {
    agent,
    channel,
    session,
    next,
    logged,
    stretch,
    last,
    recent as Counted<u64>,
    matches as Counted<u64>,
});
