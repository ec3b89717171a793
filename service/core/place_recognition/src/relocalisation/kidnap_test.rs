//! Whether what an agent sees contradicts where it is believed to be.

use nalgebra::Isometry3;

use super::search::{QueryView, Search};
use crate::keyframes::SampleKey;
use state::PagedVec;
use state::state_of_struct;

/// What the views of an agent in the map have said lately of where it is believed to be.
#[derive(Clone, Debug)]
pub(crate) struct KidnapTest {
    pub(crate) agent: u32,
    pub(crate) session: u32,
    /// Sightings that were taken in until the latest look.
    pub(crate) accepted: u64,
    /// What the looks of the run say against where it is believed to be \[nats\]; never less than nothing (Page 1954).
    pub(crate) against: f64,
    /// Whether so much was said against it that it may be anywhere.
    pub(crate) is_kidnapped: bool,
    /// Its latest look, whether it was weighed or not.
    pub(crate) latest: Option<QueryView>,
    /// Where a look was weighed last, by motion alone.
    pub(crate) weighed_at: Option<Isometry3<f64>>,
    /// The looks since the first of those that contradict; what the agent saw since the latest look before them says nothing of
    /// where it is, since that is remembered where it is believed to be.
    pub(crate) run: Search,
}

/// The doubts, at most one of an agent.
pub(crate) type KidnapTests = PagedVec<KidnapTest, 1>;

impl KidnapTest {
    pub(crate) fn new(since: SampleKey) -> Self {
        Self {
            agent: since.agent,
            session: since.session,
            accepted: 0,
            against: 0.0,
            is_kidnapped: false,
            latest: None,
            weighed_at: None,
            run: Search::new(since),
        }
    }

    /// Nothing speaks against where the agent is believed to be at a sample.
    pub(crate) fn reset(&mut self, seq: u64) {
        self.against = 0.0;
        self.run = Search::new(SampleKey {
            agent: self.agent,
            session: self.session,
            seq,
        });
    }

    /// Whether it may have come from a checkpoint that this program wrote.
    pub(crate) fn is_sound(&self, agents: usize, is_channel: impl Fn(u8, usize) -> bool) -> bool {
        let is_known = |query: &QueryView| is_channel(query.channel, query.vector.len());
        (self.agent as usize) < agents
            && self.against >= 0.0
            && self.against.is_finite()
            && self.latest.as_ref().is_none_or(is_known)
            && (self.run.agent, self.run.session) == (self.agent, self.session)
            && self.run.is_sound(agents, is_channel)
    }
}

state_of_struct!(KidnapTest {
    agent,
    session,
    accepted,
    against,
    is_kidnapped,
    latest,
    weighed_at,
    run
});
