//! Whether what an agent sees contradicts where it is believed to be.

use nalgebra::Isometry3;

use super::search::{Look, Search};
use state::PagedVec;
use state::state_of_struct;

/// What the views of an agent in the map have said lately of where it is believed to be.
#[derive(Clone, Debug)]
pub(in crate::keyframes) struct Doubt {
    pub(super) agent: u32,
    pub(super) session: u32,
    /// Sightings that were taken in until the latest look.
    pub(super) accepted: u64,
    /// What the looks of the run say against where it is believed to be \[nats\]; never less than nothing (Page 1954).
    pub(super) against: f64,
    /// Whether so much was said against it that it may be anywhere.
    pub(super) is_astray: bool,
    /// Its latest look, whether it was weighed or not.
    pub(super) latest: Option<Look>,
    /// Where a look was weighed last, by motion alone.
    pub(super) weighed_at: Option<Isometry3<f64>>,
    /// The looks since the first of those that contradict; what the agent saw since the latest look before them says nothing of
    /// where it is, since that is remembered where it is believed to be.
    pub(super) run: Search,
}

/// The doubts, at most one of an agent.
pub(in crate::keyframes) type Doubts = PagedVec<Doubt, 1>;

impl Doubt {
    pub(super) fn new(agent: u32, session: u32, seq: u64) -> Self {
        Self {
            agent,
            session,
            accepted: 0,
            against: 0.0,
            is_astray: false,
            latest: None,
            weighed_at: None,
            run: Search::new(agent, session, seq),
        }
    }

    /// Nothing speaks against where the agent is believed to be at a sample.
    pub(super) fn dispel(&mut self, seq: u64) {
        self.against = 0.0;
        self.run = Search::new(self.agent, self.session, seq);
    }

    /// Whether it may have come from a checkpoint that this program wrote.
    pub(in crate::keyframes) fn is_sound(
        &self,
        agents: usize,
        is_channel: impl Fn(u8, usize) -> bool,
    ) -> bool {
        let is_known = |look: &Look| is_channel(look.channel, look.vector.len());
        (self.agent as usize) < agents
            && self.against >= 0.0
            && self.against.is_finite()
            && self.latest.as_ref().is_none_or(is_known)
            && (self.run.agent, self.run.session) == (self.agent, self.session)
            && self.run.is_sound(agents, is_channel)
    }
}

state_of_struct!(Doubt {
    agent,
    session,
    accepted,
    against,
    is_astray,
    latest,
    weighed_at,
    run
});
