//! Relaxations while samples come in: whoever computes them, and whenever, the map is the same.

use std::collections::BTreeSet;
use std::thread;

use cognitive_map::{
    AgentId, CheckpointPage, CognitiveMap, EventKind, Motion, PoseNoise, Record, Relation,
    RelativePose, Sample, SampleBody, Settings, Sighting, Target,
};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::journal::{Robot, label, motion, settings, sighting, start_pose};

/// Steps of a round, ten a second.
const ROUND: usize = 40;
const STEP_NS: i64 = 100_000_000;

/// A robot that goes round in a circle with odometry that turns 2 % too much, and tells from the
/// second round on that it is where it was a round ago; one time in three it is wrong. Another one
/// stands by and begins a session now and then.
fn drive() -> Vec<Record> {
    let (robot, other) = (AgentId(0), AgentId(1));
    let mut records = vec![];
    for (agent, name) in [(robot, "robot"), (other, "other")] {
        let name = label(name);
        records.push(Record::Enrol { agent, name });
    }
    let (mut seq, mut motions) = (0, Vec::new());
    for step in 0..5 * ROUND {
        let stamp_ns = STEP_NS * i64::try_from(step).unwrap();
        let mut push = |agent, session, seq, body| {
            records.push(Record::Sample {
                agent,
                session,
                seq,
                sample: Sample { stamp_ns, body },
            });
        };
        let turn = std::f64::consts::TAU / ROUND as f64;
        motions.push(seq);
        let body = if step == 0 {
            start_pose([0.0; 3], [0.0; 3])
        } else {
            let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, turn * 1.02);
            let noise = PoseNoise::new([0.01, 0.01, 0.0], [0.0, 0.0, 0.01]).unwrap();
            let read = Motion::from_increment([0.3, 0.0, 0.0], rotation.coords.into(), Some(noise));
            SampleBody::Motion(read.unwrap())
        };
        push(robot, 1, seq, body);
        seq += 1;
        if step > ROUND && step % 4 == 0 {
            // No two wrong ones agree.
            let off_m = if step % 3 == 0 { 3.0 } else { 0.0 };
            let towards = Vector3::new((step as f64).cos(), (step as f64).sin(), 0.0);
            let seen = Isometry3::new(towards * off_m, Vector3::zeros());
            let noise = PoseNoise::new([0.05, 0.05, 0.0], [0.0, 0.0, 0.02]).unwrap();
            let at = (seen.translation.vector.into(), seen.rotation.coords.into());
            let at = RelativePose::new(at.0, at.1, noise).unwrap();
            let sighting = Sighting {
                target: Target::OwnSample(motions[step - ROUND]),
                relation: Relation::Pose(at),
            };
            push(robot, 1, seq, SampleBody::Sighting(sighting));
            seq += 1;
        }
        let (session, of_session) = (1 + step / 50, step % 50);
        let still = motion([0.0; 3], [0.0; 3]);
        push(other, session as u64, of_session as u64, still);
    }
    records
}

fn new_map() -> CognitiveMap {
    CognitiveMap::new(Settings::default())
}

/// Folds a drive; what is done between records is not to make a difference.
fn fold_with(records: &[Record], mut between: impl FnMut(usize, &mut CognitiveMap)) -> String {
    let (mut map, mut events) = (new_map(), Vec::new());
    for (at, record) in records.iter().enumerate() {
        map.apply(record, &mut events);
        between(at, &mut map);
    }
    let digest = map.digest();
    format!("{digest} {events:?}")
}

#[expect(
    clippy::disallowed_methods,
    reason = "threads beside the core, as a service has them"
)]
#[test]
fn who_relaxes_and_when_makes_no_difference() {
    let records = drive();
    let mut begun = BTreeSet::new();
    let alone = fold_with(&records, |_, map| {
        begun.extend(map.relaxation().map(cognitive_map::RelaxationJob::revision));
    });
    assert!(begun.len() >= 4, "{begun:?}");
    let at_once = fold_with(&records, |_, map| {
        map.relaxation().inspect(|job| job.run());
    });
    assert!(alone == at_once, "computed as soon as it begins");
    let mut threads = Vec::new();
    let beside = fold_with(&records, |at, map| {
        // Several at a time, and some after it is needed.
        if let Some(job) = map.relaxation().filter(|_| at % 3 > 0) {
            let job = job.clone();
            threads.push(thread::spawn(move || job.run()));
        }
    });
    assert!(alone == beside, "computed by other threads");
    assert!(threads.into_iter().all(|thread| thread.join().is_ok()));
}

#[test]
fn a_restart_while_one_is_under_way_makes_no_difference() {
    let records = drive();
    let alone = fold_with(&records, |_, _| ());
    for every in [1, 7, 64] {
        let mut under_way = 0;
        let restarted = fold_with(&records, |at, map| {
            if at % every == 0 {
                under_way += usize::from(map.relaxation().is_some());
                let digest = map.digest();
                *map = CognitiveMap::restore(Settings::default(), map.checkpoint(0)).unwrap();
                assert_eq!(map.digest(), digest);
            }
        });
        assert!(under_way > 0 || every > 7, "{every}");
        assert!(alone == restarted, "every {every} records");
    }
}

