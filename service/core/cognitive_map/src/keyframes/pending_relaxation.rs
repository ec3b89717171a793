//! A relaxation between the record at which it begins and the one at which it is over.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use nalgebra::{Isometry3, Vector6};

use super::constraint::composed;
use super::relaxation::Correction;
use super::relaxation_job::RelaxationJob;
use super::relaxation_outcome::RelaxationOutcome;
use super::tuning;
use geometry::MotionSum;
use state::{CorruptState, Digest, State, StateReader, StateWriter, state_of_struct};

/// A relaxation of the graph as it was some records ago, and what has come since.
///
/// At a record that the stream fixes its outcome comes into force: closures change their state and
/// agents are corrected at once, the keyframes move some with each record.
#[derive(Clone, Debug)]
pub(super) struct PendingRelaxation {
    pub(super) stage: Stage,
    /// Records since it began.
    records: u32,
    /// What agents have done since, by number.
    since: BTreeMap<u32, AgentSince>,
    /// Numbers of keyframes that the outcome does not concern, since they came later, or any more,
    /// since they have moved. A number of the snapshot may have become another one's.
    pub(super) keyframes_apart: BTreeSet<u32>,
    /// Numbers of constraints that came later.
    pub(super) constraints_apart: BTreeSet<u32>,
}

/// How far it is.
#[derive(Clone, Debug)]
pub(super) enum Stage {
    /// Its outcome is not in force.
    Awaited(RelaxationJob),
    /// Its outcome is in force; keyframes before this one of its list have moved.
    InForce(Arc<RelaxationOutcome>, u32),
}

/// What an agent has done since a relaxation began.
#[derive(Clone, Debug)]
struct AgentSince {
    /// Stamp of its first record since \[ns\].
    first_ns: Option<i64>,
    /// Its motion; `None` if it has been put elsewhere.
    motion: Option<MotionSum>,
}

state_of_struct!(AgentSince { first_ns, motion });

impl Default for AgentSince {
    fn default() -> Self {
        Self {
            first_ns: None,
            motion: Some(MotionSum::default()),
        }
    }
}

impl PendingRelaxation {
    /// One that begins.
    pub(super) fn new(job: RelaxationJob) -> Self {
        Self {
            stage: Stage::Awaited(job),
            records: 0,
            since: BTreeMap::new(),
            keyframes_apart: BTreeSet::new(),
            constraints_apart: BTreeSet::new(),
        }
    }

    /// Counts a record of an agent, with its stamp.
    pub(super) fn note(&mut self, agent: u32, stamp_ns: i64) {
        self.records = self.records.saturating_add(1);
        let first_ns = &mut self.since.entry(agent).or_default().first_ns;
        // A clock that begins anew with a session counts from there.
        *first_ns = Some(first_ns.map_or(stamp_ns, |first_ns| first_ns.min(stamp_ns)));
    }

    /// Counts a record of an agent. Answers the outcome if it is to come into force with it.
    pub(super) fn outcome_with(
        &mut self,
        agent: u32,
        stamp_ns: i64,
    ) -> Option<Arc<RelaxationOutcome>> {
        let Stage::Awaited(job) = &self.stage else {
            return None;
        };
        let job = job.clone();
        self.note(agent, stamp_ns);
        { self.is_ripe(agent, stamp_ns) }.then(|| Arc::clone(job.outcome()))
    }

    /// Whether the outcome is to come into force with a record of an agent.
    fn is_ripe(&self, agent: u32, stamp_ns: i64) -> bool {
        let since = self.since.get(&agent).and_then(|since| since.first_ns);
        let passed_ns = since.map_or(0, |first_ns| stamp_ns.saturating_sub(first_ns));
        passed_ns >= tuning::RELAXATION_DELAY_NS || self.records >= tuning::RELAXATION_RECORDS_MAX
    }

    /// An agent moved.
    pub(super) fn go(&mut self, agent: u32, increment: &Isometry3<f64>, variance: &Vector6<f64>) {
        if let Some(motion) = &mut self.since.entry(agent).or_default().motion {
            motion.append(increment, variance);
        }
    }

