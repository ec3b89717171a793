//! What a power cut leaves between any two steps, and what a failing disk does: nothing that was
//! acknowledged
//! is lost, and nothing is acknowledged that is not on the disk.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use super::disk_model::{Cut, DiskModel, Failing};
use super::tests::directory;
use super::*;
use crate::store::{backup, restore};

/// Ways in which a power cut is tried at each step.
const CUTS: [Cut; 4] = [Cut::Lost, Cut::Kept, Cut::Torn(1), Cut::Torn(2)];

/// What somebody has been told: number of the blocks of a space that are durable, or that it is
/// gone.
type Promise = BTreeMap<&'static str, Option<u64>>;

fn open(path: &Path) -> LocalJournal {
    let opened = opening::open(path, true);
    opened
        .expect("whatever a power cut leaves can be opened")
        .journal
}

fn block(space: &str, number: u64) -> Vec<u8> {
    let length = 100 + 90 * usize::try_from(number % 9).unwrap();
    let mut bytes = format!("{space} {number} ").into_bytes();
    bytes.resize(length, u8::try_from(number % 251).unwrap());
    bytes
}

fn append(journal: &LocalJournal, space: SpaceNumber, name: &str, count: u64) {
    let next = journal.open_journal(space).unwrap().extent.blocks;
    for number in next..next + count {
        journal
            .append(space, number, 3, &block(name, number))
            .unwrap();
    }
}

/// Opens what is left of a store: it keeps the promise, every space can be loaded, and all go on.
fn assert_keeps(path: &Path, promise: &Promise, what: &str) {
    let journal = open(path);
    let spaces = journal.spaces().unwrap();
    for (name, promised) in promise {
        let found = spaces.iter().filter(|space| space.name == *name).count();
        assert_eq!(found, usize::from(promised.is_some()), "{what}: {name}");
    }
    for StoredSpace { number, name, .. } in spaces {
        let opened = journal.open_journal(number);
        let opened = opened.unwrap_or_else(|error| panic!("{what}: {name}: {error}"));
        let promised = promise.get(&*name).copied().flatten().unwrap_or(0);
        let blocks = opened.extent.blocks;
        assert!(
            blocks >= promised,
            "{what}: {blocks} of {promised} blocks of {name}"
        );
        append(&journal, number, &name, 2);
        journal.sync().unwrap();
        let read: Vec<_> = journal.journal(number, 0).map(Result::unwrap).collect();
        let expected: Vec<_> = (0..blocks + 2).map(|n| (n, block(&name, n))).collect();
        assert_eq!(read, expected, "{what}: {name}");
    }
}

/// Leaves a torn block behind the first space's journal.
fn tear(path: &Path) {
    let segment = path.join(SPACES).join("0").join(format!("{:016x}.log", 0));
    let mut bytes = fs::read(&segment).unwrap();
    bytes.extend(b"CGM2, and no more");
    fs::write(&segment, bytes).unwrap();
}

