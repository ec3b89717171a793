//! Files and directories that survive a power cut, and what the disk's errors mean.

use std::fs::{self, File};
#[cfg(not(test))]
use std::io::Write;
use std::io::{self, ErrorKind, IoSlice, Read};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

#[cfg(test)]
use super::disk_model as model;

/// Number of the system's error for a full disk, on Linux and on macOS.
const ENOSPC: i32 = 28;

/// Number of the system's error for a disk that does not read, on Linux and on macOS.
const EIO: i32 = 5;

/// Ending of files that are not finished.
const UNFINISHED: &str = ".new";

/// Writes a file in the place of another one, or of none, in one durable step.
pub(in crate::store) fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut unfinished = path.as_os_str().to_owned();
    unfinished.push(UNFINISHED);
    let unfinished = PathBuf::from(unfinished);
    let file = File::create(&unfinished)?;
    #[cfg(test)]
    model::created(&file);
    write_all(&file, &mut [IoSlice::new(bytes)])?;
    sync_all(&file)?;
    fs::rename(&unfinished, path)?;
    sync_directory(parent(path))
}

/// Moves a file or directory durably.
pub(in crate::store) fn rename(from: &Path, to: &Path) -> io::Result<()> {
    fs::rename(from, to)?;
    sync_directory(parent(to))?;
    sync_directory(parent(from))
}

/// Opens a file to append to it, and creates it where it is missing.
pub(in crate::store) fn open_to_append(path: &Path) -> io::Result<File> {
    let file = File::options().append(true).create(true).open(path)?;
    #[cfg(test)]
    model::created(&file);
    Ok(file)
}

/// Writes all slices: in one call, unless the system takes less at once.
pub(in crate::store) fn write_all(file: &File, slices: &mut [IoSlice<'_>]) -> io::Result<()> {
    let mut rest = slices;
    while rest.iter().any(|slice| !slice.is_empty()) {
        #[cfg(test)]
        let written = model::write(file, rest);
        #[cfg(not(test))]
        let written = (&*file).write_vectored(rest);
        match written {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(written) => IoSlice::advance_slices(&mut rest, written),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Bytes of a small file.
pub(in crate::store) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    #[cfg(test)]
    model::before_read(&file, 0, file.metadata()?.len())?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads exactly as many bytes as there is room for.
pub(in crate::store) fn read_exact_at(file: &File, bytes: &mut [u8], at: u64) -> io::Result<()> {
    #[cfg(test)]
    model::before_read(file, at, bytes.len() as u64)?;
    file.read_exact_at(bytes, at)
}

/// Makes the bytes of a file durable, and its length.
pub(in crate::store) fn sync_data(file: &File) -> io::Result<()> {
    #[cfg(test)]
    model::before_sync(file)?;
    file.sync_data()?;
    #[cfg(test)]
    model::synced(file);
    Ok(())
}

/// Makes a file durable with all that the system knows of it.
pub(in crate::store) fn sync_all(file: &File) -> io::Result<()> {
    #[cfg(test)]
    model::before_sync(file)?;
    file.sync_all()?;
    #[cfg(test)]
    model::synced(file);
    Ok(())
}

/// Makes the names in a directory durable.
pub(in crate::store) fn sync_directory(directory: &Path) -> io::Result<()> {
    let file = File::open(directory)?;
    #[cfg(test)]
    model::before_sync(&file)?;
    file.sync_all()?;
    #[cfg(test)]
    model::synced(&file);
    Ok(())
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

/// Whether an error says that the disk is full.
pub(in crate::store) fn disk_full(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded
    ) || error.raw_os_error() == Some(ENOSPC)
}

/// Whether an error says that the disk does not read what was written.
pub(in crate::store) fn is_unreadable(error: &io::Error) -> bool {
    error.raw_os_error() == Some(EIO)
}

/// The directory that holds `path`.
fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}