#[test]
fn a_snapshot_goes_on_like_the_map() {
    let records = drive();
    let (mut map, mut events) = (new_map(), Vec::new());
    let mut snapshots = Vec::new();
    for (at, record) in records.iter().enumerate() {
        map.apply(record, &mut events);
        if map.relaxation().is_some() && at % 5 == 0 && snapshots.len() < 6 {
            snapshots.push((at, map.clone()));
        }
    }
    assert_eq!(snapshots.len(), 6);
    for (at, mut snapshot) in snapshots {
        for record in &records[at + 1..] {
            snapshot.apply(record, &mut events);
        }
        assert_eq!(snapshot.digest(), map.digest(), "from record {at}");
    }
}

/// Closures count with a record half a second after the relaxation began, not before.
#[test]
fn a_closure_counts_half_a_second_later() {
    let (mut map, mut events) = (new_map(), Vec::new());
    let mut begun: Option<(u64, i64)> = None;
    let mut waits_ns = Vec::new();
    for record in &drive() {
        let closures = map.closure_count();
        map.apply(record, &mut events);
        let Record::Sample { sample, .. } = record else {
            continue;
        };
        if map.closure_count() != closures {
            waits_ns.push(sample.stamp_ns - begun.unwrap().1);
        }
        let job = map.relaxation().map(cognitive_map::RelaxationJob::revision);
        if begun.map(|(revision, _)| revision) != job {
            begun = job.map(|revision| (revision, sample.stamp_ns));
        }
    }
    assert!(waits_ns.len() > 1, "{waits_ns:?}");
    assert!(
        { waits_ns.iter() }.all(|wait_ns| *wait_ns == 5 * STEP_NS),
        "{waits_ns:?}"
    );
}

/// Whoever is moved by a closure is told how far, and where it is from its next sample on.
#[test]
fn who_is_corrected_is_told() {
    let (mut map, mut told) = (new_map(), 0);
    let mut last: Vector3<f64> = Vector3::zeros();
    let mut correction = None;
    for record in &drive() {
        let mut events = Vec::new();
        map.apply(record, &mut events);
        for event in events {
            if let EventKind::LoopsClosed(closed) = event.kind {
                assert_eq!(
                    (event.agent, closed.closures),
                    (AgentId(0), map.closure_count())
                );
                correction = Some(closed);
            }
        }
        let Record::Sample {
            agent: AgentId(0),
            sample,
            ..
        } = record
        else {
            continue;
        };
        let now = map.agent(AgentId(0)).unwrap().pose().translation.vector;
        if let Some(closed) = correction.take() {
            let is_moving = matches!(sample.body, SampleBody::Motion(_));
            let step_m = f64::from(u8::from(is_moving)) * 0.31;
            assert!((now - closed.position.coords).norm() <= step_m + 1e-9);
            assert!(((now - last).norm() - closed.moved_m).abs() <= step_m + 1e-9);
            told += 1;
        }
        last = now;
    }
    assert!(told > 1, "{told}");
}

/// A graph that is full still learns: what comes in place of what goes is relaxed, too.
#[test]
fn sightings_relax_a_past_that_is_full() {
    let mut map = CognitiveMap::new(settings(|values| values.keyframes_max = 64));
    let mut robot = Robot::enrol(&mut map);
    robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
    let turn = std::f64::consts::TAU / ROUND as f64;
    let (mut begun, mut last) = (Vec::new(), None);
    for step in 0..20 * ROUND {
        robot.go(&mut map, [0.3, 0.0, 0.0], [0.0, 0.0, turn]);
        robot.sample(&mut map, sighting("centre", [0.0, 1.9, 0.0], 0.05));
        let job = map.relaxation().map(cognitive_map::RelaxationJob::revision);
        if job.is_some() && job != last {
            begun.push(step);
        }
        last = job;
    }
    // The graph is full after two rounds, and has been renewed several times since.
    let late = begun.iter().filter(|step| **step > 10 * ROUND).count();
    assert!(late >= 4, "{begun:?}");
}

#[test]
fn damage_to_a_relaxation_under_way_is_found() {
    let (mut map, mut events) = (new_map(), Vec::new());
    let mut pages: Vec<CheckpointPage> = Vec::new();
    for record in &drive() {
        map.apply(record, &mut events);
        if map.relaxation().is_some() && map.closure_count() > 0 {
            pages = map.checkpoint(0).collect();
        }
    }
    let restore = |pages: &[CheckpointPage]| {
        CognitiveMap::restore(Settings::default(), pages.iter().cloned())
    };
    restore(&pages).unwrap();
    // The head of the keyframe graph, of which most is the outcome.
    let head = pages.iter().position(|page| page.kind == 10).unwrap();
    let whole = pages[head].bytes.clone();
    assert!(whole.len() > 1000, "{}", whole.len());
    for place in (0..whole.len()).step_by(37) {
        pages[head].bytes = whole[..place].to_vec();
        assert!(restore(&pages).is_err(), "cut off at {place}");
        pages[head].bytes = whole.clone();
        pages[head].bytes[place] ^= 4;
        assert!(restore(&pages).is_err(), "a bit of byte {place}");
    }
}
