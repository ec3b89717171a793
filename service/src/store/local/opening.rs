//! Opening of a store's directory.

use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, RwLock};

use super::super::{SpaceNumber, StoreError};
use super::record::{self, Found, SpaceRecord};
use super::syncing::MarkSync;
use super::{DELETED, FORMAT_VERSION, LocalJournal, SET_ASIDE, SPACES, UNFINISHED, files, numbers};

/// File that is locked while a process has the directory open.
pub(in crate::store) const LOCK: &str = "lock";

/// What a creation that was cut short may leave.
const LEFT_BY_CREATION: [&str; 4] = [LOCK, SPACES, record::NEXT_SPACE, record::FORMAT];

/// An open store.
pub(super) struct Opened {
    pub(super) journal: LocalJournal,
    /// The uppermost directory that was created for it.
    pub(super) created: Option<PathBuf>,
}

/// Opens the journals in `directory`, which are created where they are absent if `create` says so.
pub(super) fn open(directory: &Path, create: bool) -> Result<Opened, StoreError> {
    let on_disk = |error: io::Error| StoreError::on_disk(&error, directory);
    if !create && !is_store(directory)? {
        return Err(StoreError::Io(format!(
            "there is no store at {}",
            directory.display()
        )));
    }
    let created = files::create_directory(directory).map_err(on_disk)?;
    match open_in(directory) {
        Ok(journal) => Ok(Opened { journal, created }),
        Err(error) => {
            remove_created(created.as_deref());
            Err(error)
        }
    }
}

/// Removes directories that a failed start has created.
pub(super) fn remove_created(created: Option<&Path>) {
    if let Some(created) = created
        && let Err(error) = files::remove_tree(created)
    {
        let directory = created.display();
        tracing::warn!(%error, %directory, "remove what a failed start has created");
    }
}

fn open_in(directory: &Path) -> Result<LocalJournal, StoreError> {
    let on_disk = |error: io::Error| StoreError::on_disk(&error, directory);
    if !is_store(directory)? {
        refuse_foreign(directory)?;
    }
    let lock = lock(directory)?;
    // Another process may have created it meanwhile.
    if is_store(directory)? {
        record::heal(directory, record::FORMAT)?;
    } else {
        refuse_foreign(directory)?;
        files::create_directory(&directory.join(SPACES)).map_err(on_disk)?;
        record::write(directory, record::NEXT_SPACE, &0_u32.to_le_bytes())?;
        record::write(directory, record::FORMAT, &FORMAT_VERSION.to_le_bytes())?;
        tracing::info!(directory = %directory.display(), "a new store");
    }
    tidy_up(directory)?;
    let logs = Arc::new(RwLock::new(BTreeMap::new()));
    Ok(LocalJournal {
        directory: directory.to_owned(),
        changing: Mutex::new(()),
        syncing: Mutex::new(()),
        marks: Some(MarkSync::start(Arc::clone(&logs)).map_err(on_disk)?),
        logs,
        failure: OnceLock::new(),
        _lock: lock,
    })
}

/// Whether the directory holds a store that this build reads.
pub(in crate::store) fn is_store(directory: &Path) -> Result<bool, StoreError> {
    match record::read(directory, record::FORMAT)? {
        Found::Nothing => Ok(false),
        Found::Damaged => Err(StoreError::Corrupt(format!(
            "both copies of {} are damaged; write 'format' of any other store in their place",
            directory.join(record::FORMAT).display()
        ))),
        Found::Contents(contents) => match record::number(&contents) {
            Some(FORMAT_VERSION) => Ok(true),
            Some(found) if found > FORMAT_VERSION => Err(StoreError::NewerFormat {
                found,
                supported: FORMAT_VERSION,
            }),
            found => Err(StoreError::Corrupt(format!("format {found:?}"))),
        },
    }
}

/// Takes the lock of the directory for as long as the file is open.
pub(in crate::store) fn lock(directory: &Path) -> Result<File, StoreError> {
    let path = directory.join(LOCK);
    let on_disk = |error: io::Error| StoreError::on_disk(&error, &path);
    let mut options = File::options();
    let lock = options.create(true).truncate(false).write(true).open(&path);
    let lock = lock.map_err(on_disk)?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(TryLockError::WouldBlock) => Err(StoreError::Locked(directory.display().to_string())),
        Err(TryLockError::Error(error)) => Err(on_disk(error)),
    }
}

/// Refuses a directory without a store that holds anything else than an unfinished one.
pub(in crate::store) fn refuse_foreign(directory: &Path) -> Result<(), StoreError> {
    let on_disk = |error: io::Error| StoreError::on_disk(&error, directory);
    let names = files::names(directory).map_err(on_disk)?;
    if super::super::format1::marker::is_store(directory) {
        return Err(StoreError::OlderFormat);
    }
    for name in names {
        let plain = name.trim_end_matches(UNFINISHED).trim_end_matches(".copy");
        // What a file system puts into its own root is nobody's.
        if !LEFT_BY_CREATION.contains(&plain) && name != "lost+found" {
            return Err(StoreError::Io(format!(
                "{} holds no store, but {name}: choose an empty directory",
                directory.display(),
            )));
        }
    }
    let spaces = files::names(&directory.join(SPACES)).map_err(on_disk)?;
    if !spaces.is_empty() {
        return Err(StoreError::Io(format!(
            "{} was not restored to the end: empty it and restore again",
            directory.display(),
        )));
    }
    Ok(())
}

/// Finishes what a crash has interrupted.
fn tidy_up(directory: &Path) -> Result<(), StoreError> {
    let spaces = directory.join(SPACES);
    let on_disk = |error: io::Error| StoreError::on_disk(&error, directory);
    files::remove_tree(&directory.join(DELETED)).map_err(on_disk)?;
    for name in files::names(&spaces).map_err(on_disk)? {
        if name.ends_with(UNFINISHED) {
            files::remove_tree(&spaces.join(name)).map_err(on_disk)?;
        }
    }
    for number in numbers(&spaces).map_err(on_disk)? {
        let space = spaces.join(number.to_string());
        if record::heal(&space, record::SPACE)? {
            tracing::warn!(
                space = number,
                "a damaged record of a space was made anew from its copy"
            );
        }
        if let Found::Contents(contents) = record::read(&space, record::SPACE)?
            && let Some(record) = SpaceRecord::decode(&contents)
            && let Some(replaced) = record.replaces
        {
            set_aside(directory, replaced)?;
        }
    }
    Ok(())
}

/// Moves a space that has been replaced out of the way; returns where it is.
pub(super) fn set_aside(directory: &Path, space: SpaceNumber) -> Result<PathBuf, StoreError> {
    let from = directory.join(SPACES).join(space.0.to_string());
    let parent = directory.join(SET_ASIDE);
    let to = parent.join(space.0.to_string());
    if from.exists() {
        files::create_directory(&parent)
            .and_then(|_| files::rename(&from, &to))
            .map_err(|error| StoreError::on_disk(&error, &from))?;
    }
    Ok(to)
}
