//! The promises of the ports, which every end keeps: each function is a test of all of them.

use std::path::Path;

use cognitive_map::CheckpointPage;

use super::{Checkpoint, ChunkKey, Extent, SpaceNumber, Store, StoreError, StoredSpace};

/// Opens the store in a directory; one that is open there already is dropped before.
pub(super) type Open = fn(&Path) -> Box<dyn Store>;

/// Makes a test of an end of each function.
macro_rules! suite {
    ($open:expr) => {
        crate::store::suite::suite!($open;
            spaces_are_listed_by_number_with_name_and_settings,
            a_name_is_taken_once_and_may_be_anything,
            the_journal_comes_back_in_order_and_by_space,
            what_was_synced_is_there_when_the_store_is_opened_again,
            a_journal_is_opened_before_it_is_written,
            a_deleted_space_is_gone_and_its_name_free,
            a_draft_is_in_the_store_when_it_is_finished,
            a_checkpoint_is_the_merge_of_its_writes,
            chunks_start_at_the_last_one_that_begins_at_or_before,
            what_is_derived_is_forgotten_by_space,
        );
    };
    ($open:expr; $($name:ident,)+) => {
        $(#[test]
        fn $name() {
            crate::store::suite::$name($open);
        })+
    };
}
pub(super) use suite;

fn directory() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn blocks(store: &dyn Store, space: SpaceNumber, from: u64) -> Vec<(u64, Vec<u8>)> {
    store.journal(space, from).map(Result::unwrap).collect()
}

/// Appends blocks of ten samples each after those that are there, and acknowledges them.
fn fill(store: &dyn Store, space: SpaceNumber, count: u64) {
    let next = store.open_journal(space).unwrap().extent.blocks;
    for block in next..next + count {
        let bytes = vec![u8::try_from(block % 251).unwrap(); 500];
        store.append(space, block, 10, &bytes).unwrap();
    }
    store.sync().unwrap();
}

pub(super) fn key(agent: u32, session: u64, first_stamp_ns: i64) -> ChunkKey {
    ChunkKey {
        agent,
        session,
        first_stamp_ns,
    }
}

pub(super) fn page(kind: u8, index: u32, bytes: &[u8]) -> CheckpointPage {
    let bytes = bytes.to_vec();
    CheckpointPage { kind, index, bytes }
}

pub(super) fn checkpoint(
    next_block: u64,
    recorders: &[u8],
    pages: Vec<CheckpointPage>,
) -> Checkpoint {
    Checkpoint {
        next_block,
        pages,
        recorders: recorders.to_vec(),
    }
}

pub(super) fn spaces_are_listed_by_number_with_name_and_settings(open: Open) {
    let directory = directory();
    let store = open(directory.path());
    assert_eq!(store.spaces().unwrap(), []);
    // Past ten, where the order of decimal names is not that of the numbers.
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
            settings: Some(vec![11; 3]),
        }
    );
}

pub(super) fn a_name_is_taken_once_and_may_be_anything(open: Open) {
    let directory = directory();
    let store = open(directory.path());
    for name in ["", "a/b", "L\u{fc}beck", "../0"] {
        store.create_space(name, &[]).unwrap();
        let again = store.create_space(name, &[]);
        assert!(matches!(again, Err(StoreError::SpaceExists(taken)) if taken == name));
    }
    assert_eq!(store.spaces().unwrap().len(), 4);
    // Refusing a name is not a failed write.
    store.create_space("new", &[]).unwrap();
}

pub(super) fn the_journal_comes_back_in_order_and_by_space(open: Open) {
    let directory = directory();
    let store = open(directory.path());
    let spaces = ["a", "b", "c"].map(|name| store.create_space(name, b"").unwrap());
    let block = |space: SpaceNumber, number: u64| {
        let length = if number.is_multiple_of(7) { 5000 } else { 20 };
        vec![u8::try_from((number + u64::from(space.0)) % 251).unwrap(); length]
    };
    for space in spaces {
        assert_eq!(store.open_journal(space).unwrap().extent, Extent::default());
    }
    for number in 0..600 {
        for space in spaces {
            let bytes = block(space, number);
            store.append(space, number, 2, &bytes).unwrap();
        }
    }
    store.sync().unwrap();
    for space in spaces {
        let expected: Vec<_> = (0..600).map(|n| (n, block(space, n))).collect();
        assert_eq!(blocks(&*store, space, 0), expected);
        assert_eq!(blocks(&*store, space, 255), expected[255..]);
        assert_eq!(blocks(&*store, space, 600), []);
        let extent = store.open_journal(space).unwrap().extent;
        assert_eq!((extent.blocks, extent.samples), (600, 1200));
    }
    let mut reading = store.journal(spaces[0], 599);
    store.append(spaces[0], 600, 0, b"later").unwrap();
    assert_eq!(reading.next().unwrap().unwrap().0, 599);
    assert!(reading.next().is_none(), "the journal as it was when asked");
}

