//! Errors of the store, one variant for each way in which the caller would act differently.

/// Why the store could not do it.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// Another process holds the directory.
    #[error("{0} is in use by another process")]
    Locked(String),
    /// The directory was written by a newer version.
    #[error("the store has format {found}, this build reads up to {supported}: update cogmap")]
    NewerFormat {
        /// Format on disk.
        found: u32,
        /// Newest format that this build reads.
        supported: u32,
    },
    /// The disk is full.
    #[error("no space left on the store's disk: free some and restart")]
    DiskFull,
    /// A space of that name exists.
    #[error("the space {0:?} exists")]
    SpaceExists(String),
    /// An earlier write failed; writes are refused until the service is restarted.
    #[error("the store refuses writes since an earlier failure; restart the service")]
    Broken,
    /// The bytes on disk are not what they should be.
    #[error("corrupt store: {0}")]
    Corrupt(String),
    /// Any other failure of the disk.
    #[error("store: {0}")]
    Io(String),
}
