//! Recovery: the checkpoint, and the journal's tail folded on top of it.

use cognitive_map::{CognitiveMap, Settings};

use super::block::{self, CorruptBlock};
use super::events::EventRing;
use super::fold::records_of;
use super::trajectory::{self, Chunk, Recorder};
use crate::store::{ChunkKey, SpaceNumber, Store, StoreError};

/// A space as it was when the service ended, however it ended.
#[derive(Debug)]
pub(crate) struct Recovered {
    pub(crate) map: CognitiveMap,
    /// One for each agent, in the agents' order.
    pub(crate) recorders: Vec<Recorder>,
    /// The latest events.
    pub(crate) events: EventRing,
    /// Number of the next journal block.
    pub(crate) next_block: u64,
    /// Revision of the map that the store's checkpoint holds.
    pub(crate) checkpoint_revision: u64,
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
    #[error("the space is closing")]
    Closing,
}

/// Loads a space of a name, unless `closing` says that nobody wants it any more.
pub(crate) fn recover(
    store: &dyn Store,
    space: SpaceNumber,
    settings: &Settings,
    (name, interval_ns): (&str, i64),
    closing: impl Fn() -> bool,
) -> Result<Recovered, RecoveryError> {
    let mut recovered = match load_checkpoint(store, space, settings)? {
        Some(recovered) => recovered,
        None => Recovered {
            map: CognitiveMap::new(settings.clone()),
            recorders: Vec::new(),
            events: EventRing::since(0),
            next_block: 0,
            checkpoint_revision: 0,
        },
    };
    let mut events = Vec::new();
    for block in store.journal(space, recovered.next_block) {
        if closing() {
            return Err(RecoveryError::Closing);
        }
        let (number, bytes) = block?;
        if number != recovered.next_block {
            return Err(RecoveryError::MissingBlock(recovered.next_block));
        }
        let entries = block::entries(&bytes).map_err(|error| RecoveryError::Block {
            block: number,
            error,
        })?;
        let mut chunks = Vec::new();
        for entry in &entries {
            records_of(entry, |record| {
                recovered.map.apply(&record, &mut events);
                recovered.events.note(name, &recovered.map, &events);
                events.clear();
                let (map, recorders) = (&recovered.map, &mut recovered.recorders);
                chunks.extend(trajectory::note_all(recorders, map, &record, interval_ns));
            });
        }
        for (agent, chunk) in chunks {
            put(store, space, agent, &chunk)?;
        }
        recovered.next_block = number + 1;
    }
    recovered
        .recorders
        .resize_with(recovered.map.agent_numbers(), Recorder::default);
    Ok(recovered)
}

/// The checkpoint, if there is one that this build understands. One that it does not is dropped:
/// the journal holds all that it held.
fn load_checkpoint(
    store: &dyn Store,
    space: SpaceNumber,
    settings: &Settings,
) -> Result<Option<Recovered>, RecoveryError> {
    let Some(checkpoint) = store.checkpoint(space)? else {
        return Ok(None);
    };
    let beside = Recorder::read_all(&checkpoint.recorders);
    match (
        CognitiveMap::restore(settings.clone(), checkpoint.pages),
        beside,
    ) {
        (Ok(map), Ok((recorders, events))) => Ok(Some(Recovered {
            checkpoint_revision: map.revision(),
            // Older versions wrote none.
            events: EventRing::read(events).unwrap_or_else(|| EventRing::since(map.revision())),
            map,
            recorders,
            next_block: checkpoint.next_block,
        })),
        (map, beside) => {
            let map = map.err().map(|error| error.to_string());
            let recorders = beside.err().map(|error| error.to_string());
            tracing::warn!(
                ?map,
                ?recorders,
                "checkpoint not usable; replaying the whole journal"
            );
            store.drop_checkpoint(space)?;
            Ok(None)
        }
    }
}

/// Puts a chunk again: the same rows under the same key as before the end.
fn put(store: &dyn Store, space: SpaceNumber, agent: u32, chunk: &Chunk) -> Result<(), StoreError> {
    let first_stamp_ns = chunk.rows[0].stamp_ns;
    let key = ChunkKey {
        agent,
        session: chunk.session,
        first_stamp_ns,
    };
    store.put_chunk(space, key, &trajectory::encode(&chunk.rows))
}