#[test]
fn whenever_the_power_is_cut_what_was_acknowledged_is_there() {
    let home = directory();
    let path = home.path().join("store");
    let model = DiskModel::of(home.path());
    model.cut_before_each_sync(&CUTS);
    let mut promises = vec![Promise::new()];
    let mut promise = |change: &[(&'static str, Option<Option<u64>>)]| {
        let mut next = promises.last().unwrap().clone();
        for (name, promised) in change {
            match promised {
                Some(promised) => next.insert(name, *promised),
                None => next.remove(name),
            };
        }
        promises.push(next);
        model.promise(promises.len() as u64 - 1);
    };
    let durable = |blocks| Some(Some(blocks));

    let journal = open(&path);
    let hall = journal.create_space("hall", b"{}").unwrap();
    promise(&[("hall", durable(0))]);
    append(&journal, hall, "hall", 3);
    journal.sync().unwrap();
    promise(&[("hall", durable(3))]);
    let yard = journal.create_space("yard", b"{}").unwrap();
    promise(&[("yard", durable(0))]);
    for round in 1..4 {
        append(&journal, hall, "hall", 2);
        append(&journal, yard, "yard", 5);
        journal.sync().unwrap();
        promise(&[
            ("hall", durable(3 + 2 * round)),
            ("yard", durable(5 * round)),
        ]);
    }
    // A kill between an append and its sync, and a torn block behind.
    append(&journal, hall, "hall", 4);
    drop(journal);
    tear(&path);
    let journal = open(&path);
    assert_eq!(journal.open_journal(hall).unwrap().extent.blocks, 13);
    promise(&[("hall", durable(13))]);
    append(&journal, hall, "hall", 1);
    journal.sync().unwrap();
    promise(&[("hall", durable(14)), ("yard", None)]);
    // Until it is deleted it may be there or not.
    journal.delete_space(yard).unwrap();
    promise(&[("yard", Some(None))]);
    let shed = journal.create_space("shed", b"{}").unwrap();
    promise(&[("shed", durable(0))]);
    append(&journal, shed, "shed", 2);
    journal.sync().unwrap();
    promise(&[("shed", durable(2))]);
    drop(journal);

    let images = model.take_images();
    assert!(images.len() > 30 * CUTS.len(), "{}", images.len());
    for image in images {
        let kept = &promises[usize::try_from(image.promised).unwrap()];
        let what = format!("{:?} after {kept:?}", image.cut);
        assert_keeps(&image.directory.path().join("store"), kept, &what);
    }
}

/// What a kill has left in files that no sync had covered, a start calls durable.
#[test]
fn blocks_that_a_start_has_found_survive_a_power_cut_in_whatever_segment() {
    let home = directory();
    let model = DiskModel::of(home.path());
    let path = home.path().join("store");
    let journal = open(&path);
    let space = journal.create_space("hall", b"{}").unwrap();
    journal.open_journal(space).unwrap();
    let large = vec![7; 33 << 20];
    for number in 0..3 {
        journal.append(space, number, 1, &large).unwrap();
    }
    drop(journal);
    let journal = open(&path);
    assert_eq!(journal.open_journal(space).unwrap().extent.blocks, 3);
    let left = model.cut(Cut::Lost);
    let journal = open(&left.path().join("store"));
    let opened = journal.open_journal(space).expect("it is whole");
    assert_eq!(opened.extent.blocks, 3, "{opened:?}");
}

#[test]
fn a_repair_that_is_cut_leaves_the_old_journal_or_the_new_one() {
    let home = directory();
    let path = home.path().join("store");
    let journal = open(&path);
    let space = journal.create_space("hall", b"{}").unwrap();
    append(&journal, space, "hall", 5);
    journal.sync().unwrap();
    drop(journal);
    let segment = path.join(SPACES).join("0").join(format!("{:016x}.log", 0));
    let mut bytes = fs::read(&segment).unwrap();
    bytes[70] ^= 1;
    fs::write(&segment, bytes).unwrap();

    let model = DiskModel::of(home.path());
    model.cut_before_each_sync(&CUTS);
    let journal = open(&path);
    let stored = journal.space("hall").unwrap();
    let mut replacement = journal.replace(&stored).unwrap();
    for number in 0..3 {
        replacement.append(3, &block("hall", number)).unwrap();
    }
    replacement.finish().unwrap();
    model.promise(1);
    drop(journal);
    drop(open(&path));
    let images = model.take_images();
    assert!(images.len() > 10 * CUTS.len(), "{}", images.len());
    for image in images {
        let journal = open(&image.directory.path().join("store"));
        let spaces = journal.spaces().unwrap();
        let [found] = &*spaces else {
            panic!("{:?}: {spaces:?}", image.cut);
        };
        assert_eq!((&*found.name, &found.settings), ("hall", &stored.settings));
        match journal.open_journal(found.number) {
            Ok(opened) => assert_eq!(opened.extent.blocks, 3, "{:?}", image.cut),
            Err(StoreError::Damaged(_)) if image.promised == 0 => {
                assert_eq!(found.number, space, "{:?}", image.cut);
            }
            Err(error) => panic!("{:?}: {error}", image.cut),
        }
    }
}

#[test]
fn a_draft_that_is_cut_is_whole_or_not_there() {
    let home = directory();
    let path = home.path().join("store");
    drop(open(&path));
    let model = DiskModel::of(home.path());
    model.cut_before_each_sync(&CUTS);
    let journal = open(&path);
    let mut draft = journal.draft("hall", b"{}").unwrap();
    for number in 0..3 {
        draft.append(0, &block("hall", number)).unwrap();
    }
    draft.finish().unwrap();
    model.promise(1);
    drop(journal);
    drop(open(&path));
    let images = model.take_images();
    assert!(images.len() > 5 * CUTS.len(), "{}", images.len());
    for image in images {
        let journal = open(&image.directory.path().join("store"));
        match &*journal.spaces().unwrap() {
            [] => assert_eq!(image.promised, 0, "{:?}", image.cut),
            [found] => {
                assert_eq!(found.name, "hall");
                let opened = journal.open_journal(found.number).unwrap();
                assert_eq!(opened.extent.blocks, 3, "{:?}", image.cut);
            }
            more => panic!("{:?}: {more:?}", image.cut),
        }
    }
}

#[test]
fn a_backup_that_is_cut_is_whole_or_is_refused() {
    let home = directory();
    let path = home.path().join("store");
    let journal = open(&path);
    for name in ["hall", "yard"] {
        let space = journal.create_space(name, b"{}").unwrap();
        append(&journal, space, name, 7);
    }
    journal.sync().unwrap();
    let model = DiskModel::of(home.path());
    model.cut_before_each_sync(&CUTS);
    backup(&path, &home.path().join("copy")).unwrap();
    model.promise(1);
    restore(&home.path().join("copy"), &home.path().join("restored")).unwrap();
    model.promise(2);
    drop(journal);
    drop(open(&path));
    let whole = Promise::from([("hall", Some(7)), ("yard", Some(7))]);
    for image in model.take_images() {
        for (name, promised) in [("copy", 1), ("restored", 2)] {
            let copy = image.directory.path().join(name);
            match opening::open(&copy, false) {
                Ok(opened) => {
                    drop(opened);
                    assert_keeps(&copy, &whole, &format!("{name}, {:?}", image.cut));
                }
                Err(error) => assert!(image.promised < promised, "{:?}: {error}", image.cut),
            }
        }
    }
}

#[test]
fn a_disk_that_fails_is_never_taken_for_one_that_has_written() {
    let failings = [
        Failing::Write(ErrorKind::StorageFull),
        Failing::Write(ErrorKind::Other),
        Failing::ShortWrite,
        Failing::Sync,
    ];
    for failing in failings {
        for passed in 0..9 {
            let what = format!("{failing:?} after {passed}");
            let home = directory();
            let path = home.path().join("store");
            let model = DiskModel::of(home.path());
            let journal = open(&path);
            let space = journal.create_space("hall", b"{}").unwrap();
            journal.open_journal(space).unwrap();
            let (mut durable, mut failed) = (0, false);
            model.fail(failing, passed);
            for number in 0..20 {
                let appended = journal.append(space, number, 3, &block("hall", number));
                let synced = appended.and_then(|()| journal.sync());
                assert!(!failed || synced.is_err(), "{what}: it goes on");
                failed |= synced.is_err();
                if !failed {
                    durable = number + 1;
                }
            }
            assert!(failed && !model.is_failing(), "{what}: nothing has failed");
            let refused = journal.create_space("yard", b"{}");
            assert!(refused.is_err(), "{what}: {refused:?}");
            let promise = Promise::from([("hall", Some(durable))]);
            for cut in CUTS {
                let left = model.cut(cut);
                assert_keeps(
                    &left.path().join("store"),
                    &promise,
                    &format!("{what}, {cut:?}"),
                );
            }
            drop(journal);
            assert_keeps(&path, &promise, &what);
        }
    }
}
