//! The engine on a real store: whatever way samples arrive, the map is the same.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use cogmap_proto::{
    AgentDetail, Codec, Contact, ContactLevel, Level, Marker, ObjectLesson, Relation, Sample,
    SampleBatch, SampleBody, Sighting, SkipReason, SpaceSettings, StartPose, Target, TouchNoise,
    Velocity,
};
use cognitive_map::CognitiveMap;
use proptest::prelude::*;

use super::{Engine, EngineSettings, QuestionError, Readiness, Silent};
use crate::decode::{core_settings, records_of, trajectory_interval_ns};
use crate::journal::Entry;
use crate::store::{Derived, Journal, LocalStore, Store};

mod faults;
mod mangled;
#[cfg(feature = "object-storage")]
mod object_storage;
mod relaxation;
mod removal;
mod settings;
mod trajectories;
mod window;

const SPACE: &str = "lab";
const AGENT: &str = "ada";
const SESSION: u64 = 3;
const SAMPLES: u64 = 240;
/// Longest wait for a thread of the engine.
const PATIENCE: Duration = Duration::from_secs(30);

/// A drive with everything in it, among it samples that make no sense.
fn drive() -> Vec<Sample> {
    (0..SAMPLES)
        .map(|seq| {
            let turn = if seq % 60 < 30 { 0.4 } else { -0.7 };
            let body = match seq {
                0 => SampleBody::StartPose(StartPose {
                    translation_m: [1.0, -2.0, 0.5],
                    rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
                    noise: None,
                }),
                50 => SampleBody::Velocity(Velocity {
                    linear_m_s: [f64::NAN, 0.0, 0.0],
                    angular_rad_s: [0.0; 3],
                    duration_s: 0.1,
                    noise: None,
                }),
                120 => SampleBody::Marker(Marker {
                    label: "dock".into(),
                    ends_trip: true,
                }),
                _ if seq % 17 == 0 => SampleBody::Sighting(Sighting {
                    target: Target::Landmark(format!("post {}", seq % 3)),
                    relation: Relation::Position {
                        translation_m: [2.0, 1.0, 0.0],
                        sd_m: [0.1; 3],
                    },
                }),
                _ if seq % 11 == 0 => SampleBody::Level(Level {
                    channel: "light".into(),
                    value: 0.5,
                    offset_m: [0.0; 3],
                    normal: None,
                }),
                _ => SampleBody::Velocity(Velocity {
                    linear_m_s: [1.0, 0.0, 0.1],
                    angular_rad_s: [0.0, 0.1, turn],
                    duration_s: 0.1,
                    noise: None,
                }),
            };
            // One stamp runs backwards.
            let step = if seq == 90 { seq - 5 } else { seq };
            let stamp_ns = i64::try_from(step).expect("a small number") * 100_000_000;
            Sample { stamp_ns, body }
        })
        .collect()
}

fn open(directory: &Path, settings: EngineSettings) -> Engine {
    let store = LocalStore::open(directory).expect("the store opens");
    open_over(Arc::new(store), settings)
}

fn open_over(store: Arc<dyn Store>, settings: EngineSettings) -> Engine {
    let engine = Engine::open(store, settings, Arc::new(Silent)).expect("the engine opens");
    let name = SPACE.parse().expect("a name");
    engine
        .create_space(&name, &SpaceSettings::default())
        .expect("the space is there");
    wait_for(|| engine.readiness() == Readiness::Ready);
    engine
}

