//! The port's promises, kept by the embedded store.

use tempfile::TempDir;

use super::chunk_tests::chunk_key;
use super::*;

fn directory() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn page(kind: u8, index: u32, bytes: &[u8]) -> CheckpointPage {
    let bytes = bytes.to_vec();
    CheckpointPage { kind, index, bytes }
}

fn checkpoint(next_block: u64, recorders: &[u8], pages: Vec<CheckpointPage>) -> Checkpoint {
    Checkpoint {
        next_block,
        pages,
        recorders: recorders.to_vec(),
    }
}

/// Kind, index and bytes of each page.
fn contents(checkpoint: &Checkpoint) -> Vec<(u8, u32, &[u8])> {
    let pages = checkpoint.pages.iter();
    pages
        .map(|page| (page.kind, page.index, page.bytes.as_slice()))
        .collect()
}

fn journal(store: &FjallStore, space: SpaceNumber, from: u64) -> Vec<(u64, Vec<u8>)> {
    store.journal(space, from).map(Result::unwrap).collect()
}

#[test]
fn spaces_are_listed_by_number_with_name_and_settings() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    assert_eq!(store.spaces().unwrap(), []);
    // Past ten, where the order of the decimal keys is not that of the numbers.
    for i in 0..12_u8 {
        let number = store.create_space(&format!("hall-{i}"), &[i; 3]).unwrap();
        assert_eq!(number, SpaceNumber(u32::from(i)));
    }
    let spaces = store.spaces().unwrap();
    assert!(spaces.is_sorted_by_key(|space| space.number));
    assert_eq!(
        spaces[11],
        StoredSpace {
            number: SpaceNumber(11),
            name: "hall-11".to_owned(),
            settings: vec![11; 3],
        }
    );
}

#[test]
fn a_name_is_taken_once_and_may_be_anything() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    for name in ["", "a/b", "Lübeck", "deleted/0"] {
        store.create_space(name, &[]).unwrap();
        let again = store.create_space(name, &[]);
        assert!(matches!(again, Err(StoreError::SpaceExists(taken)) if taken == name));
    }
    assert_eq!(store.spaces().unwrap().len(), 4);
    // Refusing a name is not a failed write.
    store.create_space("new", &[]).unwrap();
}

#[test]
fn the_journal_comes_back_in_order_and_by_space() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let spaces = [SpaceNumber(0), SpaceNumber(1), SpaceNumber(256)];
    // Past 256, where little-endian keys would be out of order, and above and below the length at
    // which values are kept beside the tables.
    let block = |space: SpaceNumber, number: u64| {
        let length = if number.is_multiple_of(7) { 5000 } else { 20 };
        let byte = u8::try_from((number + u64::from(space.0)) % 251).unwrap();
        vec![byte; length]
    };
    for number in 0..600 {
        for space in spaces {
            let bytes = block(space, number);
            store.append(space, number, &bytes).unwrap();
        }
    }
    store.sync().unwrap();
    for flushed in [false, true] {
        if flushed {
            store.journal.rotate_memtable_and_wait().unwrap();
        }
        for space in spaces {
            let expected: Vec<_> = (0..600).map(|n| (n, block(space, n))).collect();
            assert_eq!(journal(&store, space, 0), expected);
            assert_eq!(journal(&store, space, 255), expected[255..]);
            assert_eq!(journal(&store, space, 600), []);
        }
    }
    assert_eq!(journal(&store, SpaceNumber(2), 0), []);
}

#[test]
fn the_last_possible_block_and_space_are_reached() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let space = SpaceNumber(u32::MAX);
    store.append(space, u64::MAX, b"end").unwrap();
    assert_eq!(
        journal(&store, space, u64::MAX),
        [(u64::MAX, b"end".to_vec())]
    );
}

#[test]
fn reading_the_journal_goes_on_beside_appends() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    store.append(SpaceNumber(0), 0, b"a").unwrap();
    let mut blocks = store.journal(SpaceNumber(0), 0);
    store.append(SpaceNumber(0), 1, b"b").unwrap();
    assert_eq!(blocks.next().unwrap().unwrap(), (0, b"a".to_vec()));
    assert!(blocks.next().is_none(), "the journal as it was when asked");
}

#[test]
fn a_checkpoint_is_the_merge_of_its_writes() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let (space, other) = (SpaceNumber(3), SpaceNumber(4));
    assert!(store.checkpoint(space).unwrap().is_none());

    let first = vec![page(0, 0, b"a0"), page(0, 256, b"a256"), page(1, 0, b"b0")];
    store
        .write_checkpoint(space, &checkpoint(10, b"r1", first))
        .unwrap();
    // A page of no bytes is none: it removes what was stored.
    let second = vec![page(0, 256, b"A256"), page(1, 0, b""), page(2, 7, b"")];
    store
        .write_checkpoint(space, &checkpoint(20, b"r2", second))
        .unwrap();
    store
        .write_checkpoint(other, &checkpoint(5, b"", vec![page(0, 0, b"z")]))
        .unwrap();
    store
        .write_checkpoint(space, &checkpoint(u64::MAX, b"", Vec::new()))
        .unwrap();

    let merged = store.checkpoint(space).unwrap().unwrap();
    assert_eq!(merged.next_block, u64::MAX);
    assert_eq!(merged.recorders, b"");
    let expected: [(u8, u32, &[u8]); 2] = [(0, 0, b"a0"), (0, 256, b"A256")];
    assert_eq!(contents(&merged), expected);
}

