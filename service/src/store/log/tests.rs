//! Journals in files that somebody has damaged.

use std::fs;
use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::store::SpaceNumber;
use crate::store::disk_model::DiskModel;

const SPACE: SpaceNumber = SpaceNumber(5);

fn block(number: u64) -> Vec<u8> {
    let byte = u8::try_from(number % 251).unwrap();
    let length = usize::try_from(1 + (number * 37) % 300).unwrap();
    vec![byte; length]
}

/// Opens a journal; there must be nothing wrong with it but a torn tail.
fn open(directory: &Path) -> SpaceLog {
    let survey = Survey::of(directory, SPACE).unwrap();
    assert!(survey.is_sound(), "{survey:?}");
    SpaceLog::open(directory, SPACE, &survey).unwrap()
}

/// Appends `count` blocks of as many samples as their number.
fn append(log: &SpaceLog, count: u64) {
    let next = log.appended().blocks;
    for number in next..next + count {
        log.append(number, number, &block(number)).unwrap();
    }
}

fn sync(log: &SpaceLog) {
    if let Some(pending) = log.pending() {
        log.sync(&pending).unwrap();
    }
}

/// A journal of `count` acknowledged blocks.
fn journal(directory: &Path, count: u64) {
    create_mark(directory, SPACE, Extent::default()).unwrap();
    let log = open(directory);
    append(&log, count);
    sync(&log);
}

/// Numbers of the blocks that can be read, all of which must be as written, and the damages.
fn read(directory: &Path) -> (Vec<u64>, Vec<Damage>) {
    let mut reader = LogReader::open(directory, SPACE, 0).unwrap();
    let (mut blocks, mut damages) = (Vec::new(), Vec::new());
    while let Some(item) = reader.next().unwrap() {
        match item {
            Item::Block(header) => {
                assert_eq!(
                    reader.payload(),
                    block(header.block),
                    "block {}",
                    header.block
                );
                blocks.push(header.block);
            }
            Item::Damage(damage) => damages.push(damage),
        }
    }
    (blocks, damages)
}

fn segment(directory: &Path) -> std::path::PathBuf {
    directory.join(segment_name(0))
}

#[test]
fn what_was_appended_is_read_and_appended_to_again() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path();
    journal(path, 10);
    let log = open(path);
    assert_eq!(
        log.appended(),
        Extent {
            blocks: 10,
            samples: 45
        }
    );
    let wrong = log.append(12, 0, b"");
    assert!(wrong.is_err(), "a gap in the numbers is refused");
    append(&log, 5);
    assert_eq!(read(path), ((0..15).collect(), Vec::new()));
    let mut reader = LogReader::open(path, SPACE, 12).unwrap();
    let first = reader.next().unwrap();
    assert!(
        matches!(first, Some(Item::Block(header)) if header.block == 12),
        "{first:?}"
    );
}

#[test]
fn a_full_segment_is_followed_by_another_one() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path();
    create_mark(path, SPACE, Extent::default()).unwrap();
    let log = open(path);
    let large = vec![7; 30 << 20];
    for number in 0..5 {
        log.append(number, 1, &large).unwrap();
    }
    sync(&log);
    for first in [0, 2, 4] {
        assert!(path.join(segment_name(first)).exists(), "{first}");
    }
    let survey = Survey::of(path, SPACE).unwrap();
    assert_eq!(
        survey.readable,
        Extent {
            blocks: 5,
            samples: 5
        }
    );
    assert!(survey.is_sound() && survey.torn_tail.is_none());

    // A segment that is gone, in the middle and at the end, is missed.
    for (gone, lost) in [(2, 2), (4, 1)] {
        let name = path.join(segment_name(gone));
        let bytes = fs::read(&name).unwrap();
        fs::remove_file(&name).unwrap();
        let survey = Survey::of(path, SPACE).unwrap();
        assert_eq!(survey.damage[0].block, gone);
        assert_eq!(
            survey.lost,
            Extent {
                blocks: lost,
                samples: lost
            }
        );
        fs::write(&name, bytes).unwrap();
    }
}

