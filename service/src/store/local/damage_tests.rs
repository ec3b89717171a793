//! Damage in a store: one space stops, the others do not, and repair and backups know what is
//! whole.

use std::fs;
use std::path::Path;

use super::tests::{blocks, directory, fill};
use super::*;
use crate::store::{Flaw, backup, restore};

/// A store of the spaces `damaged` and `sound`, forty blocks each.
fn store_of_two(path: &Path) -> [SpaceNumber; 2] {
    let store = LocalStore::open(path).unwrap();
    let spaces = ["damaged", "sound"].map(|name| store.create_space(name, b"{}").unwrap());
    for space in spaces {
        fill(&store, space, 40);
    }
    spaces
}

fn segment(path: &Path, space: SpaceNumber) -> PathBuf {
    let own = path.join(SPACES).join(space.0.to_string());
    own.join(format!("{:016x}.log", 0))
}

fn flip(file: &Path, at: usize) {
    let mut bytes = fs::read(file).unwrap();
    bytes[at] ^= 0x10;
    fs::write(file, bytes).unwrap();
}

#[test]
fn a_flipped_bit_stops_its_space_and_no_other() {
    let frame = 64 + 500;
    for at in [3, 70, 20 * frame + 5, 20 * frame + 90, 40 * frame - 1] {
        let directory = directory();
        let [damaged, sound] = store_of_two(directory.path());
        flip(&segment(directory.path(), damaged), at);
        let store = LocalStore::open(directory.path()).unwrap();
        let stopped = store.open_journal(damaged);
        let Err(StoreError::Damaged(found)) = stopped else {
            panic!("byte {at}: {stopped:?}");
        };
        let block = (at / frame) as u64;
        assert_eq!((&*found.space, found.first.block), ("damaged", block));
        assert_eq!(
            (found.lost.blocks, found.lost.samples),
            (1, 10),
            "{found:?}"
        );
        assert_eq!(
            found.acknowledged,
            Extent {
                blocks: 40,
                samples: 400
            }
        );
        let said = found.to_string();
        assert!(
            said.contains("cogmap store repair --space damaged"),
            "{said}"
        );
        // Up to the damage it can be read.
        let read: Vec<_> = store.journal(damaged, 0).collect();
        assert_eq!(read.len() as u64, block + 1);
        assert!(matches!(read.last(), Some(Err(StoreError::Damaged(_)))));

        assert_eq!(store.open_journal(sound).unwrap().extent.blocks, 40);
        fill(&store, sound, 5);
        assert_eq!(blocks(&store, sound, 0).len(), 45);
    }
}

#[test]
fn a_journal_cut_between_two_blocks_is_told_by_the_mark() {
    let directory = directory();
    let [damaged, _] = store_of_two(directory.path());
    let file = segment(directory.path(), damaged);
    let half = fs::metadata(&file).unwrap().len() / 2;
    File::options()
        .write(true)
        .open(file)
        .unwrap()
        .set_len(half)
        .unwrap();
    let surveys = verify(directory.path(), None).unwrap();
    assert_eq!(surveys.len(), 2);
    let survey = &surveys[0].survey;
    assert_eq!(survey.damage[0].flaw, Flaw::Missing);
    assert_eq!(
        survey.lost,
        Extent {
            blocks: 20,
            samples: 200
        }
    );
    assert!(surveys[1].survey.is_sound());
    let store = LocalStore::open(directory.path()).unwrap();
    // Who reads without opening it learns it at the end.
    let read: Vec<_> = store.journal(damaged, 0).collect();
    assert_eq!(read.len(), 21);
    assert!(matches!(read.last(), Some(Err(StoreError::Damaged(_)))));
    assert!(matches!(
        store.open_journal(damaged),
        Err(StoreError::Damaged(_))
    ));
}

#[test]
fn the_placeholder_of_a_lost_name_is_nobody_elses() {
    let directory = directory();
    let store = LocalStore::open(directory.path()).unwrap();
    for name in ["lost", "space-0", "space-0-lost"] {
        store.create_space(name, b"{}").unwrap();
    }
    drop(store);
    for name in ["space", "space.copy"] {
        flip(&directory.path().join(SPACES).join("0").join(name), 30);
    }
    let store = LocalStore::open(directory.path()).unwrap();
    let spaces = store.spaces().unwrap();
    let names: BTreeSet<_> = spaces.iter().map(|space| &*space.name).collect();
    let expected = ["space-0", "space-0-lost", "space-0-lost-lost"];
    assert_eq!(names, BTreeSet::from(expected));
    assert_eq!(store.journals().space("space-0").unwrap().number.0, 1);
}

