//! Opening of a store's directory.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Read};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use fjall::config::CompressionPolicy;
use fjall::{
    CompressionType, Database, Keyspace, KeyspaceCreateOptions, KvSeparationOptions, PersistMode,
};

use super::super::{CACHED_FILES_MAX, StoreError};
use super::{FORMAT_VERSION, FjallStore, fault, keys};

/// File by which the engine recognises its directory; the last one that it creates.
const ENGINE_MARKER: &str = "version";
/// File that the engine locks while it has the directory open.
const ENGINE_LOCK: &str = "lock";
/// First journal file of the engine.
const ENGINE_JOURNAL: &str = "0.jnl";
/// Directory of the engine's keyspaces.
const ENGINE_KEYSPACES: &str = "keyspaces";

/// Opens the store in `directory`, and creates both where they are absent.
pub(super) fn open(directory: &Path) -> Result<FjallStore, StoreError> {
    create_directory(directory).map_err(|error| fault::on_disk(&error, directory))?;
    if !directory.join(ENGINE_MARKER).exists() {
        clear_unfinished(directory)?;
    }
    let on_open = |error| fault::on_open(&error, directory);
    // Compressed, the engine's journal can only be recovered by the very release of the compressor
    // that wrote it: the checksum is over the compressed bytes, and recovery compresses again to
    // compare. And it is slow: 37 MB/s of 4 KiB blocks where 70 are offered.
    let database = Database::builder(directory)
        .journal_compression(CompressionType::None)
        .max_cached_files(Some(CACHED_FILES_MAX))
        .open()
        .map_err(on_open)?;

    let format = stored_format(&database)?;
    let keyspace = |name, options: fn() -> KeyspaceCreateOptions| {
        if format.is_some() && !database.keyspace_exists(name) {
            return Err(StoreError::Corrupt(format!("no keyspace {name}")));
        }
        database.keyspace(name, options).map_err(on_open)
    };
    let store = FjallStore {
        directory: directory.to_owned(),
        meta: keyspace("meta", small_values)?,
        journal: keyspace("journal", large_values)?,
        entities: keyspace("entities", small_values)?,
        checkpoint: keyspace("checkpoint", small_values)?,
        trajectory: keyspace("trajectory", small_values)?,
        spaces: Mutex::new(()),
        broken: AtomicBool::new(false),
        database: database.clone(),
    };
    if format.is_none() {
        write_format(&store.database, &store.meta).map_err(on_open)?;
        sync_directory(&directory.join(ENGINE_KEYSPACES))
            .map_err(|error| fault::on_disk(&error, directory))?;
    }
    store.finish_deletions()?;
    Ok(store)
}

/// The format on disk, `None` while the store has not been created to the end.
fn stored_format(database: &Database) -> Result<Option<u32>, StoreError> {
    if !database.keyspace_exists("meta") {
        return Ok(None);
    }
    let meta = database.keyspace("meta", small_values);
    let meta = meta.map_err(fault::on_read)?;
    let Some(value) = meta.get(keys::FORMAT).map_err(fault::on_read)? else {
        if meta.is_empty().map_err(fault::on_read)? {
            return Ok(None);
        }
        return Err(keys::corrupt("no format"));
    };
    match keys::number_from(&value, keys::FORMAT)? {
        FORMAT_VERSION => Ok(Some(FORMAT_VERSION)),
        found if found > FORMAT_VERSION => Err(StoreError::NewerFormat {
            found,
            supported: FORMAT_VERSION,
        }),
        found => Err(StoreError::Corrupt(format!("format {found}"))),
    }
}

fn write_format(database: &Database, meta: &Keyspace) -> fjall::Result<()> {
    meta.insert(keys::FORMAT, FORMAT_VERSION.to_be_bytes())?;
    database.persist(PersistMode::SyncAll)
}

/// Pages, chunks and records: kept in the sorted tables themselves.
fn small_values() -> KeyspaceCreateOptions {
    KeyspaceCreateOptions::default()
}

/// Blocks of the journal: kept beside the sorted tables, so that merging tables does not copy them,
/// and not compressed.
///
/// Measured once on two shared cores and a virtual disk, 70 MB/s offered for 20 s to four spaces,
/// with a sync every 10 ms, blocks of 64 KiB of half-random bytes: beside the tables 70.0 MB/s with
/// appends delayed by 192 ms at most; in the tables 66.3 MB/s and 633 ms, at twice the processor
/// time. With blocks of 4 KiB 69.7 MB/s and 165 ms against 62.2 MB/s and 841 ms. Compression (LZ4)
/// saved no disk on these bytes and took 1.6 times the processor time with the small blocks.
fn large_values() -> KeyspaceCreateOptions {
    let separation = KvSeparationOptions::default()
        .compression(CompressionType::None)
        // Blocks become stale only when a space is deleted, and then in files of any age.
        .age_cutoff(1.0);
    KeyspaceCreateOptions::default()
        .data_block_compression_policy(CompressionPolicy::disabled())
        .with_kv_separation(Some(separation))
}

/// Creates `directory` and what is missing above it, so that they survive a power cut.
fn create_directory(directory: &Path) -> io::Result<()> {
    if directory.is_dir() {
        return Ok(());
    }
    let parent = match directory.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    create_directory(parent)?;
    match fs::create_dir(directory) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    if !directory.is_dir() {
        return Err(ErrorKind::NotADirectory.into());
    }
    sync_directory(parent)
}

fn sync_directory(directory: &Path) -> io::Result<()> {
    // Elsewhere a directory cannot be opened as a file, nor need it be.
    if cfg!(unix) {
        File::open(directory)?.sync_all()?;
    }
    Ok(())
}

/// Clears what the engine has left of a creation that was interrupted, which it would stumble over,
/// and refuses a directory that holds anything else.
fn clear_unfinished(directory: &Path) -> Result<(), StoreError> {
    let on_disk = |error: io::Error| fault::on_disk(&error, directory);
    for entry in fs::read_dir(directory).map_err(on_disk)? {
        let name = entry.map_err(on_disk)?.file_name();
        let ours = [ENGINE_LOCK, ENGINE_JOURNAL, ENGINE_KEYSPACES];
        // What a file system puts into its own root.
        if !ours.iter().any(|own| name == *own) && name != "lost+found" {
            return Err(StoreError::Io(format!(
                "{} holds no store, but {}: choose an empty directory",
                directory.display(),
                name.display(),
            )));
        }
    }
    let lock = directory.join(ENGINE_LOCK);
    if !lock.exists() {
        return Ok(());
    }
    // Another process may be creating the store at this moment.
    let lock = File::options().write(true).open(lock).map_err(on_disk)?;
    match lock.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            return Err(StoreError::Locked(directory.display().to_string()));
        }
        Err(TryLockError::Error(error)) => return Err(on_disk(error)),
    }
    if directory.join(ENGINE_MARKER).exists() {
        return Ok(());
    }
    let journal = directory.join(ENGINE_JOURNAL);
    if journal.exists() {
        if begins_with_data(&journal).map_err(on_disk)? {
            return Err(keys::corrupt("the engine's file `version` is missing"));
        }
        fs::remove_file(journal).map_err(on_disk)?;
    }
    Ok(())
}

/// Whether anything has been written to a journal file, which begins as zeros.
fn begins_with_data(journal: &Path) -> io::Result<bool> {
    let mut first = [0];
    Ok(File::open(journal)?.read(&mut first)? == 1 && first != [0])
}
