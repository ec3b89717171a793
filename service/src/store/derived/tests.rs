//! Checkpoints and chunks, whole and damaged.

use std::fs;

use super::super::Derived;
use super::super::suite::{checkpoint, key as chunk_key, page};
use super::*;

/// Kind, index and bytes of each page.
fn contents(checkpoint: &Checkpoint) -> Vec<(u8, u32, &[u8])> {
    let pages = checkpoint.pages.iter();
    pages
        .map(|page| (page.kind, page.index, page.bytes.as_slice()))
        .collect()
}

fn open(directory: &Path) -> FjallDerived {
    let spaces = [0, 3, 4].map(SpaceNumber);
    FjallDerived::open(&directory.join("derived"), spaces.into_iter()).unwrap()
}

#[test]
fn a_space_that_is_gone_is_dropped_when_the_store_is_opened() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path());
    store
        .put_chunk(SpaceNumber(3), chunk_key(0, 0, 0), b"chunk")
        .unwrap();
    drop(store);
    let path = directory.path().join("derived");
    drop(FjallDerived::open(&path, [SpaceNumber(4)].into_iter()).unwrap());
    let store = open(directory.path());
    assert_eq!(store.chunks(SpaceNumber(3), 0, 0, 0, 1).unwrap(), []);
}

#[test]
fn after_a_failed_write_trajectories_go_on_in_memory() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path());
    let space = SpaceNumber(0);
    store
        .put_chunk(space, chunk_key(1, 1, 10), b"written")
        .unwrap();
    let full = || std::io::Error::from(std::io::ErrorKind::StorageFull);
    let failed = store.write(space, |_| Err(full().into()));
    assert!(failed.unwrap_err().to_string().contains("no space left"));
    store
        .put_chunk(space, chunk_key(1, 1, 20), b"held")
        .unwrap_err();
    store
        .write_checkpoint(space, &checkpoint(1, b"", Vec::new()))
        .unwrap_err();
    let chunks = store.chunks(space, 1, 1, 0, 10).unwrap();
    let stamps: Vec<_> = chunks.iter().map(|(key, _)| key.first_stamp_ns).collect();
    assert_eq!(stamps, [10, 20]);
    drop(store);
    // A full disk has damaged nothing.
    let store = open(directory.path());
    assert_eq!(store.chunks(space, 1, 1, 0, 10).unwrap().len(), 1);
}

#[test]
fn a_panic_of_the_engine_is_a_failed_write_and_the_next_start_begins_anew() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path());
    let space = SpaceNumber(0);
    store
        .put_chunk(space, chunk_key(1, 1, 10), b"written")
        .unwrap();
    let failed = store.write(space, |_| panic!("index out of bounds"));
    assert!(
        failed
            .unwrap_err()
            .to_string()
            .contains("index out of bounds")
    );
    drop(store);
    let store = open(directory.path());
    assert_eq!(store.chunks(space, 1, 1, 0, 10).unwrap(), []);
    store
        .put_chunk(space, chunk_key(1, 1, 10), b"written")
        .unwrap();
    drop(store);
    assert_eq!(
        open(directory.path())
            .chunks(space, 1, 1, 0, 10)
            .unwrap()
            .len(),
        1
    );
}

/// Whatever a flipped bit in a table does: what is read is what was written or nothing, and a store
/// that is opened again works.
#[test]
fn flips_in_tables_are_noticed_and_the_next_start_is_whole() {
    let directory = tempfile::tempdir().unwrap();
    let space = SpaceNumber(0);
    let state = || checkpoint(3, b"recorders", vec![page(0, 0, &[7; 9000])]);
    let store = open(directory.path());
    store.write_checkpoint(space, &state()).unwrap();
    store
        .keyspace(space)
        .unwrap()
        .rotate_memtable_and_wait()
        .unwrap();
    drop(store);
    let mut tables = Vec::new();
    let mut open_directories = vec![directory.path().join("derived/keyspaces")];
    while let Some(path) = open_directories.pop() {
        for entry in fs::read_dir(path).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open_directories.push(path);
            } else {
                tables.push(path);
            }
        }
    }
    assert!(tables.len() > 2, "{tables:?}");
    for table in tables {
        let whole = fs::read(&table).unwrap();
        for part in 0..5 {
            if whole.is_empty() {
                continue;
            }
            let copy = tempfile::tempdir().unwrap();
            super::super::local::copy_for_tests(directory.path(), copy.path());
            let mut bytes = whole.clone();
            bytes[(whole.len() - 1) * part / 4] ^= 0x10;
            let own = table.strip_prefix(directory.path()).unwrap();
            fs::write(copy.path().join(own), bytes).unwrap();
            let store = open(copy.path());
            if let Ok(Some(read)) = store.checkpoint(space) {
                assert_eq!(contents(&read), contents(&state()), "{}", own.display());
            }
            drop(store);
            let store = open(copy.path());
            store.write_checkpoint(space, &state()).unwrap();
            assert!(
                store.checkpoint(space).unwrap().is_some(),
                "{}",
                own.display()
            );
        }
    }
}
