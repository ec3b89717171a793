//! The test whether an agent of the map was kidnapped.

use nalgebra::Isometry3;

use super::search::{QueryView, Search};
use crate::keyframes::SampleKey;
use crate::tuning::kidnap as tuning;
use state::PagedVec;
use state::state_of_struct;

/// The cumulative sum of what the views of an agent say against its believed pose (Page 1954).
#[derive(Clone, Debug)]
pub(crate) struct KidnapTest {
    pub(crate) agent: u32,
    pub(crate) session: u32,
    /// Number of accepted sightings at the latest view.
    pub(crate) accepted: u64,
    /// Sum of the log odds against the believed pose \[nats\], never negative.
    pub(crate) against: f64,
    /// Whether the agent counts as kidnapped.
    pub(crate) is_kidnapped: bool,
    /// The latest view, weighed or not.
    pub(crate) latest: Option<QueryView>,
    /// Pose by motion alone at the latest view that was weighed.
    pub(crate) weighed_at: Option<Isometry3<f64>>,
    /// The queries since the sum was last zero. Views of the agent since then are remembered at the
    /// believed pose, so they say nothing about it and are left out.
    pub(crate) run: Search,
}

/// The tests, at most one of an agent.
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

    /// Adds a query with its evidence for the believed pose \[nats\], if it was weighed. `accepted`
    /// is the number of accepted sightings so far. Answers whether this query makes the sum large.
    pub(crate) fn add(
        &mut self,
        query: &QueryView,
        is_consistent: bool,
        evidence: Option<f64>,
        accepted: u64,
        seq: u64,
    ) -> bool {
        self.latest = Some(query.clone());
        // An agent that is not lost any more was brought back by its sightings.
        self.is_kidnapped = false;
        if self.accepted != accepted {
            // An accepted sighting confirms the pose.
            self.accepted = accepted;
            self.reset(seq);
            return false;
        }
        if let Some(evidence) = evidence {
            self.weighed_at = Some(query.in_odom);
            self.against = (self.against - evidence).max(0.0);
        }
        if self.against == 0.0 {
            self.reset(seq);
            return false;
        }
        if is_consistent {
            let (in_odom, channel) = (query.in_odom, query.channel);
            self.run.push(in_odom, channel, &query.vector, Vec::new());
        }
        evidence.is_some() && self.against >= tuning::SURE
    }

    /// Sets the sum to zero: nothing contradicts the believed pose at a sample.
    pub(crate) fn reset(&mut self, seq: u64) {
        self.against = 0.0;
        self.run = Search::new(SampleKey {
            agent: self.agent,
            session: self.session,
            seq,
        });
    }

    /// Whether the state is one that this program may have written to a checkpoint.
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
