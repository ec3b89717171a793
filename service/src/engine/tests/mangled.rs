//! Journals that something has happened to, from their bytes to the map: nothing panics, and what
//! is wrong is
//! named or the map is the one that it was.

use std::fs;
use std::path::{Path, PathBuf};

use proptest::sample::Index;
use proptest::test_runner::Config;

use super::*;
use crate::engine::health::Health;
use crate::engine::recovery::{Loading, recover};
use crate::engine::trajectory::{Recorder, note_all};
use crate::journal::{BlockWriter, entries};

/// So many cases, or as many as `PROPTEST_CASES` says.
fn cases(count: u32) -> Config {
    let asked_for = std::env::var_os("PROPTEST_CASES").is_some();
    let config = Config::default();
    let cases = if asked_for { config.cases } else { count };
    Config { cases, ..config }
}

/// A change of some bytes.
#[derive(Clone, Debug)]
enum Change {
    Set(Index, u8),
    Flip(Index, u8),
    Insert(Index, Vec<u8>),
    Remove(Index, usize),
    Repeat(Index, Index, usize),
    Cut(Index),
}

fn change() -> impl Strategy<Value = Change> {
    let at = any::<Index>;
    prop_oneof![
        4 => (at(), any::<u8>()).prop_map(|(at, byte)| Change::Set(at, byte)),
        4 => (at(), 0..8_u8).prop_map(|(at, bit)| Change::Flip(at, bit)),
        1 => (at(), prop::collection::vec(any::<u8>(), 1..20))
            .prop_map(|(at, bytes)| Change::Insert(at, bytes)),
        1 => (at(), 1..300_usize).prop_map(|(at, count)| Change::Remove(at, count)),
        1 => (at(), at(), 1..300_usize)
            .prop_map(|(from, to, count)| Change::Repeat(from, to, count)),
        1 => at().prop_map(Change::Cut),
    ]
}

fn changed(bytes: &[u8], changes: &[Change]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for change in changes {
        if bytes.is_empty() {
            break;
        }
        let length = bytes.len();
        match change {
            Change::Set(at, byte) => bytes[at.index(length)] = *byte,
            Change::Flip(at, bit) => bytes[at.index(length)] ^= 1 << bit,
            Change::Insert(at, more) => {
                let at = at.index(length);
                bytes.splice(at..at, more.iter().copied());
            }
            Change::Remove(at, count) => {
                let at = at.index(length);
                bytes.drain(at..length.min(at + count));
            }
            Change::Repeat(from, to, count) => {
                let (from, to) = (from.index(length), to.index(length));
                let piece = bytes[from..length.min(from + count)].to_vec();
                bytes.splice(to..to, piece);
            }
            Change::Cut(at) => bytes.truncate(at.index(length)),
        }
    }
    bytes
}

/// A journal with every kind of entry in it.
fn blocks() -> Vec<Vec<u8>> {
    let samples = |agent, session, first: usize, count| Entry::Samples {
        agent,
        batch: SampleBatch {
            session,
            first_seq: first as u64,
            samples: drive()[first..first + count].to_vec(),
        },
    };
    let enrol = |agent, name: &'static str| Entry::Enrol {
        agent,
        name: name.into(),
    };
    let skip = Entry::Skip {
        agent: 0,
        session: SESSION,
        from: 50,
        to: 51,
        reason: SkipReason::NumberOutOfRange,
    };
    let forget = Entry::Forget {
        number: 0,
        name: "cup".into(),
    };
    let journal = [
        vec![enrol(0, AGENT), samples(0, SESSION, 0, 50), skip],
        vec![
            enrol(1, "bea"),
            samples(1, 1, 0, 20),
            samples(0, SESSION, 51, 30),
        ],
        vec![forget, samples(1, 1, 20, 10), Entry::Remove { agent: 1 }],
        vec![enrol(2, "cid"), samples(2, 9, 0, 30)],
    ];
    journal.iter().map(|entries| written(entries)).collect()
}

