//! A relaxation of a snapshot, which whoever has time may carry out.

use std::sync::{Arc, OnceLock};

use place_recognition::ViewLog;

use super::graph::KeyframeGraph;
use super::live_estimates::LiveEstimates;
use super::relaxation_outcome::RelaxationOutcome;
use state::Digest;

/// A relaxation of the keyframe graph as it was at a record.
///
/// Clones share it. Its outcome is a pure function of the snapshot, so that nothing depends on who
/// computes it and when: the map computes it itself at the record at which it needs it, unless
/// somebody has called [`run`](Self::run) before; it waits for one who has not finished.
#[derive(Clone, Debug)]
pub struct RelaxationJob(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    revision: u64,
    source: Source,
    outcome: OnceLock<Arc<RelaxationOutcome>>,
}

/// What the outcome is of.
#[derive(Debug)]
enum Source {
    Snapshot {
        graph: Box<KeyframeGraph>,
        views: Option<ViewLog>,
        live: LiveEstimates,
    },
    /// A snapshot with this digest, of which a checkpoint holds the outcome alone.
    Digest(Digest),
}

impl RelaxationJob {
    /// Of a graph, under the revision of its latest change, of the views that are to be matched,
    /// and of the live estimates.
    pub(super) fn new(graph: &KeyframeGraph, views: Option<ViewLog>, live: LiveEstimates) -> Self {
        Self(Arc::new(Shared {
            revision: graph.revision,
            source: Source::Snapshot {
                graph: Box::new(graph.clone()),
                views,
                live,
            },
            outcome: OnceLock::new(),
        }))
    }

    /// One of which a checkpoint holds the outcome.
    pub(super) fn restored(snapshot: Digest, outcome: RelaxationOutcome) -> Self {
        Self(Arc::new(Shared {
            revision: 0,
            source: Source::Digest(snapshot),
            outcome: OnceLock::from(Arc::new(outcome)),
        }))
    }

    /// Revision of the map whose past is relaxed: one begins at most at each.
    pub fn revision(&self) -> u64 {
        self.0.revision
    }

    /// Whether the outcome is known.
    pub fn is_done(&self) -> bool {
        self.0.outcome.get().is_some()
    }

    /// Computes the outcome, or waits for it where somebody else does: up to seconds.
    pub fn run(&self) {
        self.outcome();
    }

    /// The outcome.
    pub(super) fn outcome(&self) -> &Arc<RelaxationOutcome> {
        self.0.outcome.get_or_init(|| match &self.0.source {
            Source::Snapshot { graph, views, live } => {
                Arc::new(RelaxationOutcome::of(graph, views.as_ref(), live))
            }
            Source::Digest(_) => Arc::default(), // never: it came with its outcome
        })
    }

    /// Digest of the graph and of the views, which is sooner computed than that of the outcome.
    /// What was estimated then follows from the same records, and is not in it.
    pub(super) fn digest(&self) -> Digest {
        match &self.0.source {
            Source::Snapshot { graph, views, .. } => graph.digest(views.as_ref()),
            Source::Digest(digest) => *digest,
        }
    }
}
