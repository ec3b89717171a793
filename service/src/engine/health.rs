//! Whether the store still takes writes.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use metrics::counter;

use super::message::IngestError;
use crate::metrics::DERIVED_FAILURES;
use crate::store::{DerivedError, StoreError};

/// The first failure of the store, if there was one. After it nothing is written until the service
/// starts anew and recovers: what the disk holds is then the truth.
#[derive(Debug, Default)]
pub(crate) struct Health {
    failure: OnceLock<Failure>,
    derived_failed: AtomicBool,
}

#[derive(Debug)]
struct Failure {
    detail: String,
    kind: FailureKind,
}

#[derive(Clone, Debug)]
enum FailureKind {
    DiskFull,
    /// Another process owns this store.
    Fenced(String),
    Other,
}

impl Health {
    /// Notes a failure; the first one counts.
    pub(crate) fn fail(&self, error: &StoreError) {
        let kind = match error {
            StoreError::DiskFull => FailureKind::DiskFull,
            StoreError::Fenced(place) => FailureKind::Fenced(place.clone()),
            _ => FailureKind::Other,
        };
        let failure = Failure {
            detail: error.to_string(),
            kind,
        };
        if self.failure.set(failure).is_ok() {
            tracing::error!(%error, "write to the store; no more samples are taken");
        }
    }

    /// Notes that derived state could not be read or written. Samples are taken all the same, for
    /// the journal holds them.
    pub(crate) fn derived_fail(&self, error: &DerivedError) {
        counter!(DERIVED_FAILURES).increment(1);
        if !self.derived_failed.swap(true, Ordering::AcqRel) {
            tracing::warn!(%error, "samples are taken on, without checkpoints");
        }
    }

    /// Whether derived state is read and written.
    pub(crate) fn keeps_derived(&self) -> bool {
        !self.derived_failed.load(Ordering::Acquire)
    }

    /// What went wrong, if anything did.
    pub(crate) fn failed(&self) -> Option<String> {
        self.failure.get().map(|failure| failure.detail.clone())
    }

    /// The failure once more, if there was one.
    pub(crate) fn error(&self) -> Option<StoreError> {
        self.failure.get().map(|failure| match &failure.kind {
            FailureKind::DiskFull => StoreError::DiskFull,
            FailureKind::Fenced(place) => StoreError::Fenced(place.clone()),
            FailureKind::Other => StoreError::Io(failure.detail.clone()),
        })
    }

    /// What to answer whoever wants to write, if the store failed.
    pub(crate) fn refusal(&self) -> Option<IngestError> {
        self.failure.get().map(|failure| {
            let detail = failure.detail.clone();
            match failure.kind {
                FailureKind::DiskFull => IngestError::DiskFull(detail),
                FailureKind::Fenced(_) => IngestError::Fenced(detail),
                FailureKind::Other => IngestError::Store(detail),
            }
        })
    }
}
