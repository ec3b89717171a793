//! Journals with holes, and what becomes of what follows them.

use cogmap_proto::{
    Increment, Marker, RouteAvoid, RouteCost, RouteReverse, Sample, SampleBatch, SampleBody,
};
use cognitive_map::BlockageId;

use super::*;
use crate::journal::{JournaledBlocked, JournaledErrand, JournaledGoal};
use crate::store::Journal;

fn enrol(agent: u32, name: &'static str) -> Entry<'static> {
    Entry::Enrol {
        agent,
        name: name.into(),
    }
}

fn samples(agent: u32, session: u64, first_seq: u64, count: usize) -> Entry<'static> {
    let body = SampleBody::Marker(Marker {
        label: "dock".into(),
        ends_trip: false,
    });
    let samples = vec![Sample { stamp_ns: 5, body }; count];
    let batch = SampleBatch {
        session,
        first_seq,
        samples,
    };
    Entry::Samples { agent, batch }
}

fn forget(number: u64) -> Entry<'static> {
    let name = "cup".into();
    Entry::Forget { number, name }
}

fn lost(agent: u32, session: u64, from: u64, to: u64) -> Entry<'static> {
    Entry::Skip {
        agent,
        session,
        from,
        to,
        reason: SkipReason::Lost,
    }
}

fn instruct(number: u64, instruction: JournaledInstruction) -> Entry<'static> {
    Entry::Instruct {
        number,
        instruction,
    }
}

fn block(number: u64) -> Entry<'static> {
    let instruction = JournaledInstruction::Block {
        id: number,
        blocked: JournaledBlocked::Ball([1.0, 0.0, 0.0], 0.2),
        until_ns: None,
    };
    instruct(number, instruction)
}

fn follow(number: u64, agent: u32) -> Entry<'static> {
    let errand = JournaledErrand {
        goal: JournaledGoal::Position([0.0; 3]),
        cost: RouteCost::Length,
        reverse: RouteReverse::Allowed,
        avoid: RouteAvoid::default(),
    };
    instruct(number, JournaledInstruction::Follow { agent, errand })
}