fn written(entries: &[Entry<'_>]) -> Vec<u8> {
    let mut writer = BlockWriter::new();
    for entry in entries {
        writer.push(entry);
    }
    writer.bytes().to_vec()
}

/// Folds blocks as a start does, those that can be read.
fn fold(blocks: &[Vec<u8>]) -> CognitiveMap {
    let settings = SpaceSettings::default();
    let mut map = CognitiveMap::new(core_settings(&settings).expect("the defaults are valid"));
    let interval_ns = trajectory_interval_ns(&settings);
    let (mut recorders, mut events) = (Vec::new(), Vec::new());
    for entry in blocks
        .iter()
        .filter_map(|block| entries(block).ok())
        .flatten()
    {
        records_of(&entry, |record| {
            map.apply(&record, &mut events);
            events.clear();
            note_all(&mut recorders, &map, &record, interval_ns);
        });
    }
    assert!(recorders.len() <= map.agent_numbers());
    assert_eq!(
        Recorder::read_all(&Recorder::write_all(&recorders)),
        Ok((recorders, &[][..]))
    );
    map
}

proptest! {
    #![proptest_config(cases(512))]

    /// Any bytes are entries or an error, and the entries are the same when they are written again.
    #[test]
    fn a_block_of_any_bytes_is_read_or_refused(
        bytes in prop_oneof![
            prop::collection::vec(any::<u8>(), 0..200),
            (0..4_usize, prop::collection::vec(change(), 1..6))
                .prop_map(|(block, changes)| changed(&blocks()[block], &changes)),
        ],
    ) {
        if let Ok(read) = entries(&bytes) {
            let once = written(&read);
            let again = entries(&once).expect("what was written is read");
            prop_assert_eq!(written(&again), once);
        }
    }
}

proptest! {
    #![proptest_config(cases(48))]

    /// Whatever entries a journal holds, they fold, and to one map.
    #[test]
    fn a_journal_of_any_entries_folds(
        changes in prop::collection::vec((0..4_usize, prop::collection::vec(change(), 1..4)), 1..4),
    ) {
        let mut journal = blocks();
        for (block, changes) in &changes {
            journal[*block] = changed(&journal[*block], changes);
        }
        let map = fold(&journal);
        prop_assert_eq!(map.digest(), fold(&journal).digest());
        for (_, agent) in map.agents() {
            let pose = agent.pose();
            prop_assert!(pose.translation.vector.iter().all(|number| number.is_finite()));
        }
    }
}

/// The only segment of the journal of the only space.
fn segment(directory: &Path) -> PathBuf {
    directory.join("spaces/0/0000000000000000.log")
}

/// A store whose journal holds the blocks, acknowledged.
fn store_of(directory: &Path, blocks: &[Vec<u8>]) -> LocalStore {
    let store = LocalStore::open(directory).expect("the store opens");
    let space = store.create_space(SPACE, b"{}").expect("created");
    store.open_journal(space).expect("opened");
    for (number, block) in (0..).zip(blocks) {
        let samples = crate::journal::samples_in(block);
        store
            .append(space, number, samples, block)
            .expect("appended");
    }
    store.sync().expect("synced");
    store
}

#[test]
fn a_journal_whose_file_is_changed_anywhere_is_the_same_map_or_is_named() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let store = store_of(directory.path(), &blocks());
    let whole = fs::read(segment(directory.path())).expect("read");
    let expected = fold(&blocks()).digest();
    let settings = SpaceSettings::default();
    let core = core_settings(&settings).expect("the defaults are valid");
    drop(store);
    let mut runner = proptest::test_runner::TestRunner::new(cases(24));
    let run = runner.run(&prop::collection::vec(change(), 1..5), |changes| {
        let bytes = changed(&whole, &changes);
        fs::write(segment(directory.path()), &bytes).expect("written");
        let store = LocalStore::open(directory.path()).expect("the store opens");
        let space = store.spaces().expect("spaces")[0].number;
        let loading = Loading {
            store: &store,
            health: &Health::default(),
            name: SPACE,
            space,
            settings: &core,
            interval_ns: trajectory_interval_ns(&settings),
        };
        match recover(&loading, || false) {
            Ok(recovered) => {
                prop_assert_eq!(recovered.map.digest(), expected);
                // Bytes behind the last block were never acknowledged.
                prop_assert!(bytes.starts_with(&whole));
            }
            Err(error) => {
                prop_assert!(bytes != whole);
                let said = error.to_string();
                prop_assert!(said.contains("is damaged: block"), "{}", said);
            }
        }
        Ok(())
    });
    run.expect("the journal is the same or is named");
}

/// Numbers that no service has ever written.
#[test]
fn the_last_numbers_of_all_fold_to_nothing() {
    let mut writer = BlockWriter::new();
    for agent in [0, u32::MAX] {
        writer.push(&Entry::Samples {
            agent,
            batch: SampleBatch {
                session: u64::MAX,
                first_seq: u64::MAX - 1,
                samples: drive()[..3].to_vec(),
            },
        });
        writer.push(&Entry::Remove { agent });
    }
    let mut journal = blocks();
    journal.push(writer.bytes().to_vec());
    fold(&journal);
}