pub(super) fn what_was_synced_is_there_when_the_store_is_opened_again(open: Open) {
    let directory = directory();
    let store = open(directory.path());
    let spaces = ["hall", "yard"].map(|name| store.create_space(name, b"{}").unwrap());
    fill(&*store, spaces[0], 3);
    fill(&*store, spaces[1], 300);
    let expected = spaces.map(|space| blocks(&*store, space, 0));
    drop(store);
    let store = open(directory.path());
    for (space, expected) in spaces.into_iter().zip(expected) {
        let extent = store.open_journal(space).unwrap().extent;
        let count = expected.len() as u64;
        assert_eq!((extent.blocks, extent.samples), (count, 10 * count));
        assert_eq!(blocks(&*store, space, 0), expected);
        fill(&*store, space, 2);
        assert_eq!(blocks(&*store, space, count).len(), 2);
    }
}

pub(super) fn a_journal_is_opened_before_it_is_written(open: Open) {
    let directory = directory();
    let store = open(directory.path());
    let space = store.create_space("hall", b"").unwrap();
    let unopened = store.append(space, 0, 1, b"block");
    assert!(unopened.is_err(), "its journal is not open");
    store.open_journal(space).unwrap();
    store.append(space, 0, 1, b"block").unwrap();
    store.sync().unwrap();
    assert_eq!(blocks(&*store, space, 0), [(0, b"block".to_vec())]);
}

pub(super) fn a_deleted_space_is_gone_and_its_name_free(open: Open) {
    let directory = directory();
    let store = open(directory.path());
    let kept = store.create_space("kept", b"").unwrap();
    let gone = store.create_space("gone", b"").unwrap();
    fill(&*store, kept, 100);
    fill(&*store, gone, 400);
    store
        .write_checkpoint(gone, &checkpoint(1, &[1; 3_000], Vec::new()))
        .unwrap();
    store.put_chunk(gone, key(1, 1, 1), b"chunk").unwrap();
    store.delete_space(gone).unwrap();
    store.delete_space(gone).unwrap();
    assert!(store.checkpoint(gone).unwrap().is_none());
    assert!(store.chunks(gone, 1, 1, 0, 10).unwrap().is_empty());
    assert!(store.append(gone, 400, 1, b"").is_err());
    let new = store.create_space("gone", b"new").unwrap();
    assert!(new > gone, "a number is not given out again");
    drop(store);
    let store = open(directory.path());
    assert_eq!(store.spaces().unwrap().len(), 2);
    assert_eq!(blocks(&*store, kept, 0).len(), 100);
    assert_eq!(blocks(&*store, gone, 0), []);
    assert!(store.create_space("more", b"").unwrap() > new);
}

pub(super) fn a_draft_is_in_the_store_when_it_is_finished(open: Open) {
    let directory = directory();
    let store = open(directory.path());
    let mut given_up = store.draft("hall", b"{}").unwrap();
    given_up.append(0, b"block").unwrap();
    drop(given_up);
    let mut late = store.draft("hall", b"{}").unwrap();
    late.append(0, b"late").unwrap();
    let mut draft = store.draft("hall", b"{}").unwrap();
    draft.append(2, b"first").unwrap();
    assert!(store.spaces().unwrap().is_empty());
    let number = draft.finish().unwrap();
    let taken = late.finish();
    assert!(
        matches!(taken, Err(StoreError::SpaceExists(_))),
        "{taken:?}"
    );
    assert!(matches!(
        store.draft("hall", b""),
        Err(StoreError::SpaceExists(_))
    ));
    let mut lost = store.draft("lost", b"").unwrap();
    lost.append(1, b"lost").unwrap();
    // As a crash does.
    std::mem::forget(lost);
    drop(store);
    let store = open(directory.path());
    assert_eq!(store.spaces().unwrap().len(), 1);
    let extent = store.open_journal(number).unwrap().extent;
    assert_eq!((extent.blocks, extent.samples), (1, 2));
    assert_eq!(blocks(&*store, number, 0), [(0, b"first".to_vec())]);
    assert!(store.create_space("lost", b"").unwrap() > number);
}

