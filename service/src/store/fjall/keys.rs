//! Keys and the values that the store composes itself, to bytes and back.

use super::super::{ChunkKey, SpaceNumber, StoreError, StoredSpace};

/// Key of the store's format.
pub(super) const FORMAT: &str = "format";
/// Key of the number that the next space gets.
pub(super) const NEXT_SPACE: &str = "next_space";
/// Prefix of the spaces' records.
pub(super) const SPACE: &str = "space/";
/// Prefix of the marks of deleted spaces that still have keys.
pub(super) const DELETED: &str = "deleted/";

/// Version of the values that the store composes.
const VALUE_VERSION: u8 = 1;

/// A space's key under [`SPACE`] or [`DELETED`].
pub(super) fn meta_key(prefix: &str, space: SpaceNumber) -> String {
    format!("{prefix}{}", space.0)
}

/// The space in a key under `prefix`.
pub(super) fn meta_number(key: &[u8], prefix: &str) -> Result<SpaceNumber, StoreError> {
    key.strip_prefix(prefix.as_bytes())
        .and_then(|digits| std::str::from_utf8(digits).ok()?.parse().ok())
        .map(SpaceNumber)
        .ok_or_else(|| corrupt("key of a space"))
}

/// A number kept under a key of its own, called `what` in the error.
pub(super) fn number_from(value: &[u8], what: &str) -> Result<u32, StoreError> {
    let bytes = value.try_into().map_err(|_| corrupt(what))?;
    Ok(u32::from_be_bytes(bytes))
}

/// The record of a space.
pub(super) fn space_value(name: &str, settings: &[u8]) -> Result<Vec<u8>, StoreError> {
    let name_len = u32::try_from(name.len())
        .map_err(|_| StoreError::Io("the name of the space is too long".to_owned()))?;
    let mut value = vec![VALUE_VERSION];
    value.extend(name_len.to_be_bytes());
    value.extend(name.as_bytes());
    value.extend(settings);
    Ok(value)
}

/// A space from its record.
pub(super) fn space_from(number: SpaceNumber, value: &[u8]) -> Result<StoredSpace, StoreError> {
    let what = "record of a space";
    let rest = versioned(value, what)?;
    let (name_len, rest) = rest.split_first_chunk().ok_or_else(|| corrupt(what))?;
    let name_len = u32::from_be_bytes(*name_len) as usize;
    let (name, settings) = (rest.split_at_checked(name_len)).ok_or_else(|| corrupt(what))?;
    let name = std::str::from_utf8(name).map_err(|_| corrupt(what))?;
    Ok(StoredSpace {
        number,
        name: name.to_owned(),
        settings: settings.to_vec(),
    })
}

/// What all keys of a space begin with, outside `meta`.
pub(super) fn prefix(space: SpaceNumber) -> [u8; 4] {
    space.0.to_be_bytes()
}

/// Key of a block of the journal.
pub(super) fn journal(space: SpaceNumber, block: u64) -> [u8; 12] {
    let mut key = [0; 12];
    key[..4].copy_from_slice(&prefix(space));
    key[4..].copy_from_slice(&block.to_be_bytes());
    key
}

/// Number of the block under a key of the journal.
pub(super) fn block_from(key: &[u8]) -> Result<u64, StoreError> {
    let key: &[u8; 12] = key.try_into().map_err(|_| corrupt("key of a block"))?;
    Ok(u64::from_be_bytes(part(key, 4)))
}

/// Key of a space's checkpoint.
pub(super) fn checkpoint(space: SpaceNumber) -> [u8; 4] {
    prefix(space)
}

/// The record of a checkpoint.
pub(super) fn checkpoint_value(next_block: u64, recorders: &[u8]) -> Vec<u8> {
    let mut value = vec![VALUE_VERSION];
    value.extend(next_block.to_be_bytes());
    value.extend(recorders);
    value
}

/// The next block and the recorders of a checkpoint.
pub(super) fn checkpoint_from(value: &[u8]) -> Result<(u64, Vec<u8>), StoreError> {
    let what = "record of a checkpoint";
    let rest = versioned(value, what)?;
    let (next_block, recorders) = rest.split_first_chunk().ok_or_else(|| corrupt(what))?;
    Ok((u64::from_be_bytes(*next_block), recorders.to_vec()))
}

/// Key of a page of a checkpoint.
pub(super) fn page(space: SpaceNumber, kind: u8, index: u32) -> [u8; 9] {
    let mut key = [0; 9];
    key[..4].copy_from_slice(&prefix(space));
    key[4] = kind;
    key[5..].copy_from_slice(&index.to_be_bytes());
    key
}

/// Kind and index of the page under a key.
pub(super) fn page_from(key: &[u8]) -> Result<(u8, u32), StoreError> {
    let key: &[u8; 9] = key.try_into().map_err(|_| corrupt("key of a page"))?;
    Ok((key[4], u32::from_be_bytes(part(key, 5))))
}

/// Key of a chunk of a trajectory.
pub(super) fn chunk(space: SpaceNumber, chunk: ChunkKey) -> [u8; 24] {
    let mut key = [0; 24];
    key[..4].copy_from_slice(&prefix(space));
    key[4..8].copy_from_slice(&chunk.agent.to_be_bytes());
    key[8..16].copy_from_slice(&chunk.session.to_be_bytes());
    key[16..].copy_from_slice(&(chunk.first_stamp_ns ^ i64::MIN).to_be_bytes());
    key
}

/// The chunk that a key belongs to.
pub(super) fn chunk_from(key: &[u8]) -> Result<ChunkKey, StoreError> {
    let key: &[u8; 24] = key.try_into().map_err(|_| corrupt("key of a chunk"))?;
    Ok(ChunkKey {
        agent: u32::from_be_bytes(part(key, 4)),
        session: u64::from_be_bytes(part(key, 8)),
        first_stamp_ns: i64::from_be_bytes(part(key, 16)) ^ i64::MIN,
    })
}

/// `N` bytes of a key that is long enough for them.
fn part<const N: usize, const LENGTH: usize>(key: &[u8; LENGTH], at: usize) -> [u8; N] {
    std::array::from_fn(|i| key[at + i])
}

/// What follows the version byte.
fn versioned<'a>(value: &'a [u8], what: &str) -> Result<&'a [u8], StoreError> {
    match value.split_first() {
        Some((&VALUE_VERSION, rest)) => Ok(rest),
        Some((version, _)) => Err(StoreError::Corrupt(format!(
            "{what}: unknown version {version}"
        ))),
        None => Err(corrupt(what)),
    }
}

/// The error of bytes, called `what`, that do not make sense.
pub(super) fn corrupt(what: &str) -> StoreError {
    StoreError::Corrupt(what.to_owned())
}
