//! Chunks of trajectories, by agent, session and stamp.

use super::*;

pub(super) fn chunk_key(agent: u32, session: u64, first_stamp_ns: i64) -> ChunkKey {
    ChunkKey {
        agent,
        session,
        first_stamp_ns,
    }
}

#[test]
fn chunks_start_at_the_last_one_that_begins_at_or_before() {
    let directory = tempfile::tempdir().unwrap();
    let store = FjallStore::open(directory.path()).unwrap();
    let space = SpaceNumber(0);
    let stamps = [i64::MIN, -256, -1, 0, 1, 300, i64::MAX];
    // Backwards, so that the order is the store's own.
    for stamp in stamps.into_iter().rev() {
        let bytes = stamp.to_string();
        let put = store.put_chunk(space, chunk_key(7, 2, stamp), bytes.as_bytes());
        put.unwrap();
    }
    for neighbour in [chunk_key(7, 1, 0), chunk_key(7, 3, 0), chunk_key(6, 2, 0)] {
        store.put_chunk(space, neighbour, b"other").unwrap();
    }
    let read = |from_ns, limit| -> Vec<i64> {
        let chunks = store.chunks(space, 7, 2, from_ns, limit).unwrap();
        for (key, bytes) in &chunks {
            assert_eq!((key.agent, key.session), (7, 2));
            assert_eq!(*bytes, key.first_stamp_ns.to_string().into_bytes());
        }
        let stamps = chunks.iter().map(|(key, _)| key.first_stamp_ns);
        stamps.collect()
    };
    assert_eq!(read(i64::MIN, 100), stamps);
    assert_eq!(read(0, 100), stamps[3..]);
    assert_eq!(read(-2, 100), stamps[1..]);
    assert_eq!(read(299, 2), stamps[4..6]);
    assert_eq!(read(i64::MAX, 100), [i64::MAX]);
    assert_eq!(read(0, 0), [0; 0]);
}

#[test]
fn chunks_after_the_instant_are_found_when_none_begins_before() {
    let directory = tempfile::tempdir().unwrap();
    let store = FjallStore::open(directory.path()).unwrap();
    let space = SpaceNumber(0);
    store.put_chunk(space, chunk_key(1, 1, 50), b"old").unwrap();
    store.put_chunk(space, chunk_key(1, 1, 50), b"new").unwrap();
    let chunks = store.chunks(space, 1, 1, -50, 10).unwrap();
    assert_eq!(chunks, [(chunk_key(1, 1, 50), b"new".to_vec())]);
    assert_eq!(store.chunks(space, 1, 9, 0, 10).unwrap(), []);
}
