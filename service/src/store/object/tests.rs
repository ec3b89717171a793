//! Stores on object storage, which is a directory here.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::super::{LocalStore, ShardNumber, Shards, Store, WholeStore, copy};
use super::*;

/// Where a node is reached.
const ADDRESS: &str = "127.0.0.1:8080";

crate::store::suite::suite!(|directory| Box::new(open(directory)));

fn open(directory: &Path) -> ObjectStore {
    open_url(&url(directory)).unwrap()
}

fn open_url(url: &str) -> Result<ObjectStore, StoreError> {
    ObjectStorage::open(url, Shards::ONE)?.open_shard(ShardNumber(0))
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
    let opened = ObjectStorage::open_existing(&url(directory.path()));
    assert!(matches!(&opened, Err(StoreError::Io(text)) if text.contains("no store")));
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    drop(open(directory.path()));
    ObjectStorage::open_existing(&url(directory.path())).unwrap();
}

#[test]
fn a_newer_format_and_nonsense_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let store = open(directory.path());
    let mut batch = WriteBatch::new();
    batch.put(keys::FORMAT, 2_u32.to_le_bytes());
    store.database.commit(batch).unwrap();
    drop(store);
    let opened = open_url(&url(directory.path()));
    let newer = StoreError::NewerFormat {
        found: 2,
        supported: 1,
    };
    assert_eq!(opened.unwrap_err().to_string(), newer.to_string());
    for nonsense in ["file://relative", "s3:/bucket", "nothing://bucket", "s3://"] {
        let opened = open_url(nonsense);
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
fn a_store_keeps_the_shards_that_it_was_created_with() {
    let directory = tempfile::tempdir().unwrap();
    let at = url(directory.path());
    let shards = |count| Shards::new(count).unwrap();
    assert_eq!(
        ObjectStorage::open(&at, shards(4)).unwrap().shards(),
        shards(4)
    );
    assert_eq!(
        ObjectStorage::open(&at, shards(9)).unwrap().shards(),
        shards(4)
    );
    assert_eq!(
        ObjectStorage::open_existing(&at).unwrap().shards(),
        shards(4)
    );
}

#[test]
fn of_two_who_claim_a_shard_one_has_it() {
    let directory = tempfile::tempdir().unwrap();
    let storage = ObjectStorage::open(&url(directory.path()), Shards::ONE).unwrap();
    let shard = ShardNumber(0);
    assert_eq!(storage.term_of(shard).unwrap(), 0);
    let first = storage.claim_shard(shard, 0).unwrap();
    assert_eq!((first.term(), storage.term_of(shard).unwrap()), (1, 1));
    let late = storage.claim_shard(shard, 0);
    assert!(matches!(late, Err(StoreError::Fenced(_))), "{late:?}");
    assert!(first.check_ownership().is_ok());
    let next = storage.claim_shard(shard, 1).unwrap();
    assert_eq!(next.term(), 2);
    // Given up, it may be claimed at once, and takes no more.
    next.give_up();
    assert!(next.create_space("hall", b"").is_err());
    assert_eq!(storage.open_shard(shard).unwrap().term(), 3);
}

#[test]
fn an_owner_that_writes_nothing_notices_too_that_it_is_none() {
    let directory = tempfile::tempdir().unwrap();
    let first = open(directory.path());
    let _second = open(directory.path());
    let deadline = Instant::now() + Duration::from_secs(30);
    while first.check_ownership().is_ok() {
        assert!(Instant::now() < deadline, "it has not noticed");
        std::thread::sleep(Duration::from_millis(10));
    }
    let refused = first.create_space("hall", b"");
    assert!(matches!(refused, Err(StoreError::Fenced(_))), "{refused:?}");
}

#[test]
fn a_store_that_nodes_are_at_work_on_is_opened_by_none_else() {
    let directory = tempfile::tempdir().unwrap();
    let storage = ObjectStorage::open(&url(directory.path()), Shards::ONE).unwrap();
    let (registry, timeout) = (storage.registry(), Duration::from_secs(5));
    let node = NodeId::parse("ada.1").unwrap();
    // Its beats come later than usual ones, and are awaited nevertheless.
    let (interval, between) = (Duration::from_secs(1), Duration::from_millis(2500));
    registry.beat(&node, ADDRESS, 0, interval, timeout).unwrap();
    assert!(storage.refuse_a_cluster().is_ok(), "it is gone");
    let stop = Arc::new(AtomicBool::new(false));
    let beating = {
        let (registry, node, stop) = (registry.clone(), node.clone(), Arc::clone(&stop));
        std::thread::spawn(move || {
            for count in 1.. {
                registry
                    .beat(&node, ADDRESS, count, interval, timeout)
                    .unwrap();
                if stop.load(Ordering::Relaxed) {
                    return;
                }
                std::thread::sleep(between);
            }
        })
    };
    let refused = storage.refuse_a_cluster();
    stop.store(true, Ordering::Relaxed);
    beating.join().unwrap();
    assert!(matches!(&refused, Err(StoreError::Io(text)) if text.contains("node ada")));
    // One that is hardly ever heard is not waited for.
    for interval in [Duration::from_secs(30), Duration::from_millis(u64::MAX)] {
        registry.beat(&node, ADDRESS, 0, interval, timeout).unwrap();
        let refused = storage.refuse_a_cluster();
        assert!(matches!(&refused, Err(StoreError::Io(text)) if text.contains("may be at work")));
    }
    registry.leave(&node, ADDRESS, timeout).unwrap();
    assert_eq!(registry.look(timeout).unwrap(), Seen::default());
}

#[test]
fn the_registry_tells_where_nodes_are_reached() {
    let directory = tempfile::tempdir().unwrap();
    let storage = ObjectStorage::open(&url(directory.path()), Shards::ONE).unwrap();
    let (registry, timeout) = (storage.registry(), Duration::from_secs(5));
    let nodes = [("ada.1", "10.0.0.1:8080"), ("b.c.2", "[fe80::1]:80")];
    for (node, address) in nodes {
        let node = NodeId::parse(node).unwrap();
        registry.beat(&node, address, 0, timeout, timeout).unwrap();
    }
    let seen = registry.look(timeout).unwrap().nodes;
    let told = |record: &NodeRecord| (record.node.to_string(), record.address.clone());
    let mut told: Vec<_> = seen.iter().map(told).collect();
    told.sort();
    let nodes = nodes.map(|(node, address)| (node.to_owned(), address.to_owned()));
    assert_eq!(told, nodes);
}

#[test]
fn the_registry_tells_owners() {
    let directory = tempfile::tempdir().unwrap();
    let storage = ObjectStorage::open(&url(directory.path()), Shards::ONE).unwrap();
    let (registry, timeout) = (storage.registry(), Duration::from_secs(5));
    let record = |shard, term, node| OwnerRecord {
        shard: ShardNumber(shard),
        term,
        node: NodeId::parse(node).unwrap(),
    };
    let records = [
        record(0, 3, "ada.1"),
        record(0, 12, "b.c.2"),
        record(7, 1, "ada.1"),
    ];
    for record in &records {
        registry.own(record, timeout).unwrap();
    }
    let mut owners = registry.look(timeout).unwrap().owners;
    owners.sort();
    assert_eq!(owners, records);
    registry.disown(&records[1], timeout).unwrap();
    registry.disown(&records[1], timeout).unwrap();
    assert_eq!(registry.look(timeout).unwrap().owners.len(), 2);
}

#[test]
fn a_copy_goes_from_any_end_to_any_other() {
    let home = tempfile::tempdir().unwrap();
    let at = |name: &str| home.path().join(name);
    let local = Arc::new(LocalStore::open(&at("local")).unwrap());
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
    let local = WholeStore::undivided(local);
    let object = ObjectStorage::open(&url(&at("object")), Shards::new(3).unwrap()).unwrap();
    let object = WholeStore::open(object.shards(), |shard| {
        object
            .open_shard(shard)
            .map(|shard| Arc::new(shard) as Arc<dyn Store>)
    })
    .unwrap();
    let there = copy(&local, &object, samples_in).unwrap();
    let back = WholeStore::undivided(Arc::new(LocalStore::open(&at("back")).unwrap()));
    assert_eq!(copy(&object, &back, samples_in).unwrap(), there);
    let contents = |store: &WholeStore| {
        let mut spaces = Vec::new();
        for (number, shard) in store.iter() {
            for space in shard.spaces().unwrap() {
                assert_eq!(store.shards().of(&space.name), number);
                let extent = shard.open_journal(space.number).unwrap().extent;
                let blocks: Vec<_> = shard.journal(space.number, 0).map(Result::unwrap).collect();
                spaces.push((space.name, space.settings, extent, blocks));
            }
        }
        spaces.sort();
        spaces
    };
    assert_eq!(contents(&object), contents(&local));
    assert_eq!(contents(&back), contents(&local));
    let again = copy(&local, &object, samples_in);
    assert!(
        matches!(again, Err(StoreError::SpaceExists(_))),
        "{again:?}"
    );
}
