//! An object of a library.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use crate::indexed_model::IndexedModel;
use crate::model::ObjectModel;

/// A model, and the indexes of its variants once somebody needed them.
#[derive(Debug)]
pub(crate) struct LibraryEntry {
    pub(crate) model: ObjectModel,
    indexes: OnceLock<Indexes>,
    /// Whether somebody took it upon them to build the indexes.
    is_claimed: AtomicBool,
}

/// The variants of a model, ready for recognition.
#[derive(Debug)]
pub(crate) struct Indexes {
    pub(crate) places: Arc<IndexedModel>,
    pub(crate) body: Option<Arc<IndexedModel>>,
}

impl LibraryEntry {
    pub(crate) fn new(model: ObjectModel) -> Self {
        Self {
            model,
            indexes: OnceLock::new(),
            is_claimed: AtomicBool::new(false),
        }
    }

    /// Whether somebody has claimed the indexes.
    pub(crate) fn is_claimed(&self) -> bool {
        self.is_claimed.load(Ordering::Relaxed)
    }

    /// Claims the indexes; `false` if somebody has before. Who claims them, builds them.
    pub(crate) fn claim(&self) -> bool {
        !self.is_claimed.swap(true, Ordering::Relaxed)
    }

    /// The indexes; builds them if they are not there, or waits for who does.
    pub(crate) fn indexes(&self) -> &Indexes {
        self.indexes.get_or_init(|| {
            self.is_claimed.store(true, Ordering::Relaxed);
            let (places, body) = IndexedModel::variants(&self.model);
            Indexes {
                places: Arc::new(places),
                body: body.map(Arc::new),
            }
        })
    }
}