/// As a crash leaves it between the creation of a file and the first write to it.
#[test]
fn an_empty_segment_hides_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path();
    create_mark(path, SPACE, Extent::default()).unwrap();
    fs::write(path.join(segment_name(0)), b"").unwrap();
    let log = open(path);
    append(&log, 10);
    sync(&log);
    drop(log);
    fs::write(path.join(segment_name(10)), b"").unwrap();
    let log = open(path);
    append(&log, 5);
    let mut reader = LogReader::open(path, SPACE, 12).unwrap();
    let first = reader.next().unwrap();
    assert!(
        matches!(first, Some(Item::Block(header)) if header.block == 12),
        "{first:?}"
    );
    assert_eq!(read(path), ((0..15).collect(), Vec::new()));
}

#[test]
fn a_torn_tail_is_cut_and_what_was_acknowledged_is_not() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path();
    journal(path, 10);
    let acknowledged = fs::metadata(segment(path)).unwrap().len();
    let log = open(path);
    append(&log, 1);
    drop(log);
    let whole = fs::read(segment(path)).unwrap();
    for length in acknowledged + 1..whole.len() as u64 {
        fs::write(segment(path), &whole[..usize::try_from(length).unwrap()]).unwrap();
        let survey = Survey::of(path, SPACE).unwrap();
        assert!(survey.is_sound());
        assert_eq!(survey.torn_tail.as_ref().map(|tail| tail.block), Some(10));
        drop(open(path));
        assert_eq!(fs::metadata(segment(path)).unwrap().len(), acknowledged);
    }
    // One byte less is a part of what was acknowledged; so is a whole block less.
    for length in [acknowledged - 1, 0] {
        fs::write(segment(path), &whole[..usize::try_from(length).unwrap()]).unwrap();
        let survey = Survey::of(path, SPACE).unwrap();
        assert!(
            !survey.is_sound() && survey.torn_tail.is_none(),
            "{survey:?}"
        );
        assert_eq!(survey.acknowledged.blocks, 10);
    }
}

/// The mark may be a second old after a power cut. What the blocks say of those before them holds
/// too.
#[test]
fn a_block_that_a_later_one_calls_durable_was_acknowledged() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path();
    journal(path, 3);
    let log = open(path);
    append(&log, 1);
    sync(&log);
    append(&log, 1);
    drop(log);
    create_mark(
        path,
        SPACE,
        Extent {
            blocks: 3,
            samples: 3,
        },
    )
    .unwrap();
    let mut bytes = fs::read(segment(path)).unwrap();
    let at = |number: u64| -> usize { (0..number).map(|n| 64 + block(n).len()).sum() };
    bytes[at(3) + 64] ^= 1;
    fs::write(segment(path), &bytes).unwrap();
    let survey = Survey::of(path, SPACE).unwrap();
    assert_eq!(survey.damage.len(), 1, "{survey:?}");
    assert_eq!(
        survey.lost,
        Extent {
            blocks: 1,
            samples: 3
        }
    );
    bytes[at(3) + 64] ^= 1;
    bytes[at(4) + 64] ^= 1;
    fs::write(segment(path), &bytes).unwrap();
    let survey = Survey::of(path, SPACE).unwrap();
    assert!(survey.is_sound(), "{survey:?}");
    assert_eq!(survey.torn_tail.map(|tail| tail.block), Some(4));
}

#[test]
fn a_lost_mark_is_told_and_nothing_is_cut_without_it() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path();
    journal(path, 10);
    fs::remove_file(path.join("durable")).unwrap();
    let survey = Survey::of(path, SPACE).unwrap();
    assert!(survey.mark_lost && survey.is_sound());
    drop(open(path));
    assert!(
        !Survey::of(path, SPACE).unwrap().mark_lost,
        "it is made anew"
    );

    fs::remove_file(path.join("durable")).unwrap();
    let bytes = fs::read(segment(path)).unwrap();
    fs::write(segment(path), &bytes[..bytes.len() - 1]).unwrap();
    let survey = Survey::of(path, SPACE).unwrap();
    assert!(survey.mark_lost && !survey.is_sound(), "{survey:?}");
}

