//! Directories in states that nobody wishes for.

use std::fs;

use tempfile::TempDir;

use super::*;

fn directory() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// Copies the files below `from`, as after a crash of the process that still has them open.
pub(super) fn copy_files(from: &Path, to: &Path) {
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

/// What a crash leaves, while the store stays open.
fn crash(store: &FjallStore) -> TempDir {
    let directory = directory();
    copy_files(&store.directory, directory.path());
    directory
}

fn blocks(store: &FjallStore, space: SpaceNumber) -> usize {
    store.journal(space, 0).map(Result::unwrap).count()
}

fn file_bytes(directory: &Path) -> u64 {
    let entries = fs::read_dir(directory).unwrap();
    let sizes = entries.map(|entry| {
        let entry = entry.unwrap();
        match entry.metadata().unwrap() {
            metadata if metadata.is_dir() => file_bytes(&entry.path()),
            metadata => metadata.len(),
        }
    });
    sizes.sum()
}

fn newest_journal(directory: &Path) -> PathBuf {
    let files = fs::read_dir(directory).unwrap().map(|e| e.unwrap().path());
    let journals = files.filter(|path| path.extension().is_some_and(|end| end == "jnl"));
    journals.max().unwrap()
}

#[test]
fn what_was_written_survives_the_process_without_a_sync() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let space = store.create_space("hall", b"").unwrap();
    store.append(space, 0, b"a small block").unwrap();
    store.append(space, 1, &vec![7; 100_000]).unwrap();
    let key = ChunkKey {
        agent: 0,
        session: 0,
        first_stamp_ns: 0,
    };
    store.put_chunk(space, key, b"chunk").unwrap();
    let crashed = crash(&store);

    let store = FjallStore::open(crashed.path()).unwrap();
    assert_eq!(store.spaces().unwrap().len(), 1);
    assert_eq!(blocks(&store, space), 2);
    assert_eq!(store.chunks(space, 0, 0, 0, 1).unwrap().len(), 1);
}

#[test]
fn a_block_written_by_half_is_left_out() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let space = store.create_space("hall", b"").unwrap();
    store.append(space, 0, b"whole").unwrap();
    let crashed = crash(&store);
    // Once more, so that the file ends with its last record.
    drop(FjallStore::open(crashed.path()).unwrap());
    let journal = newest_journal(crashed.path());
    let whole = fs::metadata(&journal).unwrap().len();
    let store = FjallStore::open(crashed.path()).unwrap();
    store.append(space, 1, &[7; 5000]).unwrap();
    drop(store);
    for torn in [whole + 1, whole + 100, whole + 4999] {
        let again = self::directory();
        copy_files(crashed.path(), again.path());
        let journal = newest_journal(again.path());
        let file = fs::File::options().write(true).open(journal).unwrap();
        file.set_len(torn).unwrap();
        let store = FjallStore::open(again.path()).unwrap();
        assert_eq!(blocks(&store, space), 1);
        store.append(space, 1, b"again").unwrap();
        drop(store);
        assert_eq!(blocks(&FjallStore::open(again.path()).unwrap(), space), 2);
    }
}

#[test]
fn a_deletion_cut_short_is_finished_at_the_next_opening() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let space = store.create_space("hall", b"").unwrap();
    store.append(space, 0, b"block").unwrap();
    // The deciding step of the deletion, and then the crash.
    let record = keys::meta_key(keys::SPACE, space);
    let mark = keys::meta_key(keys::DELETED, space);
    store.meta.remove(record).unwrap();
    store.meta.insert(&mark, []).unwrap();
    let crashed = crash(&store);

    let store = FjallStore::open(crashed.path()).unwrap();
    assert_eq!(blocks(&store, space), 0);
    assert!(!store.meta.contains_key(mark).unwrap());
}

#[test]
fn a_deleted_space_gives_its_room_on_the_disk_back() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let gone = store.create_space("gone", b"").unwrap();
    let kept = store.create_space("kept", b"").unwrap();
    for number in 0..100 {
        store.append(gone, number, &vec![1; 30_000]).unwrap();
        store.append(kept, number, &vec![2; 3000]).unwrap();
    }
    store.journal.rotate_memtable_and_wait().unwrap();
    let before = file_bytes(store.journal.path());
    assert!(before > 3_300_000, "{before}");

    store.delete_space(gone).unwrap();
    let after = file_bytes(store.journal.path());
    assert!((300_000..400_000).contains(&after), "{after}");
    assert_eq!(blocks(&store, kept), 100);
    drop(store);
    let store = FjallStore::open(directory.path()).unwrap();
    assert_eq!(blocks(&store, kept), 100);
}

#[test]
fn a_store_is_open_once_at_a_time() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let second = FjallStore::open(directory.path());
    assert!(matches!(second, Err(StoreError::Locked(_))), "{second:?}");
    drop(store);
    FjallStore::open(directory.path()).unwrap();
}