fn wait_for(condition: impl Fn() -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !condition() {
        assert!(
            Instant::now() < deadline,
            "it did not happen in {PATIENCE:?}"
        );
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn offer(engine: &Engine, first: u64, samples: &[Sample]) {
    let batch = SampleBatch {
        session: SESSION,
        first_seq: first,
        samples: samples.to_vec(),
    };
    engine.offer(
        SPACE,
        AGENT,
        Codec::Postcard,
        &Codec::Postcard.encode(&batch),
    );
}

fn applied(engine: &Engine) -> u64 {
    let space = engine.space(SPACE).expect("the space is there");
    space
        .agent(AGENT)
        .map_or(0, |view| view.watermark().applied)
}

fn digest(engine: &Engine) -> String {
    let space = engine.space(SPACE).expect("the space is there");
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .expect("a runtime");
    runtime
        .block_on(space.snapshot())
        .expect("a snapshot")
        .digest()
        .to_string()
}

/// The digest after messages of the given (first, count), with restarts before some of them; what
/// restarts made the engine forget is sent again at the end, as a client does.
fn digest_after(messages: &[(usize, usize)], restarts: &[usize]) -> String {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let settings = EngineSettings {
        gap_timeout: Duration::from_secs(3600),
        checkpoint_interval: Duration::from_millis(1),
        ..EngineSettings::default()
    };
    let drive = drive();
    let mut engine = open(directory.path(), settings);
    for (at, &(first, count)) in messages.iter().enumerate() {
        if restarts.contains(&at) {
            engine.shutdown();
            drop(engine);
            engine = open(directory.path(), settings);
        }
        offer(
            &engine,
            first as u64,
            &drive[first..drive.len().min(first + count)],
        );
    }
    offer(&engine, 0, &drive);
    wait_for(|| applied(&engine) == SAMPLES);
    let digest = digest(&engine);
    engine.shutdown();
    digest
}

/// What a plain fold over the drive gives, without engine and store.
fn digest_of_fold() -> String {
    let settings = core_settings(&SpaceSettings::default()).expect("the defaults are valid");
    let mut map = CognitiveMap::new(settings);
    let mut events = Vec::new();
    let enrol = Entry::Enrol {
        agent: 0,
        name: AGENT.into(),
    };
    records_of(&enrol, |record| map.apply(&record, &mut events));
    for (seq, sample) in (0..).zip(drive()) {
        let skip = |reason| Entry::Skip {
            agent: 0,
            session: SESSION,
            from: seq,
            to: seq + 1,
            reason,
        };
        let entry = match seq {
            50 => skip(SkipReason::NumberOutOfRange),
            90 => skip(SkipReason::TimeBackwards),
            _ => {
                let batch = SampleBatch {
                    session: SESSION,
                    first_seq: seq,
                    samples: vec![sample],
                };
                Entry::Samples { agent: 0, batch }
            }
        };
        records_of(&entry, |record| map.apply(&record, &mut events));
    }
    map.digest().to_string()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    /// Any batching, order inside the window, duplication and restarts.
    #[test]
    fn any_way_of_arrival_gives_the_same_map(
        starts in prop::collection::vec(0..240_usize, 5..40),
        counts in prop::collection::vec(1..40_usize, 40),
        restarts in prop::collection::vec(0..40_usize, 0..3),
    ) {
        let messages: Vec<_> = starts.into_iter().zip(counts).collect();
        prop_assert_eq!(digest_after(&messages, &restarts), digest_of_fold());
    }
}

#[test]
fn samples_that_make_no_sense_are_named_in_the_watermark() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let engine = open(directory.path(), EngineSettings::default());
    offer(&engine, 0, &drive());
    wait_for(|| applied(&engine) == SAMPLES);
    let view = engine
        .space(SPACE)
        .and_then(|space| space.agent(AGENT))
        .expect("the agent");
    let rejected: Vec<_> = view
        .watermark()
        .rejected
        .iter()
        .map(|rejection| (rejection.range.from, rejection.reason))
        .collect();
    assert_eq!(
        rejected,
        [
            (50, SkipReason::NumberOutOfRange),
            (90, SkipReason::TimeBackwards)
        ]
    );
    engine.shutdown();
}

#[test]
fn samples_refused_in_a_row_are_one_range_of_the_watermark() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let engine = open(directory.path(), EngineSettings::default());
    let mut drive = drive();
    for sample in &mut drive[20..80] {
        // Not 50, which is refused for another reason.
        sample.stamp_ns = 0;
    }
    offer(&engine, 0, &drive);
    wait_for(|| applied(&engine) == SAMPLES);
    let view = engine
        .space(SPACE)
        .and_then(|space| space.agent(AGENT))
        .expect("the agent");
    let rejected: Vec<_> = { view.watermark().rejected.into_iter() }
        .map(|one| (one.range.from, one.range.to, one.reason))
        .collect();
    assert_eq!(
        rejected,
        [
            (20, 50, SkipReason::TimeBackwards),
            (50, 51, SkipReason::NumberOutOfRange),
            (51, 80, SkipReason::TimeBackwards),
            (90, 91, SkipReason::TimeBackwards),
        ]
    );
    engine.shutdown();
}

#[test]
fn what_never_comes_is_lost_after_its_time_and_the_rest_goes_on() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let settings = EngineSettings {
        gap_timeout: Duration::from_millis(50),
        ..EngineSettings::default()
    };
    let engine = open(directory.path(), settings);
    let drive = drive();
    offer(&engine, 0, &drive[..10]);
    offer(&engine, 20, &drive[20..30]);
    wait_for(|| applied(&engine) == 30);
    let view = engine
        .space(SPACE)
        .and_then(|space| space.agent(AGENT))
        .expect("the agent");
    let watermark = view.watermark();
    assert_eq!(watermark.gap, None);
    assert_eq!(watermark.rejected.len(), 1);
    assert_eq!(
        (
            watermark.rejected[0].range.from,
            watermark.rejected[0].range.to
        ),
        (10, 20)
    );
    engine.shutdown();
}