    /// An agent may have been moved, with these variances.
    pub(super) fn inflate(&mut self, agent: u32, variance: &Vector6<f64>) {
        if let Some(motion) = &mut self.since.entry(agent).or_default().motion {
            motion.inflate(variance);
        }
    }

    /// An agent was put elsewhere: where it was says no longer where it is.
    pub(super) fn cut(&mut self, agent: u32) {
        self.since.entry(agent).or_default().motion = None;
    }

    /// Whether an agent was put elsewhere.
    pub(super) fn is_cut(&self, agent: u32) -> bool {
        let since = self.since.get(&agent);
        since.is_some_and(|since| since.motion.is_none())
    }

    /// A correction of an agent as it was when this began, carried on by its motion since.
    pub(super) fn carried_on(&self, correction: &Correction) -> Option<Correction> {
        let Some(since) = self.since.get(&correction.agent) else {
            return Some(*correction);
        };
        let since = since.motion.as_ref()?;
        let mut pose = correction.pose * since.motion();
        pose.rotation.renormalize_fast();
        let after = |covariance| composed(&covariance, since.motion(), &since.covariance());
        Some(Correction {
            agent: correction.agent,
            pose,
            covariance: correction.covariance.map(after),
        })
    }

    /// Whether one that was read from a checkpoint of a graph with so many agents is sound.
    pub(super) fn is_sound(&self, agents: usize) -> bool {
        let numbers = self.since.keys();
        { numbers }.all(|&agent| (agent as usize) < agents) && self.outcome().is_sound(agents)
    }

    /// The outcome: computed now, unless it is known.
    fn outcome(&self) -> &RelaxationOutcome {
        match &self.stage {
            Stage::Awaited(job) => job.outcome(),
            Stage::InForce(outcome, _) => outcome,
        }
    }

    /// Writes what the map's digest is of. Before the outcome is in force, it is the snapshot that
    /// counts: then nobody waits for an outcome to know whether two maps are equal.
    pub(super) fn write_digested(&self, out: &mut StateWriter) {
        let (digest, next) = match &self.stage {
            Stage::Awaited(job) => (job.digest(), None),
            Stage::InForce(outcome, next) => (outcome.digest(), Some(*next)),
        };
        digest.0.write(out);
        next.write(out);
        self.records.write(out);
        let since: Vec<_> = { self.since.iter() }
            .map(|(&agent, since)| (agent, since.clone()))
            .collect();
        since.write(out);
        for numbers in [&self.keyframes_apart, &self.constraints_apart] {
            numbers.iter().copied().collect::<Vec<u32>>().write(out);
        }
    }

    /// Writes all that a checkpoint holds: behind what the digest is of, the outcome with its own
    /// digest. A snapshot would be as large as the graph; an outcome is a list of poses.
    pub(super) fn write(&self, out: &mut StateWriter) {
        self.write_digested(out);
        self.outcome().write(out);
        self.outcome().digest().0.write(out);
    }

    /// Reads what [`write`](Self::write) wrote.
    pub(super) fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let digest = Digest(State::read(input)?);
        let next: Option<u32> = State::read(input)?;
        let records = State::read(input)?;
        let since: Vec<(u32, AgentSince)> = State::read(input)?;
        let keyframes_apart: Vec<u32> = State::read(input)?;
        let constraints_apart: Vec<u32> = State::read(input)?;
        let outcome = RelaxationOutcome::read(input)?;
        let found = outcome.digest();
        if found.0 != State::read(input)? || (next.is_some() && found.0 != digest.0) {
            return Err(CorruptState::Invalid);
        }
        Ok(Self {
            stage: match next {
                Some(next) => Stage::InForce(Arc::new(outcome), next),
                None => Stage::Awaited(RelaxationJob::restored(digest, outcome)),
            },
            records,
            since: since.into_iter().collect(),
            keyframes_apart: keyframes_apart.into_iter().collect(),
            constraints_apart: constraints_apart.into_iter().collect(),
        })
    }
}
