//! Where a service answers.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Addresses at which the same spaces can be asked, as those of the nodes of a cluster. Clones
/// share which of them is in use.
#[derive(Clone, Debug)]
pub(super) struct Addresses {
    all: Vec<String>,
    in_use: Arc<AtomicUsize>,
}

impl Addresses {
    pub(super) fn of(base: &str) -> Self {
        Self {
            all: vec![without_slash(base)],
            in_use: Arc::default(),
        }
    }

    /// These and another one. It is a set of its own: clones made before do not know it.
    pub(super) fn and(mut self, base: &str) -> Self {
        self.all.push(without_slash(base));
        self.in_use = Arc::default();
        self
    }

    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// The address in use, and its index.
    pub(super) fn in_use(&self) -> (usize, &str) {
        let index = self.in_use.load(Ordering::Relaxed);
        (index, &self.all[index])
    }

    /// Uses the address after the one of this index, unless another caller has gone on already.
    pub(super) fn leave(&self, index: usize) {
        let next = (index + 1) % self.all.len();
        let relaxed = Ordering::Relaxed;
        // Where it fails, somebody else has left this address.
        let _ = { &self.in_use }.compare_exchange(index, next, relaxed, relaxed);
    }
}

fn without_slash(base: &str) -> String {
    base.trim_end_matches('/').to_owned()
}