#[test]
fn the_json_of_an_agent_is_that_of_its_detail_before_and_after_its_first_sample() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let engine = open(directory.path(), EngineSettings::default());
    let space = engine.space(SPACE).expect("the space is there");
    let drive = drive();
    // The second time the stored part of the text is used; the third it is that of a new readout.
    for (count, times) in [(0, 1), (1, 2), (240, 2)] {
        if count == 0 {
            // Beyond a gap: the agent is known, none of its samples is applied.
            offer(&engine, 5, &drive[5..6]);
        } else {
            offer(&engine, 0, &drive[..count]);
        }
        wait_for(|| {
            let watermark = space.agent(AGENT).map(|view| view.watermark());
            watermark.is_some_and(|mark| {
                mark.durable >= count as u64 && mark.gap.is_some() == (count < 5)
            })
        });
        let view = space.agent(AGENT).expect("the agent");
        for _ in 0..times {
            let detail = serde_json::to_string(&view.detail()).expect("plain data encodes");
            let json = String::from_utf8(view.detail_json()).expect("a text");
            // What comes last is how long ago it was heard, which is less the first time.
            let before = |text: &str| {
                text.split_once("\"heard_ago_s\":")
                    .map(|(one, _)| one.to_owned())
            };
            assert_eq!(
                before(&json).expect("the last field"),
                before(&detail).unwrap()
            );
            let told: AgentDetail = serde_json::from_str(&json).expect("a detail");
            assert!(told.heard_ago_s <= view.detail().heard_ago_s);
            assert!(told.heard_ago_s.is_some());
        }
    }
    engine.shutdown();
}

#[test]
fn a_space_that_is_gone_keeps_nobody_waiting() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let engine = open(directory.path(), EngineSettings::default());
    let space = engine.space(SPACE).expect("the space is there");
    engine.delete_space(SPACE).expect("it can be deleted");
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .build()
        .expect("a runtime");
    let snapshot =
        runtime.block_on(async { tokio::time::timeout(PATIENCE, space.snapshot()).await });
    snapshot
        .expect("an answer comes")
        .expect_err("there is no map any more");
    engine.shutdown();
}

#[test]
fn lessons_outlive_the_engine_with_and_without_a_checkpoint() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .expect("a runtime");
    let lesson = |value: f64| ObjectLesson {
        spacing_m: 0.01,
        noise: TouchNoise::default(),
        contacts: (0..9)
            .map(|k| Contact {
                position_m: [f64::from(k) * 0.02, 0.0, 0.0],
                levels: vec![ContactLevel {
                    channel: "touch".into(),
                    value: value + f64::from(k),
                }],
                ..Contact::default()
            })
            .collect(),
    };
    let mut digests = Vec::new();
    for round in 0..3_u8 {
        let engine = open(directory.path(), EngineSettings::default());
        let space = engine.space(SPACE).expect("the space is there");
        let before = runtime.block_on(space.snapshot()).expect("a snapshot");
        assert_eq!(digests.last(), (round > 0).then_some(&before.digest()));
        assert_eq!(before.object_count(), usize::from(round));
        let name = cognitive_map::Label::new(&format!("cup {round}")).expect("a label");
        let lesson = lesson(f64::from(round));
        let valid = crate::decode::lesson(&lesson).expect("a lesson");
        runtime
            .block_on(space.teach(&name, lesson, valid))
            .expect("taught");
        let after = runtime.block_on(space.snapshot()).expect("a snapshot");
        assert!(after.object_by_name(&name).is_some());
        digests.push(after.digest());
        engine.shutdown();
    }
    // From the journal alone.
    let store = LocalStore::open(directory.path()).expect("the store opens");
    let number = store.spaces().expect("spaces")[0].number;
    store.forget(number).expect("dropped");
    drop(store);
    let engine = open(directory.path(), EngineSettings::default());
    let space = engine.space(SPACE).expect("the space is there");
    let map = runtime.block_on(space.snapshot()).expect("a snapshot");
    assert_eq!(digests.last(), Some(&map.digest()));
    engine.shutdown();
}

#[test]
fn a_localisation_that_takes_too_long_is_given_up_and_makes_room() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let engine = open(directory.path(), EngineSettings::default());
    offer(&engine, 0, &drive());
    wait_for(|| applied(&engine) == SAMPLES);
    let space = engine.space(SPACE).expect("the space is there");
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .build()
        .expect("a runtime");
    let driven = drive();
    let step = crate::decode::sample(&driven[1]).expect("a motion");
    let samples: Vec<_> = (0..4096)
        .map(|stamp_ns| cognitive_map::Sample {
            stamp_ns,
            ..step.clone()
        })
        .collect();
    let localize = |time_max| {
        let localized = space.localize_within(samples.clone(), time_max);
        runtime.block_on(localized).map(|(_, found)| found.status)
    };
    let room = || {
        let taken = std::iter::from_fn(|| space.question_room().enter().ok());
        // All are held until they are counted.
        taken.collect::<Vec<_>>().len()
    };
    let whole = room();
    let overdue = Err(QuestionError::Overdue(Duration::ZERO));
    // A machine that is busy elsewhere may have the answer before it looks at the clock, but not
    // each time.
    let told: Vec<_> = (0..20)
        .map(|_| {
            let told = localize(Duration::ZERO);
            wait_for(|| room() == whole);
            told
        })
        .collect();
    assert!(told.contains(&overdue), "{told:?}");
    assert!(localize(PATIENCE).is_ok());
    engine.shutdown();
}
