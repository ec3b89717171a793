//! Stores on object storage, which is a directory here.

use std::path::Path;
use std::sync::Arc;

use super::super::{LocalStore, Store, copy};
use super::*;

crate::store::suite::suite!(|directory| Box::new(open(directory)));

fn open(directory: &Path) -> ObjectStore {
    ObjectStore::open(&url(directory)).unwrap()
}

fn url(directory: &Path) -> String {
    format!("file://{}", directory.display())
}

#[test]
fn whoever_opens_it_last_owns_it_and_the_one_before_writes_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let first = open(directory.path());
    let space = first.create_space("hall", b"{}").unwrap();
    first.open_journal(space).unwrap();
    first.append(space, 0, 1, b"acknowledged").unwrap();
    first.sync().unwrap();
    first.append(space, 1, 1, b"on its way").unwrap();

    let second = open(directory.path());
    let opened = second.open_journal(space).unwrap();
    assert_eq!(opened.extent.blocks, 1, "what was not synced is not there");
    second.append(space, 1, 1, b"of the second").unwrap();
    second.sync().unwrap();

    let synced = first.sync();
    assert!(matches!(synced, Err(StoreError::Fenced(_))), "{synced:?}");
    let appended = first.append(space, 2, 1, b"later");
    assert!(
        matches!(appended, Err(StoreError::Fenced(_))),
        "{appended:?}"
    );
    let created = first.create_space("yard", b"{}");
    assert!(matches!(created, Err(StoreError::Fenced(_))), "{created:?}");
    drop(first);
    second.append(space, 2, 1, b"and on").unwrap();
    second.sync().unwrap();
    drop(second);

    let third = open(directory.path());
    let blocks: Vec<_> = { third.journal(space, 0) }
        .map(|block| block.unwrap().1)
        .collect();
    assert_eq!(blocks, [&b"acknowledged"[..], b"of the second", b"and on"]);
}

#[test]
fn a_deletion_that_a_crash_cut_short_is_finished() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path());
    let space = store.create_space("hall", b"").unwrap();
    store.open_journal(space).unwrap();
    store.append(space, 0, 1, b"block").unwrap();
    let mut batch = WriteBatch::new();
    batch.delete(keys::space(space));
    batch.put(keys::deleted(space), []);
    store.database.commit(batch).unwrap();
    drop(store);
    let store = open(directory.path());
    assert_eq!(store.spaces().unwrap(), []);
    assert_eq!(store.journal(space, 0).count(), 0);
    assert_eq!(store.database.get(keys::deleted(space)).unwrap(), None);
}

#[test]
fn where_nothing_is_no_store_is_made_unless_so_wanted() {
    let directory = tempfile::tempdir().unwrap();
    let opened = ObjectStore::open_existing(&url(directory.path()));
    assert!(matches!(&opened, Err(StoreError::Io(text)) if text.contains("no store")));
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    drop(open(directory.path()));
    ObjectStore::open_existing(&url(directory.path())).unwrap();
}

#[test]
fn a_newer_format_and_nonsense_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path());
    let mut batch = WriteBatch::new();
    batch.put(keys::FORMAT, 2_u32.to_le_bytes());
    store.database.commit(batch).unwrap();
    drop(store);
    let opened = ObjectStore::open(&url(directory.path()));
    let newer = StoreError::NewerFormat {
        found: 2,
        supported: 1,
    };
    assert_eq!(opened.unwrap_err().to_string(), newer.to_string());
    for nonsense in ["file://relative", "s3:/bucket", "nothing://bucket", "s3://"] {
        let opened = ObjectStore::open(nonsense);
        assert!(
            matches!(&opened, Err(StoreError::Io(text)) if text.contains(nonsense)),
            "{opened:?}"
        );
    }
}

/// A block that is missing is told, and nothing after it is read.
#[test]
fn a_missing_block_is_told() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path());
    let space = store.create_space("hall", b"").unwrap();
    store.open_journal(space).unwrap();
    for block in 0..4 {
        store.append(space, block, 1, b"block").unwrap();
    }
    let mut batch = WriteBatch::new();
    batch.delete(keys::block(space, 2));
    store.database.commit(batch).unwrap();
    let read: Vec<_> = store.journal(space, 0).collect();
    assert_eq!(read.len(), 3);
    assert!(matches!(&read[2], Err(StoreError::Corrupt(text)) if text.contains("block 2")));
}

#[tokio::test]
async fn it_may_be_used_from_an_async_thread() {
    let directory = tempfile::tempdir().unwrap();
    let store: Arc<dyn Store> = Arc::new(open(directory.path()));
    let space = store.create_space("hall", b"").unwrap();
    assert!(store.checkpoint(space).unwrap().is_none());
    drop(store);
}

#[test]
fn a_copy_goes_from_any_end_to_any_other() {
    let home = tempfile::tempdir().unwrap();
    let at = |name: &str| home.path().join(name);
    let local = LocalStore::open(&at("local")).unwrap();
    for (name, count) in [("hall", 3), ("empty", 0), ("yard", 700)] {
        let space = local.create_space(name, name.as_bytes()).unwrap();
        local.open_journal(space).unwrap();
        for block in 0..count {
            let bytes = vec![u8::try_from(block % 251).unwrap(); 100];
            local.append(space, block, 100, &bytes).unwrap();
        }
    }
    local.sync().unwrap();
    let samples_in = |block: &[u8]| block.len() as u64;
    let object = open(&at("object"));
    let there = copy(&local, &object, samples_in).unwrap();
    let back = LocalStore::open(&at("back")).unwrap();
    assert_eq!(copy(&object, &back, samples_in).unwrap(), there);
    let contents = |store: &dyn Store| -> Vec<_> {
        let spaces = store.spaces().unwrap().into_iter().map(|space| {
            let extent = store.open_journal(space.number).unwrap().extent;
            let blocks: Vec<_> = store.journal(space.number, 0).map(Result::unwrap).collect();
            (space.name, space.settings, extent, blocks)
        });
        spaces.collect()
    };
    assert_eq!(contents(&object), contents(&local));
    assert_eq!(contents(&back), contents(&local));
    let again = copy(&local, &object, samples_in);
    assert!(
        matches!(again, Err(StoreError::SpaceExists(_))),
        "{again:?}"
    );
}