/// The entries of a journal of these blocks after a repair in which one of them is lost, with the
/// report.
fn repaired(blocks: &[&[Entry<'static>]], gone: u64) -> (Vec<Entry<'static>>, RepairReport) {
    let directory = tempfile::tempdir().unwrap();
    let store = LocalStore::open(directory.path()).unwrap();
    let settings = serde_json::to_vec(&SpaceSettings::default()).unwrap();
    let number = store.create_space("lab", &settings).unwrap();
    store.open_journal(number).unwrap();
    let (mut writer, mut end) = (BlockWriter::new(), 0);
    for (number_of_block, block) in (0..).zip(blocks) {
        writer.clear();
        block.iter().for_each(|entry| writer.push(entry));
        let count = crate::journal::samples_in(writer.bytes());
        store
            .append(number, number_of_block, count, writer.bytes())
            .unwrap();
        if number_of_block <= gone {
            end += 64 + writer.bytes().len();
        }
    }
    store.sync().unwrap();
    drop(store);
    let segment = directory.path().join("spaces/0/0000000000000000.log");
    let mut bytes = std::fs::read(&segment).unwrap();
    bytes[end - 1] ^= 1;
    std::fs::write(&segment, bytes).unwrap();

    let store = LocalStore::open(directory.path()).unwrap();
    let space = store.journals().space("lab").unwrap();
    let report = repair(&store, &space).unwrap().expect("it is damaged");
    let space = store.journals().space("lab").unwrap();
    let mut read = Vec::new();
    for block in store.journal(space.number, 0) {
        read.extend(entries(&block.unwrap().1).unwrap());
    }
    assert!(repair(&store, &space).unwrap().is_none(), "it is whole");
    (read, report)
}

#[test]
fn samples_in_a_hole_are_journaled_as_lost() {
    let (read, report) = repaired(
        &[
            &[enrol(0, "ada"), enrol(1, "bea"), samples(0, 7, 0, 3)],
            &[samples(0, 7, 3, 2), samples(1, 4, 0, 1)],
            &[samples(0, 7, 5, 1), samples(1, 4, 1, 2)],
            &[samples(1, 5, 0, 1)],
        ],
        1,
    );
    let expected = [
        enrol(0, "ada"),
        enrol(1, "bea"),
        samples(0, 7, 0, 3),
        lost(0, 7, 3, 5),
        lost(1, 4, 0, 1),
        samples(0, 7, 5, 1),
        samples(1, 4, 1, 2),
        samples(1, 5, 0, 1),
    ];
    assert_eq!(read, expected);
    assert_eq!(
        (report.blocks_kept, report.samples_kept, report.samples_lost),
        (3, 7, 3)
    );
    let missing = [MissingSamples {
        session: 7,
        from: 3,
        to: 5,
        at_end: false,
    }];
    assert_eq!(
        (&*report.agents[0].name, &*report.agents[0].missing),
        ("ada", &missing[..])
    );
    assert_eq!(
        (report.damage[0].first, report.damage[0].next),
        (1, Some(2))
    );
}

#[test]
fn agents_keep_their_numbers_and_lessons_get_new_ones() {
    let (read, report) = repaired(
        &[
            &[enrol(0, "ada"), forget(0)],
            &[enrol(1, "bea"), forget(1), forget(2)],
            &[enrol(2, "cid"), forget(3), samples(1, 9, 4, 1)],
        ],
        1,
    );
    let expected = [
        enrol(0, "ada"),
        forget(0),
        enrol(1, "unknown-1"),
        lost(1, 9, 0, 4),
        enrol(2, "cid"),
        forget(1),
        samples(1, 9, 4, 1),
    ];
    assert_eq!(read, expected);
    assert!(report.agents[0].name_lost);
}

/// A robot that goes 2 m ahead, and stands still with every further sample.
fn walk(first_seq: u64, count: u64) -> Entry<'static> {
    let samples = (first_seq..first_seq + count).map(|seq| {
        let ahead = if seq < 20 { 0.1 } else { 0.0 };
        Sample {
            stamp_ns: i64::try_from(seq).unwrap() * 100_000_000,
            body: SampleBody::Increment(Increment {
                translation_m: [ahead, 0.0, 0.0],
                rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
                noise: None,
            }),
        }
    });
    let batch = SampleBatch {
        session: 1,
        first_seq,
        samples: samples.collect(),
    };
    Entry::Samples { agent: 0, batch }
}

fn folded(read: &[Entry<'static>]) -> CognitiveMap {
    let settings = core_settings(&SpaceSettings::default()).unwrap();
    let mut map = CognitiveMap::new(settings);
    for entry in read {
        crate::decode::records_of(entry, |record| map.apply(&record, &mut Vec::new()));
    }
    map
}

#[test]
fn blockages_and_followed_routes_outlive_a_hole() {
    let blocks: [&[_]; 3] = [
        &[enrol(0, "ada"), walk(0, 20)],
        &[
            block(0),
            instruct(1, JournaledInstruction::Unblock { id: 0 }),
        ],
        &[block(2), follow(3, 0), walk(20, 2)],
    ];
    let (read, _) = repaired(&blocks, 1);
    let map = folded(&read);
    let ids: Vec<_> = map.blockages().iter().map(|blockage| blockage.id).collect();
    assert_eq!(ids, [BlockageId(2)]);
    assert_eq!(map.instructions(), 4);
    // The blockage is between the robot and its goal, and no way leads round it.
    let agent = cognitive_map::AgentId(0);
    assert!(map.followed(agent).is_none());

    // The next blockage has a number of its own, and the robot can be sent off again.
    let next = [
        block(map.instructions()),
        instruct(5, JournaledInstruction::Unblock { id: 2 }),
        instruct(6, JournaledInstruction::Unblock { id: 4 }),
        follow(7, 0),
    ];
    let went_on: Vec<_> = read.iter().chain(&next[..1]).cloned().collect();
    assert_eq!(folded(&went_on).blockages().len(), 2);
    let went_on: Vec<_> = read.iter().chain(&next).cloned().collect();
    let map = folded(&went_on);
    assert_eq!(map.blockages(), []);
    assert!(!map.followed(agent).unwrap().rest().is_empty());
}

#[test]
fn a_route_is_followed_on_over_a_hole_behind_it() {
    let blocks: [&[_]; 3] = [
        &[enrol(0, "ada"), walk(0, 20), block(0), follow(1, 0)],
        &[forget(0)],
        &[
            instruct(2, JournaledInstruction::Unblock { id: 0 }),
            follow(3, 0),
            walk(20, 2),
        ],
    ];
    let (read, report) = repaired(&blocks, 1);
    assert!(report.agents.is_empty(), "nothing of the robot is missing");
    assert_eq!(read[..4], blocks[0][..]);
    assert_eq!(read[4..], blocks[2][..], "instructions are as they were");
    let map = folded(&read);
    assert_eq!(map.blockages(), []);
    assert!(map.followed(cognitive_map::AgentId(0)).is_some());
}

#[test]
fn a_damaged_end_is_cut_off() {
    let (read, report) = repaired(&[&[enrol(0, "ada")], &[samples(0, 1, 0, 2)]], 1);
    assert_eq!(read, [enrol(0, "ada")]);
    assert_eq!(report.samples_lost, 2);
    assert_eq!((report.damage[0].first, report.damage[0].next), (1, None));
}

/// A store of a space `lab` with these blocks, none of them damaged.
fn store_of(directory: &std::path::Path, blocks: &[&[u8]]) -> (LocalStore, StoredSpace) {
    let store = LocalStore::open(directory).unwrap();
    let settings = serde_json::to_vec(&SpaceSettings::default()).unwrap();
    let number = store.create_space("lab", &settings).unwrap();
    store.open_journal(number).unwrap();
    for (block, bytes) in (0..).zip(blocks) {
        store.append(number, block, 0, bytes).unwrap();
    }
    store.sync().unwrap();
    let space = store.journals().space("lab").unwrap();
    (store, space)
}

#[test]
fn a_block_that_is_whole_and_makes_no_sense_is_left_out() {
    let directory = tempfile::tempdir().unwrap();
    let mut writer = BlockWriter::new();
    writer.push(&enrol(0, "ada"));
    let (store, space) = store_of(
        directory.path(),
        &[writer.bytes(), &[1, 99], writer.bytes()],
    );
    let report = repair(&store, &space)
        .unwrap()
        .expect("it cannot be folded");
    assert_eq!(
        (report.damage[0].first, report.damage[0].next),
        (1, Some(2))
    );
    assert_eq!(report.blocks_kept, 2);
    let space = store.journals().space("lab").unwrap();
    assert!(repair(&store, &space).unwrap().is_none());
}

/// After an update that was taken back, damage elsewhere must not cost what the newer build has
/// written.
#[test]
fn blocks_of_a_newer_version_are_not_thrown_away() {
    let directory = tempfile::tempdir().unwrap();
    let (store, space) = store_of(directory.path(), &[&[1], &[1, 99], &[2, 0]]);
    let refused = repair(&store, &space).unwrap_err();
    assert!(refused.to_string().contains("update cogmap"), "{refused}");
    assert_eq!(
        store.journals().space("lab").unwrap(),
        space,
        "it is as it was"
    );
}
