//! Recovery: the checkpoint, and the journal's tail folded on top of it.

use std::sync::Arc;

use cognitive_map::{CognitiveMap, Event, Record, Settings};
use metrics::counter;

use super::checkpointer::Beside;
use super::episodes::EndedEpisodes;
use super::events::EventRing;
use super::health::Health;
use super::trajectory::{self, Chunk, Recorder};
use crate::decode::records_of;
use crate::encode;
use crate::journal::{CorruptBlock, entries};
use crate::metrics::{LOST_MARKS, TORN_TAILS};
use crate::store::{ChunkKey, OpenJournal, SpaceNumber, Store, StoreError};

/// A space as it was when the service ended, however it ended.
#[derive(Debug)]
pub(crate) struct Recovered {
    pub(crate) map: CognitiveMap,
    /// One for each agent, in the agents' order.
    pub(crate) recorders: Vec<Recorder>,
    /// The latest events.
    pub(crate) events: EventRing,
    /// The latest episode of each agent that has ended.
    pub(crate) episodes: EndedEpisodes,
    /// Number of the next journal block.
    pub(crate) next_block: u64,
    /// Revision of the map that the store's checkpoint holds.
    pub(crate) checkpoint_revision: u64,
}

impl Recovered {
    /// A space in which nothing has happened.
    fn empty(settings: &Settings) -> Self {
        Self {
            map: CognitiveMap::new(settings.clone()),
            recorders: Vec::new(),
            events: EventRing::since(0),
            episodes: EndedEpisodes::default(),
            next_block: 0,
            checkpoint_revision: 0,
        }
    }

    /// Applies a record of the space `name`, and keeps what it brought about. `events` is empty
    /// before and after: its memory is used again.
    fn apply(&mut self, name: &str, record: &Record, events: &mut Vec<Event>) {
        self.map.apply(record, events);
        let records = encode::event_records(name, &self.map, events);
        records.for_each(|event| self.events.push(Arc::new(event)));
        for event in events.drain(..) {
            if let Some(change) = encode::ended_episode(name, &self.map, &event) {
                self.episodes.put(event.agent.0, change.0);
            }
        }
    }
}

/// Why a space cannot be recovered.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RecoveryError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error("block {block} of the journal: {error}")]
    Block { block: u64, error: CorruptBlock },
    #[error("block {0} of the journal is missing")]
    MissingBlock(u64),
    #[error("the work on it ended with a panic; the log says where")]
    Interrupted,
    #[error("the space is closing")]
    Closing,
}

/// A space to load.
pub(crate) struct Loading<'a> {
    pub(crate) store: &'a dyn Store,
    pub(crate) health: &'a Health,
    pub(crate) name: &'a str,
    pub(crate) space: SpaceNumber,
    pub(crate) settings: &'a Settings,
    pub(crate) interval_ns: i64,
}

/// Loads a space, unless `closing` says that nobody wants it any more.
pub(crate) fn recover(
    loading: &Loading<'_>,
    closing: impl Fn() -> bool,
) -> Result<Recovered, RecoveryError> {
    let Loading {
        store,
        health,
        name,
        space,
        settings,
        interval_ns,
    } = *loading;
    let journal = store.open_journal(space)?;
    report(name, &journal);
    let checkpoint = load_checkpoint(loading, journal.extent.blocks);
    let mut recovered = checkpoint.unwrap_or_else(|| Recovered::empty(settings));
    let mut events = Vec::new();
    for block in store.journal(space, recovered.next_block) {
        if closing() {
            return Err(RecoveryError::Closing);
        }
        let (number, bytes) = block?;
        if number != recovered.next_block {
            return Err(RecoveryError::MissingBlock(recovered.next_block));
        }
        let entries = entries(&bytes).map_err(|error| RecoveryError::Block {
            block: number,
            error,
        })?;
        let mut chunks = Vec::new();
        for entry in &entries {
            records_of(entry, |record| {
                recovered.apply(name, &record, &mut events);
                let (map, recorders) = (&recovered.map, &mut recovered.recorders);
                chunks.extend(trajectory::note_all(recorders, map, &record, interval_ns));
            });
        }
        for (agent, chunk) in chunks {
            put(store, health, space, agent, &chunk);
        }
        recovered.next_block = number + 1;
    }
    if recovered.next_block < journal.extent.blocks {
        return Err(RecoveryError::MissingBlock(recovered.next_block));
    }
    recovered
        .recorders
        .resize_with(recovered.map.agent_numbers(), Recorder::default);
    Ok(recovered)
}

/// Says what was found at the end of a journal.
fn report(space: &str, journal: &OpenJournal) {
    if let Some(cut) = &journal.cut {
        counter!(TORN_TAILS, "space" => space.to_owned()).increment(1);
        let (block, file, offset, flaw) = (cut.block, &cut.file, cut.offset, cut.flaw);
        tracing::warn!(space, block, file, offset, %flaw,
            "what was never acknowledged has been cut off the end of the journal");
    }
    if journal.mark_lost {
        counter!(LOST_MARKS, "space" => space.to_owned()).increment(1);
        tracing::warn!(
            space,
            blocks = journal.extent.blocks,
            samples = journal.extent.samples,
            "it is not known how far the space was acknowledged: blocks may be missing at its end"
        );
    }
}

/// The checkpoint, if there is one that this build understands and whose blocks the journal has.
/// Any other one is dropped, together with the trajectories: the journal holds all that they held.
fn load_checkpoint(loading: &Loading<'_>, blocks: u64) -> Option<Recovered> {
    let Loading {
        store,
        health,
        name,
        space,
        settings,
        ..
    } = *loading;
    let loaded = match store.checkpoint(space) {
        Ok(None) => return None,
        Ok(Some(checkpoint)) if checkpoint.next_block > blocks => {
            Err("it holds blocks that the journal has not".to_owned())
        }
        Ok(Some(checkpoint)) => {
            let restored = CognitiveMap::restore(settings.clone(), checkpoint.pages);
            let restored = restored.map_err(|error| error.to_string());
            restored.and_then(|map| {
                let beside = Beside::read(&checkpoint.recorders, &map);
                let beside = beside.map_err(|error| error.to_string())?;
                Ok(Recovered {
                    checkpoint_revision: map.revision(),
                    map,
                    recorders: beside.recorders,
                    events: beside.events,
                    episodes: beside.episodes,
                    next_block: checkpoint.next_block,
                })
            })
        }
        Err(error) => Err(error.to_string()),
    };
    match loaded {
        Ok(recovered) => Some(recovered),
        Err(reason) => {
            tracing::warn!(
                space = name,
                reason,
                "checkpoint not usable; the whole journal is replayed"
            );
            if let Err(error) = store.forget(space) {
                health.derived_fail(&error);
            }
            None
        }
    }
}

/// Puts a chunk again: the same rows under the same key as before the end.
fn put(store: &dyn Store, health: &Health, space: SpaceNumber, agent: u32, chunk: &Chunk) {
    let first_stamp_ns = chunk.rows[0].stamp_ns;
    let key = ChunkKey {
        agent,
        session: chunk.session,
        first_stamp_ns,
    };
    if let Err(error) = store.put_chunk(space, key, &trajectory::chunk_bytes(&chunk.rows)) {
        health.derived_fail(&error);
    }
}
