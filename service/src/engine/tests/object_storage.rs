//! The engine over object storage, which is a directory here.

use super::removal::ingest;
use super::*;
use crate::engine::IngestError;
use crate::store::{ObjectStorage, ShardNumber, Shards};

fn open_at(directory: &Path) -> Engine {
    let url = format!("file://{}", directory.display());
    let settings = EngineSettings {
        checkpoint_interval: Duration::from_millis(1),
        ..EngineSettings::default()
    };
    let storage = ObjectStorage::open(&url, Shards::ONE).expect("the storage answers");
    let store = storage.open_shard(ShardNumber(0)).expect("the store opens");
    open_over(Arc::new(store), settings)
}

#[test]
fn the_map_is_the_one_that_the_embedded_store_gives() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let drive = drive();
    for (at, samples) in drive.chunks(60).enumerate() {
        let engine = open_at(directory.path());
        let all = (at * 60 + samples.len()) as u64;
        assert_eq!(
            ingest(&engine, AGENT, SESSION, &drive[..at * 60 + samples.len()]),
            Ok(all)
        );
        engine.shutdown();
    }
    let engine = open_at(directory.path());
    assert_eq!(applied(&engine), SAMPLES);
    assert_eq!(digest(&engine), digest_after(&[(0, drive.len())], &[]));
    engine.shutdown();
}

#[test]
fn an_engine_that_was_taken_over_from_acknowledges_nothing() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let first = open_at(directory.path());
    assert_eq!(ingest(&first, AGENT, SESSION, &drive()[..40]), Ok(40));
    let second = open_at(directory.path());
    assert_eq!(ingest(&second, AGENT, SESSION, &drive()[..60]), Ok(60));

    let refused = ingest(&first, AGENT, SESSION, &drive()[..90]).expect_err("it is not its owner");
    let IngestError::Fenced(detail) = &refused else {
        panic!("{refused}");
    };
    assert!(detail.contains("taken over"), "{detail}");
    assert!(matches!(first.readiness(), Readiness::Failed { .. }));
    first.shutdown();
    assert_eq!(ingest(&second, AGENT, SESSION, &drive()), Ok(SAMPLES));
    let whole = digest(&second);
    second.shutdown();
    drop((first, second));

    let third = open_at(directory.path());
    assert_eq!((applied(&third), digest(&third)), (SAMPLES, whole));
    third.shutdown();
}

#[test]
fn each_opening_of_the_store_has_a_larger_term() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let terms = [40, 60, 60].map(|samples| {
        let engine = open_at(directory.path());
        let taken = ingest(&engine, AGENT, SESSION, &drive()[..samples]);
        assert_eq!(taken, Ok(samples as u64));
        let space = engine.space(SPACE).expect("the space is there");
        let view = space.agent(AGENT).expect("the agent is there");
        let estimate = view.estimate().expect("it has moved");
        assert_eq!(estimate.term, view.watermark().term);
        engine.shutdown();
        estimate.term
    });
    let grow = terms.windows(2).all(|pair| pair[0] < pair[1]);
    assert!(terms[0] > 0 && grow, "{terms:?}");
}

#[test]
fn a_session_that_begins_is_of_the_same_term() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let engine = open_at(directory.path());
    let term = |session| {
        assert_eq!(ingest(&engine, AGENT, session, &drive()[..40]), Ok(40));
        let space = engine.space(SPACE).expect("the space is there");
        let view = space.agent(AGENT).expect("the agent is there");
        let mark = view.watermark();
        assert_eq!((mark.session, mark.durable), (session, 40));
        mark.term
    };
    assert_eq!(term(SESSION), term(SESSION + 1));
    engine.shutdown();
}

#[test]
fn who_follows_hears_of_agents_and_sessions_that_begin() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let owner = open_at(directory.path());
    let url = format!("file://{}", directory.path().display());
    let storage = ObjectStorage::open(&url, Shards::ONE).expect("the storage answers");
    let followed = storage.follow_shard(ShardNumber(0));
    let follower = Engine::following(Shards::ONE, EngineSettings::default());
    let opened = follower.open_shard(ShardNumber(0), Arc::new(followed.expect("it is read")));
    opened.expect("the shard opens");
    let space = follower.space(SPACE).expect("the space is there");
    // The agent comes when all that was there before is folded.
    eventually("the map", || space.caught_up().is_some());
    for session in [SESSION, SESSION + 1] {
        assert_eq!(ingest(&owner, AGENT, session, &drive()[..40]), Ok(40));
        eventually("the watermark", || {
            let view = space.agent(AGENT);
            view.is_some_and(|view| {
                let mark = view.watermark();
                (mark.session, mark.durable, mark.applied) == (session, 40, 40)
            })
        });
    }
    assert_eq!(digest(&follower), digest(&owner));
    follower.shutdown();
    owner.shutdown();
}

fn eventually(what: &str, is_there: impl Fn() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !is_there() {
        assert!(Instant::now() < deadline, "{what} does not come");
        std::thread::sleep(Duration::from_millis(10));
    }
}
