//! Agents that go, and who comes after them: the same after a restart, with and without a
//! checkpoint.

use std::path::Path;
use std::time::Duration;

use super::*;
use crate::engine::{IngestError, TrajectoryError, TrajectoryPage};
use crate::store::{Derived, Journal};

pub(super) fn wait<T>(answer: impl Future<Output = T>) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread().build();
    runtime.expect("a runtime").block_on(answer)
}

fn remove(engine: &Engine, agent: &str) -> Result<(), IngestError> {
    let space = engine.space(SPACE).expect("the space is there");
    wait(space.remove_agent(&agent.parse().expect("a name")))
}

pub(super) fn ingest(
    engine: &Engine,
    agent: &str,
    session: u64,
    samples: &[Sample],
) -> Result<u64, IngestError> {
    let space = engine.space(SPACE).expect("the space is there");
    let batch = SampleBatch {
        session,
        first_seq: 0,
        samples: samples.to_vec(),
    };
    let answer = wait(space.ingest(&agent.parse().expect("a name"), batch));
    answer.map(|answer| answer.watermark.durable)
}

fn trajectory(
    engine: &Engine,
    agent: &str,
    session: Option<u64>,
) -> Result<TrajectoryPage, TrajectoryError> {
    let space = engine.space(SPACE).expect("the space is there");
    wait(space.trajectory(agent, session, None, None, 1000))
}

fn names(engine: &Engine) -> Vec<String> {
    let space = engine.space(SPACE).expect("the space is there");
    let views = space.agents_after(None, 100);
    views.iter().map(|view| view.name().to_owned()).collect()
}

fn forget_checkpoint(directory: &Path) {
    let store = LocalStore::open(directory).expect("the store opens");
    let number = store.spaces().expect("spaces")[0].number;
    store.forget(number).expect("forgotten");
}

#[test]
fn a_removed_agent_stays_removed_and_its_past_stays_readable() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let settings = EngineSettings::default();
    let mut engine = open(directory.path(), settings);
    let drive = drive();
    assert_eq!(ingest(&engine, AGENT, SESSION, &drive), Ok(SAMPLES));
    // A stranger to the map, and one that takes its number later.
    let lost = &drive[1..20];
    assert_eq!(ingest(&engine, "stranger", 9, lost), Ok(19));
    let past = trajectory(&engine, AGENT, None).expect("a trajectory");
    assert!(past.poses.len() > 100);
    assert_eq!(remove(&engine, AGENT), Ok(()));
    assert_eq!(remove(&engine, "stranger"), Ok(()));
    let unknown = |name: &str| Err(IngestError::UnknownAgent(name.to_owned()));
    assert_eq!(remove(&engine, AGENT), unknown(AGENT));
    assert_eq!(remove(&engine, "nobody"), unknown("nobody"));
    assert_eq!(names(&engine), Vec::<String>::new());
    // Both names are free, and any session may begin.
    assert_eq!(ingest(&engine, AGENT, 1, &drive[..40]), Ok(40));
    assert_eq!(ingest(&engine, "bob", 1, &drive[..40]), Ok(40));
    let digest_before = digest(&engine);
    for round in 0..3 {
        engine.shutdown();
        drop(engine);
        if round == 1 {
            forget_checkpoint(directory.path());
        }
        engine = open(directory.path(), settings);
        assert_eq!(digest(&engine), digest_before, "round {round}");
        assert_eq!(names(&engine), [AGENT, "bob"]);
        let again = trajectory(&engine, AGENT, Some(SESSION)).expect("a trajectory");
        assert_eq!(again, past, "the past of the agent that was called so");
        let present = trajectory(&engine, AGENT, None).expect("a trajectory");
        assert_eq!(present.session, 1);
        assert!(!present.poses.is_empty() && present.poses.len() < 40);
    }
    // Three agents have had numbers: the stranger's went to the one after it.
    let space = engine.space(SPACE).expect("the space is there");
    let map = wait(space.snapshot()).expect("a snapshot");
    assert_eq!((map.agent_numbers(), map.agent_count()), (3, 2));
    assert_eq!(remove(&engine, AGENT), Ok(()));
    assert!(space.has_removed(AGENT) && !space.has_removed("stranger"));
    assert!(matches!(
        trajectory(&engine, AGENT, None),
        Err(TrajectoryError::RemovedAgent)
    ));
    assert!(matches!(
        trajectory(&engine, "stranger", Some(9)),
        Err(TrajectoryError::UnknownAgent)
    ));
    engine.shutdown();
}

