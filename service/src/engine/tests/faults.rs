//! Disks that fail below the engine, and journals that it cannot fold.

use cogmap_proto::Watermark;

use super::removal::{ingest, wait};
use super::*;
use crate::engine::{IngestError, Space};
use crate::store::disk_model::{Cut, DiskModel, Failing};
use crate::store::{
    Blocks, Checkpoint, ChunkKey, DerivedError, Draft, OpenJournal, SpaceNumber, StoreError,
    StoredChunk, StoredSpace,
};

fn watermark(engine: &Engine) -> Watermark {
    let space = engine.space(SPACE).expect("the space is there");
    space.agent(AGENT).expect("the agent is there").watermark()
}

#[test]
fn nothing_is_acknowledged_that_a_failing_disk_has_not_taken() {
    let full = Failing::Write(std::io::ErrorKind::StorageFull);
    for failing in [full, Failing::ShortWrite, Failing::Sync] {
        let home = tempfile::tempdir().expect("a temporary directory");
        let directory = home.path().join("store");
        let model = DiskModel::of(home.path());
        let engine = open(&directory, EngineSettings::default());
        assert_eq!(ingest(&engine, AGENT, SESSION, &drive()[..40]), Ok(40));
        model.fail(failing, 0);
        let refused = ingest(&engine, AGENT, SESSION, &drive()[..45]).expect_err("it is not taken");
        let is_full = matches!(refused, IngestError::DiskFull(_));
        assert_eq!(is_full, failing != Failing::Sync, "{failing:?}: {refused}");
        // The disk has recovered, but nobody knows what is on it.
        ingest(&engine, AGENT, SESSION, &drive()[..45]).expect_err("it is not taken either");
        offer(&engine, 40, &drive()[40..50]);
        assert_eq!(watermark(&engine).durable, 40, "{failing:?}");
        assert!(matches!(engine.readiness(), Readiness::Failed { .. }));
        let left = model.cut(Cut::Lost);
        engine.shutdown();
        drop(engine);
        for directory in [left.path().join("store"), directory] {
            let engine = open(&directory, EngineSettings::default());
            let durable = watermark(&engine).durable;
            assert!((40..=45).contains(&durable), "{failing:?}: {durable}");
            assert_eq!(ingest(&engine, AGENT, SESSION, &drive()[..45]), Ok(45));
            engine.shutdown();
        }
    }
}

/// A store on whose first space the engine has a mishap.
#[derive(Debug)]
struct Treacherous(LocalStore);

impl Journal for Treacherous {
    fn spaces(&self) -> Result<Vec<StoredSpace>, StoreError> {
        self.0.spaces()
    }

    fn create_space(&self, name: &str, settings: &[u8]) -> Result<SpaceNumber, StoreError> {
        self.0.create_space(name, settings)
    }

    fn draft<'a>(&'a self, name: &str, settings: &[u8]) -> Result<Box<dyn Draft + 'a>, StoreError> {
        self.0.draft(name, settings)
    }

    fn delete_space(&self, space: SpaceNumber) -> Result<(), StoreError> {
        self.0.delete_space(space)
    }

    fn open_journal(&self, space: SpaceNumber) -> Result<OpenJournal, StoreError> {
        assert_ne!(space, SpaceNumber(0), "a mishap");
        self.0.open_journal(space)
    }

    fn append(&self, at: SpaceNumber, block: u64, n: u64, bytes: &[u8]) -> Result<(), StoreError> {
        self.0.append(at, block, n, bytes)
    }

    fn sync(&self) -> Result<(), StoreError> {
        self.0.sync()
    }

    fn journal(&self, space: SpaceNumber, from: u64) -> Blocks<'_> {
        self.0.journal(space, from)
    }
}

impl Derived for Treacherous {
    fn write_checkpoint(&self, space: SpaceNumber, of: &Checkpoint) -> Result<(), DerivedError> {
        self.0.write_checkpoint(space, of)
    }

    fn checkpoint(&self, space: SpaceNumber) -> Result<Option<Checkpoint>, DerivedError> {
        self.0.checkpoint(space)
    }

    fn forget(&self, space: SpaceNumber) -> Result<(), DerivedError> {
        self.0.forget(space)
    }

    fn put_chunk(&self, of: SpaceNumber, key: ChunkKey, bytes: &[u8]) -> Result<(), DerivedError> {
        self.0.put_chunk(of, key, bytes)
    }

    fn chunks(
        &self,
        space: SpaceNumber,
        agent: u32,
        session: u64,
        from_ns: i64,
        limit: usize,
    ) -> Result<Vec<StoredChunk>, DerivedError> {
        self.0.chunks(space, agent, session, from_ns, limit)
    }
}

#[test]
fn a_panic_while_a_space_loads_stops_that_space_alone() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let store = LocalStore::open(directory.path()).expect("the store opens");
    for name in [SPACE, "sound"] {
        let settings = serde_json::to_vec(&SpaceSettings::default()).expect("plain data");
        store.create_space(name, &settings).expect("created");
    }
    let store = Arc::new(Treacherous(store));
    let settings = EngineSettings::default();
    let engine = Engine::open(store, settings, Arc::new(Silent)).expect("the engine opens");
    wait_for(|| !matches!(engine.readiness(), Readiness::Recovering { .. }));
    let Readiness::ReadyBut { stopped } = engine.readiness() else {
        panic!("{:?}", engine.readiness());
    };
    assert_eq!(stopped[0].0, SPACE);
    assert!(stopped[0].1.contains("panic"), "{stopped:?}");
    let sound = engine.space("sound").expect("the space is there");
    assert!(wait(sound.snapshot()).is_ok());
    assert!(
        engine
            .space(SPACE)
            .as_deref()
            .is_some_and(|space| Space::available(space).is_err())
    );
    engine.shutdown();
}
