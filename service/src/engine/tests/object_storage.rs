//! The engine over object storage, which is a directory here.

use super::removal::ingest;
use super::*;
use crate::engine::IngestError;
use crate::store::ObjectStore;

fn open_at(directory: &Path) -> Engine {
    let url = format!("file://{}", directory.display());
    let settings = EngineSettings {
        checkpoint_interval: Duration::from_millis(1),
        ..EngineSettings::default()
    };
    let store = ObjectStore::open(&url).expect("the store opens");
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
    let IngestError::Store(detail) = &refused else {
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
