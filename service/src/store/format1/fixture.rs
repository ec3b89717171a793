//! A store of format 1, kept in the tree and readable for ever.

use std::path::Path;

use super::super::disk_model::{Cut, DiskModel};
use super::super::local::copy_for_tests;
use super::super::{Derived, Journal, LocalStore};
use super::*;

fn block(number: u64) -> Vec<u8> {
    // Both sides of the length at which the engine of format 1 kept values beside its tables.
    let length = if number == 1 { 3000 } else { 30 };
    let byte = u8::try_from(number).unwrap();
    vec![byte; length]
}

/// As many as the first byte says: the blocks of the fixture are none of the engine's.
fn samples_in(block: &[u8]) -> u64 {
    u64::from(block[0])
}

fn fixture() -> tempfile::TempDir {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures");
    let directory = tempfile::tempdir().unwrap();
    copy_for_tests(&fixtures.join("store-v1"), directory.path());
    directory
}

/// What the fixture holds, and that the store can be gone on with.
fn assert_migrated(directory: &Path) {
    let store = LocalStore::open(directory).unwrap();
    let space = SpaceNumber(1);
    assert_eq!(
        store.spaces().unwrap(),
        [StoredSpace {
            number: space,
            name: "hall".to_owned(),
            settings: Some(b"settings".to_vec()),
        }]
    );
    let opened = store.open_journal(space).unwrap();
    let extent = Extent {
        blocks: 4,
        samples: 6,
    };
    assert_eq!((opened.extent, opened.mark_lost), (extent, false));
    let blocks: Vec<_> = store.journal(space, 0).map(Result::unwrap).collect();
    let expected: Vec<_> = (0..4).map(|number| (number, block(number))).collect();
    assert_eq!(blocks, expected);
    assert!(
        store.checkpoint(space).unwrap().is_none(),
        "it is made again"
    );

    assert_eq!(store.create_space("new", b"").unwrap(), SpaceNumber(2));
    store.append(space, 4, 1, &block(4)).unwrap();
    store.sync().unwrap();
    for old in ["version", "keyspaces", "0.jnl"] {
        assert!(!directory.join(old).exists(), "{old}");
    }
}

#[test]
fn a_store_of_format_1_becomes_one_of_format_2() {
    let directory = fixture();
    let opened = LocalStore::open(directory.path());
    assert!(matches!(opened, Err(StoreError::OlderFormat)), "{opened:?}");
    assert!(migrate(directory.path(), samples_in).unwrap());
    assert!(!migrate(directory.path(), samples_in).unwrap());
    assert_migrated(directory.path());
    assert!(!migrate(Path::new("/nowhere/at/all"), samples_in).unwrap());
}

#[test]
fn a_migration_cut_short_is_begun_again_or_finished() {
    // Before the deciding step the old store holds.
    let directory = fixture();
    let path = directory.path();
    fs::create_dir_all(path.join(UNFINISHED).join("1")).unwrap();
    fs::create_dir_all(path.join(SPACES).join("1")).unwrap();
    fs::write(path.join(SPACES).join("1/durable"), b"half").unwrap();
    fs::write(path.join("next_space"), b"half").unwrap();
    assert!(migrate(path, samples_in).unwrap());
    assert_migrated(path);

    // After it the new one does, whatever is left of the old one.
    let directory = fixture();
    let path = directory.path();
    assert!(migrate(path, samples_in).unwrap());
    let old = fixture();
    fs::copy(old.path().join("version"), path.join("version")).unwrap();
    copy_for_tests(&old.path().join("keyspaces"), &path.join("keyspaces"));
    assert!(!migrate(path, samples_in).unwrap());
    assert_migrated(path);
}

/// Puts the old store's own files back as they were, where the migration has not been decided. The
/// engine of format 1 writes to them in threads of its own, so a copy of the running store may hold
/// half of what it writes, which is no state that a power cut leaves.
fn restore_old_files(directory: &Path) {
    if !is_store(directory) || is_local_store(directory).unwrap() {
        return;
    }
    let old = fixture();
    fs::remove_dir_all(directory.join(KEYSPACES)).unwrap();
    for name in files::names(directory).unwrap() {
        if name.ends_with(JOURNAL_ENDING) {
            fs::remove_file(directory.join(name)).unwrap();
        }
    }
    copy_for_tests(old.path(), directory);
}

#[test]
fn whenever_the_power_is_cut_a_migration_is_begun_again_or_finished() {
    let directory = fixture();
    let model = DiskModel::of(directory.path());
    model.cut_before_each_sync(&[Cut::Lost]);
    assert!(migrate(directory.path(), samples_in).unwrap());
    let images = model.take_images();
    assert!(images.len() > 10, "{}", images.len());
    for image in images {
        restore_old_files(image.directory.path());
        let migrated = migrate(image.directory.path(), samples_in);
        assert!(migrated.is_ok(), "{:?}: {migrated:?}", image.cut);
        assert_migrated(image.directory.path());
    }
}