#[test]
fn a_zero_page_costs_the_blocks_that_it_covers() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path();
    journal(path, 400);
    let mut bytes = fs::read(segment(path)).unwrap();
    let page = bytes.len() / 8192 * 4096;
    bytes[page..page + 4096].fill(0);
    fs::write(segment(path), &bytes).unwrap();
    let (blocks, damages) = read(path);
    let [damage] = &*damages else {
        panic!("one damage: {damages:?}");
    };
    let next = damage.next.unwrap();
    let expected: Vec<_> = (0..damage.block).chain(next..400).collect();
    assert_eq!(blocks, expected);
    assert!(next - damage.block < 40, "{damage:?}");
    let survey = Survey::of(path, SPACE).unwrap();
    let samples = (damage.block..next).sum();
    let lost = Extent {
        blocks: next - damage.block,
        samples,
    };
    assert_eq!((survey.lost, survey.acknowledged.blocks), (lost, 400));
}

/// What lies in a bad sector is lost, and nothing before or behind it.
#[test]
fn a_sector_that_the_disk_does_not_read_costs_the_blocks_that_lie_in_it() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path();
    journal(path, 400);
    let length = fs::metadata(segment(path)).unwrap().len();
    let mut ends = Vec::new();
    for number in 0..400 {
        let end: u64 = ends.last().copied().unwrap_or(0);
        ends.push(end + 64 + block(number).len() as u64);
    }
    for sector in [0, 1, 9, length / 4096 - 1, length / 4096] {
        let model = DiskModel::of(path);
        let bad = 4096 * sector..4096 * (sector + 1);
        model.make_unreadable(&segment(path), bad.clone());
        let (blocks, damages) = read(path);
        let first = ends.partition_point(|end| *end <= bad.start) as u64;
        let last = ends.partition_point(|end| *end < bad.end) as u64;
        let expected: Vec<_> = (0..first).chain(last + 1..400).collect();
        assert_eq!(blocks, expected, "sector {sector}");
        assert_eq!(damages.len(), 1, "{damages:?}");
        assert_eq!(
            (damages[0].block, damages[0].flaw),
            (first, Flaw::Unreadable)
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// Whatever is done to the bytes: no panic, no block that differs from what was written, every
    /// block that is not read is told, and a file that differs in its blocks is never sound.
    #[test]
    fn any_bytes_are_read_without_a_lie(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
        inserted in prop::option::of((
            any::<prop::sample::Index>(),
            prop::collection::vec(any::<u8>(), 1..80),
        )),
        copied in prop::option::of((any::<prop::sample::Index>(), any::<prop::sample::Index>())),
    ) {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path();
        journal(path, 30);
        let whole = fs::read(segment(path)).unwrap();
        let mut bytes = whole.clone();
        for (at, byte) in edits {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if let Some((at, more)) = inserted {
            let at = at.index(bytes.len());
            bytes.splice(at..at, more);
        }
        if let Some((from, to)) = copied {
            let from = from.index(bytes.len());
            let piece = bytes[from..(from + 400).min(bytes.len())].to_vec();
            let to = to.index(bytes.len());
            bytes.splice(to..to, piece);
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        fs::write(segment(path), &bytes).unwrap();
        let (blocks, _) = read(path);
        prop_assert!(blocks.is_sorted_by(|a, b| a < b));
        let survey = Survey::of(path, SPACE).unwrap();
        prop_assert_eq!(survey.readable.blocks, blocks.len() as u64);
        prop_assert_eq!(survey.lost.blocks, 30 - blocks.len() as u64);
        prop_assert_eq!(survey.is_sound(), bytes == whole);
    }
}