#[test]
fn a_newer_format_is_refused() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let newer = 2_u32.to_be_bytes();
    store.meta.insert(keys::FORMAT, newer).unwrap();
    drop(store);
    let opened = FjallStore::open(directory.path());
    assert!(
        matches!(
            opened,
            Err(StoreError::NewerFormat {
                found: 2,
                supported: 1
            })
        ),
        "{opened:?}"
    );
}

#[test]
fn nonsense_in_the_records_is_corruption() {
    for (key, value) in [
        (keys::FORMAT, b"garbage".as_slice()),
        (keys::FORMAT, &[0, 0, 0, 0]),
        ("deleted/x", &[]),
    ] {
        let directory = directory();
        let store = FjallStore::open(directory.path()).unwrap();
        store.meta.insert(key, value).unwrap();
        drop(store);
        let opened = FjallStore::open(directory.path());
        assert!(matches!(opened, Err(StoreError::Corrupt(_))), "{opened:?}");
    }

    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    for (key, value) in [
        ("space/x", [1, 0, 0, 0, 0].as_slice()),
        ("space/1", &[]),
        ("space/1", &[2, 0, 0, 0, 0]),
        ("space/1", &[1, 0, 0, 0, 9]),
        ("space/1", &[1, 0, 0, 0, 1, 0xff]),
    ] {
        store.meta.insert(key, value).unwrap();
        let spaces = store.spaces();
        assert!(matches!(spaces, Err(StoreError::Corrupt(_))), "{spaces:?}");
        store.meta.remove(key).unwrap();
    }
    assert_eq!(store.spaces().unwrap(), []);
}

#[test]
fn garbage_in_the_files_of_the_engine_is_corruption() {
    for file in ["version", "keyspaces/1/current", "keyspaces/0/current"] {
        let directory = directory();
        drop(FjallStore::open(directory.path()).unwrap());
        let path = directory.path().join(file);
        assert!(path.exists(), "{file}");
        fs::write(path, b"garbage, and more of it than anybody expects").unwrap();
        let opened = FjallStore::open(directory.path());
        assert!(
            matches!(opened, Err(StoreError::Corrupt(_))),
            "{file}: {opened:?}"
        );
    }
}

#[test]
fn a_directory_with_other_things_in_it_is_left_alone() {
    let directory = directory();
    let file = directory.path().join("thesis.tex");
    fs::write(&file, b"important").unwrap();
    let opened = FjallStore::open(directory.path());
    assert!(
        matches!(&opened, Err(StoreError::Io(reason)) if reason.contains("thesis.tex")),
        "{opened:?}"
    );
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);

    let opened = FjallStore::open(&file);
    assert!(matches!(opened, Err(StoreError::Io(_))), "{opened:?}");
    assert_eq!(fs::read(file).unwrap(), b"important");
}

#[test]
fn a_creation_cut_short_is_begun_again() {
    let directory = directory();
    fs::write(directory.path().join("lock"), []).unwrap();
    fs::create_dir(directory.path().join("keyspaces")).unwrap();
    fs::write(directory.path().join("0.jnl"), [0; 100]).unwrap();
    let store = FjallStore::open(directory.path()).unwrap();
    store.create_space("hall", b"").unwrap();
}

#[test]
fn a_journal_without_its_marker_is_not_taken_for_a_new_store() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    store.create_space("hall", b"").unwrap();
    drop(store);
    fs::remove_file(directory.path().join("version")).unwrap();
    let opened = FjallStore::open(directory.path());
    assert!(matches!(opened, Err(StoreError::Corrupt(_))), "{opened:?}");
    assert!(directory.path().join("0.jnl").exists());
}

#[test]
fn after_a_failed_write_the_store_reads_and_no_longer_writes() {
    let directory = directory();
    let store = FjallStore::open(directory.path()).unwrap();
    let space = store.create_space("hall", b"").unwrap();
    store.append(space, 0, b"block").unwrap();
    let failed = store.write(|| Err(std::io::Error::from(std::io::ErrorKind::StorageFull).into()));
    assert!(matches!(failed, Err(StoreError::DiskFull)));

    let refused = [
        store.append(space, 1, b"block"),
        store.sync(),
        store.drop_checkpoint(space),
        store.delete_space(space),
        store.create_space("new", b"").map(drop),
    ];
    for refusal in refused {
        assert!(matches!(refusal, Err(StoreError::Broken)), "{refusal:?}");
    }
    assert_eq!(blocks(&store, space), 1);
    drop(store);
    let store = FjallStore::open(directory.path()).unwrap();
    store.append(space, 1, b"block").unwrap();
    assert_eq!(blocks(&store, space), 2);
}
