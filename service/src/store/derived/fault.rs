//! What the errors of the engine beneath mean.

use std::error::Error;
use std::io::{self, Write};
use std::path::Path;

use super::super::local::files::disk_full;

/// Bytes of the file with which a disk is tried: more than the largest file that the engine writes
/// in one go.
const TRIAL_BYTES: usize = 80 << 20;

/// Whether an error says that the disk in `directory` is full. What was written before is whole
/// then.
pub(super) fn is_disk_full(error: &fjall::Error, directory: &Path) -> bool {
    match error {
        // One of the engine's threads has failed earlier and kept the reason to itself. A full disk
        // is the one worth telling apart, so the disk is asked.
        fjall::Error::Poisoned => try_disk(directory).is_err_and(|error| disk_full(&error)),
        error => find_io(error).is_some_and(disk_full),
    }
}

/// The error of the system at the bottom of `error`, however deep the engine has wrapped it.
fn find_io<'a>(error: &'a (dyn Error + 'static)) -> Option<&'a io::Error> {
    if let Some(io) = error.downcast_ref::<io::Error>() {
        let wrapped = io.get_ref().and_then(|inner| find_io(inner));
        return Some(wrapped.unwrap_or(io));
    }
    find_io(error.source()?)
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
    use std::io::ErrorKind;

    #[test]
    fn a_full_disk_is_recognised_through_every_layer() {
        let directory = tempfile::tempdir().unwrap();
        let is_full = |error: &fjall::Error| is_disk_full(error, directory.path());
        let full = || io::Error::from(ErrorKind::StorageFull);
        assert!(is_full(&fjall::Error::Io(full())));
        assert!(is_full(&fjall::Error::Storage(full().into())));
        assert!(is_full(&fjall::Error::Storage(
            io::Error::other(full()).into()
        )));
        assert!(!is_full(&fjall::Error::Io(
            ErrorKind::PermissionDenied.into()
        )));
        assert!(!is_full(&fjall::Error::Poisoned));
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }
}
