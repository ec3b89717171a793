//! The promises of the journal's port, kept by the embedded store.

use std::fs;
use std::path::Path;

use tempfile::TempDir;

use super::*;
use crate::store::{Checkpoint, ChunkKey, Derived};

crate::store::suite::suite!(|directory| Box::new(LocalStore::open(directory).unwrap()));

pub(super) fn directory() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// Copies the files below `from`, as after a crash of the process that still has them open.
pub(in crate::store) fn copy_files(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy_files(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

pub(super) fn blocks(store: &LocalStore, space: SpaceNumber, from: u64) -> Vec<(u64, Vec<u8>)> {
    store.journal(space, from).map(Result::unwrap).collect()
}

/// Appends blocks of ten samples each after those that are there, and acknowledges them.
pub(super) fn fill(store: &LocalStore, space: SpaceNumber, count: u64) {
    let next = store.open_journal(space).unwrap().extent.blocks;
    for block in next..next + count {
        let bytes = vec![u8::try_from(block % 251).unwrap(); 500];
        store.append(space, block, 10, &bytes).unwrap();
    }
    store.sync().unwrap();
}

fn bytes_below(directory: &Path) -> u64 {
    let entries = fs::read_dir(directory).unwrap();
    let sizes = entries.map(|entry| {
        let entry = entry.unwrap();
        match entry.metadata().unwrap() {
            metadata if metadata.is_dir() => bytes_below(&entry.path()),
            metadata => metadata.len(),
        }
    });
    sizes.sum()
}

#[test]
fn what_was_written_survives_the_process_without_a_sync() {
    let directory = directory();
    let store = LocalStore::open(directory.path()).unwrap();
    let space = store.create_space("hall", b"").unwrap();
    fill(&store, space, 1);
    store.append(space, 1, 1, &vec![7; 100_000]).unwrap();
    let crashed = self::directory();
    copy_files(directory.path(), crashed.path());
    let store = LocalStore::open(crashed.path()).unwrap();
    assert_eq!(store.spaces().unwrap().len(), 1);
    assert_eq!(store.open_journal(space).unwrap().extent.blocks, 2);
    assert_eq!(blocks(&store, space, 1), [(1, vec![7; 100_000])]);
}

#[test]
fn a_deleted_space_gives_its_disk_back_and_its_name_free() {
    let directory = directory();
    let store = LocalStore::open(directory.path()).unwrap();
    let kept = store.create_space("kept", b"").unwrap();
    let gone = store.create_space("gone", b"").unwrap();
    fill(&store, kept, 100);
    fill(&store, gone, 4000);
    let key = ChunkKey {
        agent: 1,
        session: 1,
        first_stamp_ns: 1,
    };
    let state = Checkpoint {
        next_block: 1,
        pages: Vec::new(),
        recorders: vec![1; 3_000_000],
    };
    store.write_checkpoint(gone, &state).unwrap();
    store.put_chunk(gone, key, b"chunk").unwrap();
    let of_journals = |path: &Path| bytes_below(&path.join(SPACES));
    assert!(of_journals(directory.path()) > 2_000_000);
    store.delete_space(gone).unwrap();
    store.delete_space(gone).unwrap();
    assert!(of_journals(directory.path()) < 100_000);
    assert!(!directory.path().join(DELETED).join("1").exists());
    assert!(store.checkpoint(gone).unwrap().is_none());
    assert!(store.chunks(gone, 1, 1, 0, 10).unwrap().is_empty());
    assert!(store.append(gone, 4000, 1, b"").is_err());

    let new = store.create_space("gone", b"new").unwrap();
    assert!(new > gone, "a number is not given out again");
    drop(store);
    let store = LocalStore::open(directory.path()).unwrap();
    assert_eq!(blocks(&store, kept, 0).len(), 100);
    assert!(store.create_space("more", b"").unwrap() > new);
}

#[test]
fn a_deletion_cut_short_is_finished_at_the_next_opening() {
    let directory = directory();
    let store = LocalStore::open(directory.path()).unwrap();
    let space = store.create_space("hall", b"").unwrap();
    fill(&store, space, 3);
    drop(store);
    let doomed = directory.path().join(DELETED);
    fs::create_dir(&doomed).unwrap();
    let own = directory.path().join(SPACES).join("0");
    fs::rename(own, doomed.join("0")).unwrap();
    let store = LocalStore::open(directory.path()).unwrap();
    assert_eq!(store.spaces().unwrap(), []);
    assert!(!doomed.exists());
}

#[test]
fn a_store_is_open_once_at_a_time() {
    let directory = directory();
    let store = LocalStore::open(directory.path()).unwrap();
    let second = LocalStore::open(directory.path());
    assert!(matches!(second, Err(StoreError::Locked(_))), "{second:?}");
    drop(store);
    LocalStore::open(directory.path()).unwrap();
}

#[test]
fn a_newer_format_and_a_damaged_one_are_refused() {
    let directory = directory();
    let path = directory.path();
    drop(LocalStore::open(path).unwrap());
    record::write(path, record::FORMAT, &3_u32.to_le_bytes()).unwrap();
    let opened = LocalStore::open(path);
    let newer = StoreError::NewerFormat {
        found: 3,
        supported: 2,
    };
    assert_eq!(opened.unwrap_err().to_string(), newer.to_string());
    for name in ["format", "format.copy"] {
        fs::write(
            path.join(name),
            b"garbage, and more of it than anybody expects",
        )
        .unwrap();
    }
    let opened = LocalStore::open(path);
    assert!(matches!(opened, Err(StoreError::Corrupt(_))), "{opened:?}");
}

#[test]
fn a_directory_with_other_things_in_it_is_left_alone() {
    let directory = directory();
    let file = directory.path().join("thesis.tex");
    fs::write(&file, b"important").unwrap();
    let opened = LocalStore::open(directory.path());
    assert!(
        matches!(&opened, Err(StoreError::Io(reason)) if reason.contains("thesis.tex")),
        "{opened:?}"
    );
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    let opened = LocalStore::open(&file);
    assert!(matches!(opened, Err(StoreError::Io(_))), "{opened:?}");
    assert_eq!(fs::read(file).unwrap(), b"important");
}

#[test]
fn a_creation_cut_short_is_begun_again() {
    let directory = directory();
    let path = directory.path();
    fs::write(path.join("lock"), []).unwrap();
    fs::create_dir(path.join(SPACES)).unwrap();
    fs::write(path.join("next_space.copy.new"), b"CG").unwrap();
    let store = LocalStore::open(path).unwrap();
    store.create_space("hall", b"").unwrap();
    // And that of a space.
    let unfinished = path.join(SPACES).join("7.new");
    fs::create_dir(&unfinished).unwrap();
    drop(store);
    let store = LocalStore::open(path).unwrap();
    assert!(!unfinished.exists());
    assert_eq!(store.spaces().unwrap().len(), 1);
}

#[test]
fn after_a_failed_write_the_journal_reads_and_no_longer_writes() {
    let failures = [io::ErrorKind::StorageFull, io::ErrorKind::PermissionDenied];
    for failure in failures {
        let directory = directory();
        let store = LocalStore::open(directory.path()).unwrap();
        let space = store.create_space("hall", b"").unwrap();
        fill(&store, space, 1);
        let failed = store.journals().write(|| Err(failure.into()));
        let said = failed.unwrap_err().to_string();
        let refused = [
            store.append(space, 1, 1, b"block"),
            store.sync(),
            store.delete_space(space),
            store.create_space("new", b"").map(drop),
        ];
        for refusal in refused {
            // Whoever comes later is told the first reason, whoever has met it.
            let refusal = refusal.unwrap_err();
            let is_full = matches!(refusal, StoreError::DiskFull);
            assert_eq!(
                is_full,
                failure == io::ErrorKind::StorageFull,
                "{refusal:?}"
            );
            assert!(refusal.to_string().contains(&said), "{refusal}");
        }
        assert_eq!(blocks(&store, space, 0).len(), 1);
        drop(store);
        let store = LocalStore::open(directory.path()).unwrap();
        fill(&store, space, 1);
        assert_eq!(blocks(&store, space, 0).len(), 2);
    }
}
