//! Keys and the values that the store composes itself, to bytes and back.

use super::super::{ChunkKey, SpaceNumber};

/// Key of the checkpoint's record.
pub(in crate::store) const CHECKPOINT: [u8; 1] = [0];
/// What the keys of pages begin with.
pub(in crate::store) const PAGES: [u8; 1] = [1];
/// What the keys of chunks begin with.
const CHUNKS: u8 = 2;

/// Version of the values that the store composes.
const VALUE_VERSION: u8 = 1;

/// Name of the keyspace of a space.
pub(in crate::store) fn keyspace(space: SpaceNumber) -> String {
    space.0.to_string()
}

/// The space of a keyspace.
pub(in crate::store) fn space_of(keyspace: &str) -> Option<SpaceNumber> {
    keyspace.parse().ok().map(SpaceNumber)
}

/// The record of a checkpoint.
pub(in crate::store) fn checkpoint_value(next_block: u64, recorders: &[u8]) -> Vec<u8> {
    let mut value = vec![VALUE_VERSION];
    value.extend(next_block.to_be_bytes());
    value.extend(recorders);
    value
}

/// The next block and the recorders of a checkpoint.
pub(in crate::store) fn checkpoint_from(value: &[u8]) -> Option<(u64, Vec<u8>)> {
    let rest = value.strip_prefix(&[VALUE_VERSION])?;
    let (next_block, recorders) = rest.split_first_chunk()?;
    Some((u64::from_be_bytes(*next_block), recorders.to_vec()))
}

/// Key of a page of a checkpoint.
pub(in crate::store) fn page(kind: u8, index: u32) -> [u8; 6] {
    let [a, b, c, d] = index.to_be_bytes();
    [PAGES[0], kind, a, b, c, d]
}

/// Kind and index of the page under a key.
pub(in crate::store) fn page_from(key: &[u8]) -> Option<(u8, u32)> {
    let [_, kind, index @ ..] = <[u8; 6]>::try_from(key).ok()?;
    Some((kind, u32::from_be_bytes(index)))
}

/// Key of a chunk of a trajectory.
pub(in crate::store) fn chunk(chunk: ChunkKey) -> [u8; 21] {
    let mut key = [CHUNKS; 21];
    key[1..5].copy_from_slice(&chunk.agent.to_be_bytes());
    key[5..13].copy_from_slice(&chunk.session.to_be_bytes());
    key[13..].copy_from_slice(&(chunk.first_stamp_ns ^ i64::MIN).to_be_bytes());
    key
}

/// The chunk that a key belongs to.
pub(in crate::store) fn chunk_from(key: &[u8]) -> Option<ChunkKey> {
    let (_, rest) = <&[u8; 21]>::try_from(key).ok()?.split_first()?;
    let (agent, rest) = rest.split_first_chunk()?;
    let (session, stamp) = rest.split_first_chunk()?;
    Some(ChunkKey {
        agent: u32::from_be_bytes(*agent),
        session: u64::from_be_bytes(*session),
        first_stamp_ns: i64::from_be_bytes(stamp.try_into().ok()?) ^ i64::MIN,
    })
}
