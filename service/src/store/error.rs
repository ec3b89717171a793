//! Errors of the store, one variant for each way in which the caller would act differently.

use std::io;
use std::path::Path;

use super::local::files::disk_full;
use super::log::{Damage, Extent, Flaw, Survey};

/// Why the store could not do it.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// Another process holds the directory.
    #[error(
        "{0} is in use by another process: stop that service first, or choose another directory \
        with --data-dir"
    )]
    Locked(String),
    /// The directory was written by a newer version.
    #[error("the store has format {found}, this build reads up to {supported}: update cogmap")]
    NewerFormat {
        /// Format on disk.
        found: u32,
        /// Newest format that this build reads.
        supported: u32,
    },
    /// The directory was written by an older version.
    #[error(
        "the store has format 1: start the service on it once, and it is made anew as format 2"
    )]
    OlderFormat,
    /// The disk is full.
    #[error("no space left on the store's disk: free some and restart")]
    DiskFull,
    /// A space of that name exists.
    #[error("the space {0:?} exists")]
    SpaceExists(String),
    /// An earlier write failed; writes are refused until the service is restarted.
    #[error("the store refuses writes since an earlier failure ({0}); restart the service")]
    Broken(String),
    /// Another process has opened the store; what it keeps is that one's now.
    #[error("another service has taken over the store {0}: this one may write no more")]
    Fenced(String),
    /// The storage does not answer.
    #[error("storage: {0}")]
    Unreachable(String),
    /// The journal of a space is damaged, or a part of it is missing.
    #[error(transparent)]
    Damaged(Box<DamagedJournal>),
    /// The bytes on disk are not what they should be.
    #[error("corrupt store: {0}")]
    Corrupt(String),
    /// Any other failure of the disk.
    #[error("store: {0}")]
    Io(String),
}

/// A journal of which something that was acknowledged cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DamagedJournal {
    /// Name of the space.
    pub space: String,
    /// The first damage.
    pub first: Damage,
    /// Acknowledged blocks that cannot be read, and the samples in them.
    pub lost: Extent,
    /// How far the journal was acknowledged.
    pub acknowledged: Extent,
}

impl StoreError {
    /// What an error of the disk on the path of `what` means.
    pub(super) fn on_disk(error: &io::Error, what: &Path) -> Self {
        if disk_full(error) {
            Self::DiskFull
        } else {
            Self::Io(format!("{}: {error}", what.display()))
        }
    }
}

impl DamagedJournal {
    /// The damage that a survey has found, if any.
    pub(super) fn of(space: &str, survey: &Survey) -> Option<Self> {
        Some(Self {
            space: space.to_owned(),
            first: survey.damage.first()?.clone(),
            lost: survey.lost,
            acknowledged: survey.acknowledged,
        })
    }
}

impl std::fmt::Display for DamagedJournal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            space,
            first,
            lost,
            acknowledged,
        } = self;
        write!(
            f,
            "the journal of space {space:?} is damaged: block {} ({} at byte {} of {}); {} of {} \
             acknowledged blocks and {} of {} samples cannot be read. `cogmap store verify` \
             says more, `cogmap store repair --space {space}` goes on with the rest",
            first.block,
            first.flaw,
            first.offset,
            first.file,
            lost.blocks,
            acknowledged.blocks,
            lost.samples,
            acknowledged.samples,
        )
    }
}

impl std::error::Error for DamagedJournal {}

impl std::fmt::Display for Flaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Block => "its bytes have changed",
            Self::Header => "no block begins",
            Self::CutShort => "the file ends inside a block",
            Self::Order => "a block of another number stands",
            Self::Unreadable => "the disk does not read on",
            Self::Missing => "blocks are missing",
        })
    }
}

/// Why what is derived from the journal cannot be read or written. The journal holds all of it, and
/// the next start makes it anew.
#[derive(Clone, Debug, thiserror::Error)]
#[error("what is derived from the journal: {0}; the next start makes it anew")]
pub struct DerivedError(pub String);
