//! When a copy-on-write page changed last, and its digest.

use std::sync::OnceLock;

use crate::{Digest, StateWriter};

/// The latest change of a page and the digest of its items.
#[derive(Debug, Default)]
pub(crate) struct PageVersion {
    /// Revision of the latest change. It serves checkpoints only and is not part of the digest.
    changed: u64,
    /// Digest of the items, once asked for.
    digest: OnceLock<Digest>,
}

impl Clone for PageVersion {
    fn clone(&self) -> Self {
        // A page is copied in order to be changed, so its digest is not worth copying.
        Self {
            changed: self.changed,
            digest: OnceLock::new(),
        }
    }
}

impl PageVersion {
    /// Revision of the latest change.
    pub(crate) fn changed(&self) -> u64 {
        self.changed
    }

    /// Notes that the items are about to change.
    pub(crate) fn touch(&mut self, revision: u64) {
        self.changed = revision;
        self.digest.take();
    }

    /// Digest of the items, which `write` writes.
    pub(crate) fn digest(&self, write: impl FnOnce(&mut StateWriter)) -> Digest {
        *self.digest.get_or_init(|| {
            let mut out = StateWriter::default();
            write(&mut out);
            out.digest()
        })
    }
}
