//! A relaxation between the record at which it begins and the one at which it is over.

use std::sync::Arc;

use super::relaxation_job::RelaxationJob;
use super::relaxation_outcome::RelaxationOutcome;
use state::{CorruptState, Digest, State, StateReader, StateWriter};

/// How far a relaxation is.
///
/// At a record that the stream fixes its outcome comes into force: closures change their state and
/// agents are corrected at once, the keyframes move some with each record.
#[derive(Clone, Debug)]
pub(super) enum PendingRelaxation {
    /// Its outcome is not in force.
    Awaited(RelaxationJob),
    /// Its outcome is in force; keyframes before this one of its list have moved.
    InForce(Arc<RelaxationOutcome>, u32),
}

impl PendingRelaxation {
    /// The outcome: computed now, unless it is known.
    pub(super) fn outcome(&self) -> &Arc<RelaxationOutcome> {
        match self {
            Self::Awaited(job) => job.outcome(),
            Self::InForce(outcome, _) => outcome,
        }
    }

    /// Writes what the map's digest is of. Before the outcome is in force, it is the snapshot that
    /// counts: then nobody waits for an outcome to know whether two maps are equal.
    pub(super) fn write_digested(&self, out: &mut StateWriter) {
        let (digest, next) = match self {
            Self::Awaited(job) => (job.digest(), None),
            Self::InForce(outcome, next) => (outcome.digest(), Some(*next)),
        };
        digest.0.write(out);
        next.write(out);
    }
}

/// All that a checkpoint holds: behind what the digest is of, the outcome with its own digest. A
/// snapshot would be as large as the graph; an outcome is a list of poses.
impl State for PendingRelaxation {
    fn write(&self, out: &mut StateWriter) {
        self.write_digested(out);
        self.outcome().write(out);
        self.outcome().digest().0.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let digest = Digest(State::read(input)?);
        let next: Option<u32> = State::read(input)?;
        let outcome = RelaxationOutcome::read(input)?;
        let found = outcome.digest();
        if found.0 != State::read(input)? || (next.is_some() && found.0 != digest.0) {
            return Err(CorruptState::Invalid);
        }
        Ok(match next {
            Some(next) => Self::InForce(Arc::new(outcome), next),
            None => Self::Awaited(RelaxationJob::restored(digest, outcome)),
        })
    }
}
