//! Indexing of objects, beside the map.

use std::sync::Arc;

use object_recognition::ObjectLibrary;

use super::memory::ObjectMemory;

/// What is to be computed of the objects of a map before anything is recognised.
///
/// The map that somebody touches something in computes it itself, as far as nobody has
/// [before](Self::step). When that was makes no difference to the map. Clones share the work.
#[derive(Clone, Debug)]
pub struct IndexingJob {
    library: Arc<ObjectLibrary>,
    revision: u64,
}

impl IndexingJob {
    /// Revision of the map that changed its objects.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Number of objects that nobody has begun with.
    pub fn left(&self) -> usize {
        self.library.unclaimed()
    }

    /// Does one object that nobody has begun with, up to a fifth of a second; whether there was
    /// one.
    pub fn step(&self) -> bool {
        self.library.index_one()
    }

    /// Does all that is left.
    pub fn run(&self) {
        while self.step() {}
    }
}

impl ObjectMemory {
    /// The indexing of the objects as they are, if they have changed after a revision.
    pub(crate) fn indexing(&self, after: Option<u64>) -> Option<IndexingJob> {
        let is_new = !self.library.is_empty() && Some(self.changed) > after;
        is_new.then(|| IndexingJob {
            library: Arc::clone(&self.library),
            revision: self.changed,
        })
    }
}
