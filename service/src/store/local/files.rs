//! Files and directories that survive a power cut, and what the disk's errors mean.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::super::StoreError;

/// Number of the system's error for a full disk, on Linux and on macOS.
const ENOSPC: i32 = 28;

/// Ending of files that are not finished.
const UNFINISHED: &str = ".new";

/// Writes a file in the place of another one, or of none, in one durable step.
pub(in crate::store) fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut unfinished = path.as_os_str().to_owned();
    unfinished.push(UNFINISHED);
    let unfinished = PathBuf::from(unfinished);
    let mut file = File::create(&unfinished)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    fs::rename(&unfinished, path)?;
    sync_directory(parent(path))
}

/// Moves a file or directory durably.
pub(in crate::store) fn rename(from: &Path, to: &Path) -> io::Result<()> {
    fs::rename(from, to)?;
    sync_directory(parent(to))?;
    sync_directory(parent(from))
}

/// Makes the names in a directory durable.
pub(in crate::store) fn sync_directory(directory: &Path) -> io::Result<()> {
    File::open(directory)?.sync_all()
}

/// Creates `directory` and what is missing above it, durably. Returns the uppermost directory that
/// it has created, if it was not there.
pub(in crate::store) fn create_directory(directory: &Path) -> io::Result<Option<PathBuf>> {
    if directory.is_dir() {
        return Ok(None);
    }
    let above = create_directory(parent(directory))?;
    match fs::create_dir(directory) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    if !directory.is_dir() {
        return Err(ErrorKind::NotADirectory.into());
    }
    sync_directory(parent(directory))?;
    Ok(above.or_else(|| Some(directory.to_owned())))
}

/// Removes a directory with all that is in it, if it is there.
pub(in crate::store) fn remove_tree(directory: &Path) -> io::Result<()> {
    match fs::remove_dir_all(directory) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        result => result,
    }
}

/// Removes a file, if it is there.
pub(in crate::store) fn remove(file: &Path) -> io::Result<()> {
    match fs::remove_file(file) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        result => result,
    }
}

/// Names of what is in a directory, in order; none where it is missing.
pub(in crate::store) fn names(directory: &Path) -> io::Result<Vec<String>> {
    let entries = match fs::read_dir(directory) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    let mut names = Vec::new();
    for entry in entries {
        names.push(entry?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    Ok(names)
}

/// What an error of the disk on the path of `what` means.
pub(in crate::store) fn fault(error: &io::Error, what: &Path) -> StoreError {
    if disk_full(error) {
        StoreError::DiskFull
    } else {
        StoreError::Io(format!("{}: {error}", what.display()))
    }
}

/// Whether an error says that the disk is full.
pub(in crate::store) fn disk_full(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded
    ) || error.raw_os_error() == Some(ENOSPC)
}

/// The directory that holds `path`.
fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}