#[test]
fn a_damaged_record_is_healed_from_its_copy_and_two_stop_the_space() {
    let directory = directory();
    let [damaged, _] = store_of_two(directory.path());
    let own = directory.path().join(SPACES).join(damaged.0.to_string());
    flip(&own.join("space"), 30);
    let store = LocalStore::open(directory.path()).unwrap();
    assert_eq!(store.spaces().unwrap()[0].name, "damaged");
    drop(store);
    for name in ["space", "space.copy"] {
        flip(&own.join(name), 30);
    }
    let store = LocalStore::open(directory.path()).unwrap();
    let spaces = store.spaces().unwrap();
    assert_eq!((&*spaces[0].name, &spaces[0].settings), ("space-0", &None));
    assert_eq!(spaces[1].name, "sound");
}

#[test]
fn a_replacement_takes_the_place_and_keeps_the_other_files() {
    let directory = directory();
    let [damaged, _] = store_of_two(directory.path());
    flip(&segment(directory.path(), damaged), 70);
    let store = LocalStore::open(directory.path()).unwrap();
    let space = store.journals().space("damaged").unwrap();
    // One that is given up leaves everything as it was.
    let mut given_up = store.journals().replace(&space).unwrap();
    given_up.append(1, b"block").unwrap();
    drop(given_up);
    assert_eq!(store.spaces().unwrap().len(), 2);

    let mut replacement = store.journals().replace(&space).unwrap();
    replacement.append(3, b"first").unwrap();
    replacement.append(4, b"second").unwrap();
    let (number, aside) = replacement.finish().unwrap();
    assert!(aside.join(format!("{:016x}.log", 0)).exists());
    drop(store);
    let store = LocalStore::open(directory.path()).unwrap();
    let spaces = store.spaces().unwrap();
    assert_eq!(spaces.len(), 2);
    let found = store.journals().space("damaged").unwrap();
    assert_eq!((found.number, found.settings), (number, space.settings));
    let extent = store.open_journal(number).unwrap().extent;
    assert_eq!((extent.blocks, extent.samples), (2, 7));
    assert!(store.create_space("new", b"").unwrap() > number);
}

#[test]
fn a_backup_beside_the_running_store_restores_what_was_acknowledged() {
    let directory = directory();
    let store = LocalStore::open(directory.path()).unwrap();
    let space = store.create_space("hall", b"{}").unwrap();
    fill(&store, space, 50);
    // After a power cut the mark may be older than what it has told of.
    let own = directory.path().join(SPACES).join(space.0.to_string());
    let older = Extent {
        blocks: 40,
        samples: 400,
    };
    create_mark(&own, space, older).unwrap();
    let home = self::directory();
    let (copy, restored) = (home.path().join("copy"), home.path().join("restored"));
    let report = backup(directory.path(), &copy).unwrap();
    assert_eq!(
        report.spaces[0].extent,
        Extent {
            blocks: 50,
            samples: 500
        }
    );
    assert!(backup(directory.path(), &copy).is_err(), "it is not empty");
    restore(&copy, &restored).unwrap();
    let again = LocalStore::open(&restored).unwrap();
    assert_eq!(again.open_journal(space).unwrap().extent.blocks, 50);
    let all = blocks(&store, space, 0);
    assert_eq!(blocks(&again, space, 0), all);
    assert_eq!(again.spaces().unwrap(), store.spaces().unwrap());

    // A damaged backup is not restored, and leaves nothing behind.
    flip(&segment(&copy, space), 100);
    let refused = home.path().join("refused");
    let error = restore(&copy, &refused).unwrap_err();
    assert!(matches!(error, StoreError::Damaged(_)), "{error}");
    assert!(!refused.exists());
}

#[test]
fn a_damaged_space_is_left_out_of_a_backup_by_name() {
    let directory = directory();
    let [damaged, _] = store_of_two(directory.path());
    flip(&segment(directory.path(), damaged), 9000);
    let home = self::directory();
    let report = backup(directory.path(), &home.path().join("copy")).unwrap();
    assert_eq!(report.spaces.len(), 1);
    assert_eq!(
        (&*report.spaces[0].name, report.spaces[0].extent.blocks),
        ("sound", 40)
    );
    assert_eq!(report.left_out[0].0, "damaged");
    assert!(report.left_out[0].1.contains("block 15"), "{report:?}");
}

#[test]
fn damage_in_what_is_derived_never_stops_the_store() {
    let directory = directory();
    let [space, _] = store_of_two(directory.path());
    let derived = directory.path().join("derived");
    for (name, bytes) in [
        ("version", &b"garbage"[..]),
        ("0.jnl", b"g"),
        ("keyspaces/0/current", b"x"),
    ] {
        let file = derived.join(name);
        assert!(file.exists(), "{name}");
        fs::write(file, bytes).unwrap();
        let store = LocalStore::open(directory.path()).unwrap();
        assert_eq!(store.open_journal(space).unwrap().extent.blocks, 40);
    }
    fs::remove_dir_all(&derived).unwrap();
    LocalStore::open(directory.path()).unwrap();
}
