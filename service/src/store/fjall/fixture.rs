//! A store of every released format, kept in the tree and readable for ever.

use super::disk_tests::copy_files;
use super::*;

/// Set, it makes the test write the fixture of the present format anew.
const WRITE_FIXTURE: &str = "COGMAP_WRITE_STORE_FIXTURE";

const KEY: ChunkKey = ChunkKey {
    agent: 3,
    session: 4,
    first_stamp_ns: -5,
};

fn block(number: u64) -> Vec<u8> {
    // Both sides of the length at which the engine keeps values beside its tables.
    let length = if number == 1 { 3000 } else { 30 };
    let byte = u8::try_from(number).unwrap();
    vec![byte; length]
}

fn state(next_block: u64, bytes: &[u8]) -> Checkpoint {
    let page = |kind, index| CheckpointPage {
        kind,
        index,
        bytes: bytes.to_vec(),
    };
    Checkpoint {
        next_block,
        pages: vec![page(0, 0), page(1, 70_000)],
        recorders: bytes.to_vec(),
    }
}

fn write_fixture(directory: &Path) {
    if directory.exists() {
        std::fs::remove_dir_all(directory).unwrap();
    }
    let store = FjallStore::open(directory).unwrap();
    let deleted = store.create_space("deleted", b"").unwrap();
    let space = store.create_space("hall", b"settings").unwrap();
    store.delete_space(deleted).unwrap();
    for number in 0..3 {
        store.append(space, number, &block(number)).unwrap();
    }
    store.write_checkpoint(space, &state(2, b"old")).unwrap();
    store.put_chunk(space, KEY, b"chunk").unwrap();
    // What follows stays in the engine's journal, so that the fixture has both kinds of file.
    for keyspace in [&store.journal, &store.entities, &store.trajectory] {
        keyspace.rotate_memtable_and_wait().unwrap();
    }
    store.append(space, 3, &block(3)).unwrap();
    let mut changed = state(3, b"new");
    changed.pages.truncate(1);
    store.write_checkpoint(space, &changed).unwrap();
    drop(store);
    // The engine begins its journal as 64 MiB of zeros and cuts it to its contents on reopening.
    drop(FjallStore::open(directory).unwrap());
    remove_empty_directories(directory);
}

/// Git would not keep them, so the store has to do without.
fn remove_empty_directories(directory: &Path) {
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            remove_empty_directories(&path);
            // Fails, as it should, where there is something in it.
            let _ = std::fs::remove_dir(path);
        }
    }
}

#[test]
fn a_store_of_format_1_is_read() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures");
    let fixture = fixtures.join("store-v1");
    if std::env::var_os(WRITE_FIXTURE).is_some() {
        write_fixture(&fixture);
    }
    let directory = tempfile::tempdir().unwrap();
    copy_files(&fixture, directory.path());

    let store = FjallStore::open(directory.path()).unwrap();
    let space = SpaceNumber(1);
    assert_eq!(
        store.spaces().unwrap(),
        [StoredSpace {
            number: space,
            name: "hall".to_owned(),
            settings: b"settings".to_vec(),
        }]
    );
    let blocks: Vec<_> = store.journal(space, 0).map(Result::unwrap).collect();
    let expected: Vec<_> = (0..4).map(|number| (number, block(number))).collect();
    assert_eq!(blocks, expected);
    assert_eq!(store.journal(SpaceNumber(0), 0).count(), 0);

    let checkpoint = store.checkpoint(space).unwrap().unwrap();
    assert_eq!(checkpoint.next_block, 3);
    assert_eq!(checkpoint.recorders, b"new");
    let pages = checkpoint.pages.iter();
    let pages: Vec<_> = pages
        .map(|page| (page.kind, page.index, page.bytes.as_slice()))
        .collect();
    let expected: [(u8, u32, &[u8]); 2] = [(0, 0, b"new"), (1, 70_000, b"old")];
    assert_eq!(pages, expected);
    let chunks = store.chunks(space, 3, 4, 0, 10).unwrap();
    assert_eq!(chunks, [(KEY, b"chunk".to_vec())]);

    // And it is a store to go on with.
    assert_eq!(store.create_space("new", b"").unwrap(), SpaceNumber(2));
    store.append(space, 4, &block(4)).unwrap();
    store.sync().unwrap();
}