#[test]
fn a_checkpoint_is_read_as_of_one_instant() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let space = SpaceNumber(0);
    let write = |version: u64| {
        let bytes = version.to_be_bytes();
        let pages = (0..50).map(|index| page(0, index, &bytes)).collect();
        let written = store.write_checkpoint(space, &checkpoint(version, &bytes, pages));
        written.unwrap();
    };
    write(0);
    std::thread::scope(|scope| {
        let writer = scope.spawn(|| (1..300).for_each(write));
        while !writer.is_finished() {
            let read = store.checkpoint(space).unwrap().unwrap();
            let bytes = read.next_block.to_be_bytes();
            assert_eq!(read.recorders, bytes);
            assert_eq!(read.pages.len(), 50);
            assert!(read.pages.iter().all(|page| page.bytes == bytes));
        }
    });
}

#[test]
fn a_dropped_checkpoint_leaves_no_page_for_the_next() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let (space, other) = (SpaceNumber(0), SpaceNumber(1));
    let old = checkpoint(9, b"r", vec![page(0, 0, b"old"), page(0, 1, b"old")]);
    store.write_checkpoint(space, &old).unwrap();
    store.write_checkpoint(other, &old).unwrap();
    store.append(space, 0, b"kept").unwrap();

    store.drop_checkpoint(space).unwrap();
    assert!(store.checkpoint(space).unwrap().is_none());
    assert!(store.checkpoint(other).unwrap().is_some());
    assert_eq!(journal(&store, space, 0).len(), 1);

    let new = checkpoint(1, b"", vec![page(0, 1, b"new")]);
    store.write_checkpoint(space, &new).unwrap();
    let read = store.checkpoint(space).unwrap().unwrap();
    assert_eq!(contents(&read), [(0, 1, b"new".as_slice())]);
    store.drop_checkpoint(SpaceNumber(77)).unwrap();
}

#[test]
fn a_deleted_space_is_gone_and_its_name_free() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let kept = store.create_space("kept", b"").unwrap();
    let old = store.create_space("hall", b"old").unwrap();
    let fill = |space| {
        // More than one step of the deletion, and exactly two steps.
        for block in 0..8192 {
            store.append(space, block, b"block").unwrap();
        }
        let state = checkpoint(1, b"r", vec![page(0, 0, b"p")]);
        store.write_checkpoint(space, &state).unwrap();
        store.put_chunk(space, chunk_key(1, 1, 1), b"c").unwrap();
    };
    let is_empty = |space| {
        journal(&store, space, 0).is_empty()
            && store.checkpoint(space).unwrap().is_none()
            && store.chunks(space, 1, 1, 0, 10).unwrap().is_empty()
    };
    fill(kept);
    fill(old);
    store.delete_space(old).unwrap();
    store.delete_space(old).unwrap();

    let new = store.create_space("hall", b"new").unwrap();
    assert_ne!(new, old);
    assert!(is_empty(old) && is_empty(new) && !is_empty(kept));
    assert_eq!(journal(&store, kept, 0).len(), 8192);
    assert_eq!(store.spaces().unwrap().len(), 2);
}

#[test]
fn all_is_there_after_reopening() {
    let directory = directory();
    let nested = directory.path().join("new/store");
    let store = FjallStore::open(&nested).unwrap();
    let space = store.create_space("hall", b"settings").unwrap();
    let deleted = store.create_space("gone", b"").unwrap();
    store.delete_space(deleted).unwrap();
    store.append(space, 0, &vec![1; 70_000]).unwrap();
    let state = checkpoint(1, b"recorders", vec![page(1, 2, b"page")]);
    store.write_checkpoint(space, &state).unwrap();
    let key = chunk_key(1, 2, -3);
    store.put_chunk(space, key, b"chunk").unwrap();
    drop(store);

    let store = FjallStore::open(&nested).unwrap();
    assert_eq!(store.spaces().unwrap().len(), 1);
    assert_eq!(store.spaces().unwrap()[0].settings, b"settings");
    assert_eq!(journal(&store, space, 0), [(0, vec![1; 70_000])]);
    let read = store.checkpoint(space).unwrap().unwrap();
    assert_eq!(
        (read.next_block, read.recorders.as_slice()),
        (1, b"recorders".as_slice())
    );
    assert_eq!(contents(&read), [(1, 2, b"page".as_slice())]);
    let chunks = store.chunks(space, 1, 2, 0, 10).unwrap();
    assert_eq!(chunks, [(key, b"chunk".to_vec())]);
    // The number of a deleted space is not given out again, not even after a restart.
    assert!(store.create_space("gone", b"").unwrap() > deleted);
}