#[test]
fn what_waited_of_a_removed_agent_is_gone_and_what_still_comes_is_of_a_new_one() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let settings = EngineSettings {
        gap_timeout: Duration::from_millis(50),
        ..EngineSettings::default()
    };
    let engine = open(directory.path(), settings);
    let drive = drive();
    offer(&engine, 0, &drive[..10]);
    offer(&engine, 12, &drive[12..20]);
    wait_for(|| applied(&engine) >= 10);
    assert_eq!(remove(&engine, AGENT), Ok(()));
    // The robot goes on where it was.
    offer(&engine, 30, &drive[30..40]);
    wait_for(|| applied(&engine) == 40);
    let space = engine.space(SPACE).expect("the space is there");
    let mark = space.agent(AGENT).expect("the agent").watermark();
    let lost = &mark.rejected[0];
    assert_eq!((lost.range.from, lost.range.to), (0, 30));
    assert_eq!(lost.reason, SkipReason::Lost);
    engine.shutdown();
}

#[test]
fn a_session_of_the_far_future_is_refused_before_anything_is_journaled() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let engine = open(directory.path(), EngineSettings::default());
    let before = digest(&engine);
    let refused = ingest(&engine, AGENT, u64::MAX - 1, &drive());
    assert!(matches!(
        refused,
        Err(IngestError::SessionInFuture { session, .. }) if session == u64::MAX - 1
    ));
    assert_eq!(digest(&engine), before, "nobody has enrolled");
    assert_eq!(ingest(&engine, AGENT, SESSION, &drive()), Ok(SAMPLES));
    let space = engine.space(SPACE).expect("the space is there");
    assert_eq!(space.check_session(AGENT, SESSION), Ok(()));
    assert!(space.check_session(AGENT, 1 << 63).is_err());
    engine.shutdown();
}

#[test]
fn agents_that_were_never_in_the_map_make_room_and_others_do_not() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let settings = EngineSettings {
        agents_max: 3,
        ..EngineSettings::default()
    };
    let mut engine = open(directory.path(), settings);
    let drive = drive();
    // The founder's start pose makes it part of the map; the others are strangers to it.
    assert_eq!(ingest(&engine, AGENT, SESSION, &drive[..5]), Ok(5));
    for name in ["first", "second"] {
        assert_eq!(ingest(&engine, name, 1, &drive[1..3]), Ok(2));
    }
    // Nobody makes room who was heard of just now.
    let full = Err(IngestError::TooManyAgents);
    assert_eq!(ingest(&engine, "third", 1, &drive[1..3]), full);
    std::thread::sleep(Duration::from_millis(1100));
    assert_eq!(ingest(&engine, "third", 1, &drive[1..3]), Ok(2));
    assert_eq!(names(&engine), [AGENT, "second", "third"]);
    assert_eq!(ingest(&engine, "fourth", 1, &drive[1..3]), Ok(2));
    assert_eq!(names(&engine), [AGENT, "fourth", "third"]);
    // One that found its place stays, however long it is silent.
    for name in ["fourth", "third"] {
        assert_eq!(ingest(&engine, name, 2, &drive[..3]), Ok(3));
    }
    std::thread::sleep(Duration::from_millis(1100));
    assert_eq!(ingest(&engine, "fifth", 1, &drive[1..3]), full);
    let before = digest(&engine);
    engine.shutdown();
    drop(engine);
    forget_checkpoint(directory.path());
    engine = open(directory.path(), settings);
    assert_eq!(digest(&engine), before);
    assert_eq!(names(&engine), [AGENT, "fourth", "third"]);
    engine.shutdown();
}
