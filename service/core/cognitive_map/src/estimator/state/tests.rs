use std::sync::Arc;

use nalgebra::{Isometry3, Vector3, Vector6};
use proptest::prelude::*;

use super::*;
use crate::estimator::Effect;
use crate::input::{
    Label, Motion, PoseNoise, RangeBearing, Relation, RelativePose, RelativePosition, StartPose,
};

/// Agents of a random stream; more than take part in one joint estimate.
const AGENTS: u32 = 40;
const SECOND_NS: i64 = 1_000_000_000;

/// One call: what, who, of whom or what, and three numbers within ±1.
type Call = (u8, u32, u32, [f64; 3]);

fn calls(len: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Call>> {
    let numbers = prop::array::uniform3(-1.0..1.0_f64);
    prop::collection::vec((0u8..32, 0..AGENTS, 0u32..160, numbers), len)
}

fn relation(kind: u8, [x, y, z]: [f64; 3]) -> Relation {
    let sd = [0.1, 0.2, 0.1];
    match kind % 3 {
        0 => Relation::Position(RelativePosition::new([5.0 * x, 5.0 * y, z], sd).unwrap()),
        1 => {
            let seen = RangeBearing::new(3.0 + 2.0 * x, 3.0 * y, z, 0.1, 0.05).unwrap();
            Relation::RangeBearing(seen)
        }
        _ => {
            let pose = Isometry3::new(Vector3::new(3.0 * x, 3.0 * y, z), Vector3::new(z, x, y));
            let noise = PoseNoise::new(sd, sd).unwrap();
            let turn = pose.rotation.coords.into();
            Relation::Pose(RelativePose::new(pose.translation.vector.into(), turn, noise).unwrap())
        }
    }
}

/// Does what a call says at a step of the stream. The first five agents do most of it.
fn apply(
    estimator: &mut Estimator,
    step: usize,
    &(kind, agent, other, numbers): &Call,
) -> Vec<Effect> {
    let mut effects = Vec::new();
    let agent = if kind % 4 == 0 { agent } else { agent % 5 };
    let target = if kind % 8 < 4 {
        other % AGENTS
    } else {
        other % 5
    };
    let stamp_ns = i64::try_from(step).unwrap() * SECOND_NS / 20;
    let [x, y, z] = numbers;
    match kind {
        0 => {
            estimator.found(agent);
        }
        1 => estimator.go_unseen(agent, &Vector6::repeat(x)),
        2 => {
            let noise = PoseNoise::new([0.1; 3], [0.1; 3]).unwrap();
            let start = StartPose::new([3.0 * x, y, z], [0.0, 0.0, 0.0, 1.0], noise);
            estimator.start_pose(agent, &start.unwrap(), &mut effects);
        }
        3..=12 => {
            let turn = if kind < 8 { [0.0, 0.0, y] } else { [z, x, y] };
            let moved = Motion::from_velocity([x, 0.0, 0.0], turn, 0.2, None).unwrap();
            estimator.motion(agent, stamp_ns, &moved, &mut effects);
        }
        13..=24 => {
            let label = Label::new(&format!("post-{}", other % 120)).unwrap();
            estimator.landmark(
                agent,
                stamp_ns,
                &label,
                &relation(kind, numbers),
                &mut effects,
            );
        }
        _ => estimator.sighting(
            agent,
            // Some before the target's latest motion, some after it.
            stamp_ns - SECOND_NS / 8,
            target,
            &relation(kind, numbers),
            &mut effects,
        ),
    }
    effects
}

fn team() -> Estimator {
    let mut estimator = Estimator::new(Parameters::default());
    for _ in 0..AGENTS {
        estimator.enrol();
    }
    estimator
}

fn bytes(estimator: &Estimator) -> Vec<u8> {
    let mut out = StateWriter::default();
    estimator.write(&mut out);
    out.into_bytes()
}

fn read(bytes: &[u8]) -> Result<Estimator, CorruptState> {
    let mut input = StateReader::new(bytes);
    let estimator = Estimator::read(&mut input)?;
    input.end()?;
    Ok(estimator)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Read back in the middle of anything, an estimate goes on to the last bit; a snapshot stays.
    #[test]
    fn what_is_read_back_goes_on_alike(before in calls(0..400), after in calls(0..200)) {
        let mut estimator = team();
        for (step, call) in before.iter().enumerate() {
            apply(&mut estimator, step, call);
        }
        let written = bytes(&estimator);
        let mut copy = read(&written).unwrap();
        prop_assert!(bytes(&copy) == written, "it is read back as it was written");
        let snapshot = estimator.clone();
        for (step, call) in (before.len()..).zip(&after) {
            let effects = apply(&mut estimator, step, call);
            prop_assert_eq!(apply(&mut copy, step, call), effects);
        }
        prop_assert!(bytes(&copy) == bytes(&estimator), "they go on alike");
        prop_assert!(bytes(&snapshot) == written, "a snapshot stays");
    }

    /// Damage is refused, or gives an estimate that goes on without a panic.
    #[test]
    fn damaged_bytes_harm_nothing(
        stream in calls(0..150),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        rest in any::<prop::sample::Index>(),
    ) {
        let mut estimator = team();
        for (step, call) in stream.iter().enumerate() {
            apply(&mut estimator, step, call);
        }
        let whole = bytes(&estimator);
        prop_assert!(read(&whole[..rest.index(whole.len())]).is_err());
        let mut damaged = whole;
        for (at, value) in damage {
            let at = at.index(damaged.len());
            damaged[at] = value;
        }
        if let Ok(mut estimator) = read(&damaged) {
            for (step, call) in stream.iter().enumerate() {
                apply(&mut estimator, 400 + step, call);
            }
        }
    }

    #[test]
    fn a_relation_comes_back_to_the_last_bit(
        kind in 0u8..3,
        numbers in prop::array::uniform3(-1.0..1.0_f64),
    ) {
        let waiting = relation(kind, numbers);
        let mut out = StateWriter::default();
        waiting.write(&mut out);
        let written = out.into_bytes();
        prop_assert_eq!(Relation::read(&mut StateReader::new(&written)), Ok(waiting));
    }
}

/// The first member's offset, a landmark's, a slot's frame, and counts, each made wrong.
#[test]
fn what_does_not_belong_together_is_refused() {
    let broken = |break_it: fn(&mut Estimator)| {
        let mut estimator = Estimator::new(Parameters::default());
        for _ in 0..2 {
            let agent = estimator.enrol();
            let label = Label::new("post").unwrap();
            estimator.landmark(agent, 0, &label, &relation(0, [0.5; 3]), &mut Vec::new());
        }
        estimator.enrol();
        break_it(&mut estimator);
        read(&bytes(&estimator)).err()
    };
    let invalid = Some(CorruptState::Invalid);
    assert_eq!(broken(|_| {}), None);
    assert_eq!(
        broken(|estimator| estimator.frame_mut(1).members[0].offset = 3),
        invalid
    );
    assert_eq!(
        broken(|estimator| {
            let landmarks = Arc::make_mut(&mut estimator.frame_mut(1).landmarks);
            for landmark in landmarks.values_mut() {
                landmark.offset = BODY_DIM + 1;
            }
        }),
        invalid
    );
    assert_eq!(
        broken(|estimator| estimator.frame_mut(2).members.clear()),
        invalid
    );
    assert_eq!(
        broken(|estimator| estimator.frame_mut(2).population = 0),
        invalid
    );
    assert_eq!(broken(|estimator| estimator.slot_mut(0).frame = 9), invalid);
    assert_eq!(
        broken(|estimator| estimator.slot_mut(2).detached = None),
        invalid
    );
    assert_eq!(
        broken(|estimator| {
            let relation = relation(0, [0.5; 3]);
            estimator.pending.push(PendingSighting {
                observer: 0,
                target: 3,
                stamp_ns: 0,
                relation,
            });
        }),
        invalid
    );
}