pub(super) fn a_checkpoint_is_the_merge_of_its_writes(open: Open) {
    let directory = directory();
    let store = open(directory.path());
    let [space, other] = ["a", "b"].map(|name| store.create_space(name, b"").unwrap());
    assert!(store.checkpoint(space).unwrap().is_none());
    let first = vec![page(0, 0, b"a0"), page(0, 256, b"a256"), page(1, 0, b"b0")];
    // A page of no bytes is none: it removes what was stored.
    let second = vec![page(0, 256, b"A256"), page(1, 0, b""), page(2, 7, b"")];
    for (space, state) in [
        (space, checkpoint(10, b"r1", first)),
        (space, checkpoint(20, b"r2", second)),
        (other, checkpoint(5, b"", vec![page(0, 0, b"z")])),
        (space, checkpoint(u64::MAX, b"", Vec::new())),
    ] {
        store.write_checkpoint(space, &state).unwrap();
    }
    drop(store);
    let store = open(directory.path());
    let merged = store.checkpoint(space).unwrap().unwrap();
    assert_eq!(
        (merged.next_block, merged.recorders),
        (u64::MAX, Vec::new())
    );
    assert_eq!(merged.pages, [page(0, 0, b"a0"), page(0, 256, b"A256")]);
    let other = store.checkpoint(other).unwrap().unwrap();
    assert_eq!(other.pages, [page(0, 0, b"z")]);
}

pub(super) fn chunks_start_at_the_last_one_that_begins_at_or_before(open: Open) {
    let directory = directory();
    let store = open(directory.path());
    let space = store.create_space("hall", b"").unwrap();
    let stamps = [i64::MIN, -256, -1, 0, 1, 300, i64::MAX];
    // Backwards, so that the order is the store's own.
    for stamp_ns in stamps.into_iter().rev() {
        let bytes = stamp_ns.to_string();
        let put = store.put_chunk(space, key(7, 2, stamp_ns), bytes.as_bytes());
        put.unwrap();
    }
    for neighbour in [key(7, 1, 0), key(7, 3, 0), key(6, 2, 0), key(8, 2, 0)] {
        store.put_chunk(space, neighbour, b"other").unwrap();
    }
    let read = |from_ns, limit| -> Vec<i64> {
        let chunks = store.chunks(space, 7, 2, from_ns, limit).unwrap();
        for (key, bytes) in &chunks {
            assert_eq!((key.agent, key.session), (7, 2));
            assert_eq!(*bytes, key.first_stamp_ns.to_string().into_bytes());
        }
        chunks.iter().map(|(key, _)| key.first_stamp_ns).collect()
    };
    assert_eq!(read(i64::MIN, 100), stamps);
    assert_eq!(read(0, 100), stamps[3..]);
    assert_eq!(read(-2, 100), stamps[1..]);
    assert_eq!(read(299, 2), stamps[4..6]);
    assert_eq!(read(i64::MAX, 100), [i64::MAX]);
    assert_eq!(read(0, 0), [0; 0]);
    // One that begins after the instant is found when none begins before.
    store.put_chunk(space, key(1, 1, 50), b"old").unwrap();
    store.put_chunk(space, key(1, 1, 50), b"new").unwrap();
    let chunks = store.chunks(space, 1, 1, -50, 10).unwrap();
    assert_eq!(chunks, [(key(1, 1, 50), b"new".to_vec())]);
    assert_eq!(store.chunks(space, 1, 9, 0, 10).unwrap(), []);
}

pub(super) fn what_is_derived_is_forgotten_by_space(open: Open) {
    let directory = directory();
    let store = open(directory.path());
    let spaces = ["a", "b"].map(|name| store.create_space(name, b"").unwrap());
    for space in spaces {
        fill(&*store, space, 2);
        let state = checkpoint(2, b"r", vec![page(0, 0, b"page")]);
        store.write_checkpoint(space, &state).unwrap();
        store.put_chunk(space, key(0, 0, 0), b"chunk").unwrap();
    }
    store.forget(spaces[0]).unwrap();
    assert!(store.checkpoint(spaces[0]).unwrap().is_none());
    assert!(store.chunks(spaces[0], 0, 0, 0, 9).unwrap().is_empty());
    assert_eq!(blocks(&*store, spaces[0], 0).len(), 2, "the journal stays");
    assert!(store.checkpoint(spaces[1]).unwrap().is_some());
    assert_eq!(store.chunks(spaces[1], 0, 0, 0, 9).unwrap().len(), 1);
}
