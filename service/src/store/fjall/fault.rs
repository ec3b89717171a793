//! What the engine's errors mean for the service.

use std::error::Error;
use std::io::{self, ErrorKind, Write};
use std::path::Path;

use super::super::StoreError;

/// Number of the system's error for a full disk, on Linux and on macOS.
const ENOSPC: i32 = 28;

/// Bytes of the file with which a disk is tried: more than the largest file that the engine writes
/// in one go, a write buffer of 64 MiB.
const TRIAL_BYTES: usize = 80 << 20;

/// The error of a write to the store in `directory`.
pub(super) fn on_write(error: &fjall::Error, directory: &Path) -> StoreError {
    match error {
        // One of the engine's threads has failed earlier and kept the reason to itself. A full disk
        // is the one worth telling apart, so the disk is asked.
        fjall::Error::Poisoned if try_disk(directory).is_err_and(|error| disk_full(&error)) => {
            StoreError::DiskFull
        }
        fjall::Error::Poisoned => StoreError::Broken,
        error => from_engine(error),
    }
}

/// The error of a read.
#[expect(
    clippy::needless_pass_by_value,
    reason = "the shape that `map_err` takes"
)]
pub(super) fn on_read(error: fjall::Error) -> StoreError {
    from_engine(&error)
}

/// The error of opening the store in `directory`.
pub(super) fn on_open(error: &fjall::Error, directory: &Path) -> StoreError {
    match error {
        fjall::Error::Locked => StoreError::Locked(directory.display().to_string()),
        // The directory itself is there by then: one of the files in it is gone.
        error if find_io(error).is_some_and(|io| io.kind() == ErrorKind::NotFound) => {
            StoreError::Corrupt("a file of the store is missing".to_owned())
        }
        error => from_engine(error),
    }
}

/// The error of the disk, on the path of `what`.
pub(super) fn on_disk(error: &io::Error, what: &Path) -> StoreError {
    if disk_full(error) {
        StoreError::DiskFull
    } else {
        StoreError::Io(format!("{}: {error}", what.display()))
    }
}

fn from_engine(error: &fjall::Error) -> StoreError {
    match find_io(error) {
        Some(io) if disk_full(io) => StoreError::DiskFull,
        Some(io) if is_corruption(io.kind()) => StoreError::Corrupt(error.to_string()),
        Some(io) => StoreError::Io(io.to_string()),
        None => match error {
            fjall::Error::Poisoned => StoreError::Broken,
            fjall::Error::Locked | fjall::Error::KeyspaceDeleted => {
                StoreError::Io(error.to_string())
            }
            fjall::Error::JournalRecovery(reason) => StoreError::Corrupt(format!(
                "the engine's journal is damaged ({reason:?}), as after a power cut during a write"
            )),
            // All that is left are bytes which the engine could not make sense of.
            error => StoreError::Corrupt(error.to_string()),
        },
    }
}

/// Files that end too early, or hold what they should not.
fn is_corruption(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::UnexpectedEof | ErrorKind::InvalidData)
}

/// The error of the system at the bottom of `error`, however deep the engine has wrapped it.
fn find_io<'a>(error: &'a (dyn Error + 'static)) -> Option<&'a io::Error> {
    if let Some(io) = error.downcast_ref::<io::Error>() {
        let wrapped = io.get_ref().and_then(|inner| find_io(inner));
        return Some(wrapped.unwrap_or(io));
    }
    find_io(error.source()?)
}

fn disk_full(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded
    ) || error.raw_os_error() == Some(ENOSPC)
}

/// Writes a file that nobody keeps, to learn whether the disk takes it.
fn try_disk(directory: &Path) -> io::Result<()> {
    let path = directory.join("trial");
    let written = (|| {
        let mut file = std::fs::File::create(&path)?;
        let piece = vec![0; 1 << 20];
        for _ in 0..TRIAL_BYTES / piece.len() {
            file.write_all(&piece)?;
        }
        file.sync_all()
    })();
    // Left behind, the file would only be in the way; the next trial writes over it.
    let _ = std::fs::remove_file(&path);
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    fn engine_error(io: io::Error) -> StoreError {
        from_engine(&fjall::Error::Io(io))
    }

    fn tree_error(io: io::Error) -> StoreError {
        from_engine(&fjall::Error::Storage(io.into()))
    }

    #[test]
    fn a_full_disk_is_recognised_through_every_layer() {
        let full = || io::Error::from(ErrorKind::StorageFull);
        let by_number = || io::Error::from_raw_os_error(ENOSPC);
        assert!(matches!(engine_error(full()), StoreError::DiskFull));
        assert!(matches!(engine_error(by_number()), StoreError::DiskFull));
        assert!(matches!(tree_error(full()), StoreError::DiskFull));
        assert!(matches!(
            tree_error(io::Error::other(by_number())),
            StoreError::DiskFull
        ));
    }

    #[test]
    fn other_errors_of_the_disk_stay_what_they_are() {
        let denied = || io::Error::from(ErrorKind::PermissionDenied);
        assert!(matches!(engine_error(denied()), StoreError::Io(_)));
        assert!(matches!(tree_error(denied()), StoreError::Io(_)));
    }

    #[test]
    fn bytes_that_make_no_sense_are_corruption() {
        let short = || io::Error::from(ErrorKind::UnexpectedEof);
        assert!(matches!(tree_error(short()), StoreError::Corrupt(_)));
        let journal = fjall::JournalRecoveryError::ChecksumMismatch;
        assert!(matches!(
            from_engine(&fjall::Error::JournalRecovery(journal)),
            StoreError::Corrupt(_)
        ));
    }

    #[test]
    fn a_failed_thread_of_the_engine_breaks_the_store_when_the_disk_has_room() {
        let directory = tempfile::tempdir().unwrap();
        let error = on_write(&fjall::Error::Poisoned, directory.path());
        assert!(matches!(error, StoreError::Broken));
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }
}
