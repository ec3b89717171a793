//! Keys and values of the database, to bytes and back.

use super::super::{SpaceNumber, StoreError, StoredSpace};

/// Key of the format.
pub(super) const FORMAT: [u8; 1] = [0];
/// Key of the number that the next space gets.
pub(super) const NEXT_SPACE: [u8; 1] = [1];
/// What the keys of spaces begin with.
pub(super) const SPACES: [u8; 1] = [2];
/// What the keys of spaces begin with that are being deleted.
pub(super) const DELETED: [u8; 1] = [5];

const BLOCKS: u8 = 3;
const DERIVED: u8 = 4;

/// Key of a space's record.
pub(super) fn space(space: SpaceNumber) -> [u8; 5] {
    of_space(SPACES[0], space)
}

/// Key that says that a space is being deleted.
pub(super) fn deleted(space: SpaceNumber) -> [u8; 5] {
    of_space(DELETED[0], space)
}

/// What the keys of a space's blocks begin with.
pub(super) fn blocks(space: SpaceNumber) -> [u8; 5] {
    of_space(BLOCKS, space)
}

/// What the keys begin with of what is derived of a space.
pub(super) fn derived(space: SpaceNumber) -> [u8; 5] {
    of_space(DERIVED, space)
}

fn of_space(kind: u8, space: SpaceNumber) -> [u8; 5] {
    let [a, b, c, d] = space.0.to_be_bytes();
    [kind, a, b, c, d]
}

/// Key of a block.
pub(super) fn block(space: SpaceNumber, block: u64) -> Vec<u8> {
    [&blocks(space)[..], &block.to_be_bytes()].concat()
}

/// Key of something that is derived of a space.
pub(super) fn derived_key(space: SpaceNumber, key: &[u8]) -> Vec<u8> {
    [&derived(space)[..], key].concat()
}

/// The space that the rest of a key names.
pub(super) fn space_of(rest: &[u8]) -> Option<SpaceNumber> {
    Some(SpaceNumber(u32::from_be_bytes(rest.try_into().ok()?)))
}

/// The block that the rest of a key names.
pub(super) fn block_of(rest: &[u8]) -> Option<u64> {
    Some(u64::from_be_bytes(rest.try_into().ok()?))
}

/// A value that is one number.
pub(super) fn number(value: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(value.try_into().ok()?))
}

/// The value of a block, with the samples up to its end.
pub(super) fn block_value(samples: u64, bytes: &[u8]) -> Vec<u8> {
    [&samples.to_le_bytes()[..], bytes].concat()
}

/// Samples up to the end of a block.
pub(super) fn samples_of(value: &[u8]) -> Option<u64> {
    let (samples, _) = value.split_first_chunk()?;
    Some(u64::from_le_bytes(*samples))
}

/// The block of a value.
pub(super) fn bytes_of(value: &[u8]) -> Option<&[u8]> {
    let (_, bytes) = value.split_first_chunk::<8>()?;
    Some(bytes)
}

/// The value of a space.
pub(super) fn space_value(name: &str, settings: &[u8]) -> Result<Vec<u8>, StoreError> {
    let too_long = |_| StoreError::Io("the name of the space is too long".to_owned());
    let length = u32::try_from(name.len()).map_err(too_long)?;
    Ok([&length.to_le_bytes()[..], name.as_bytes(), settings].concat())
}

/// The space under a key without its prefix.
pub(super) fn space_from(rest: &[u8], value: &[u8]) -> Option<StoredSpace> {
    let (length, value) = value.split_first_chunk()?;
    let (name, settings) = value.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    Some(StoredSpace {
        number: space_of(rest)?,
        name: std::str::from_utf8(name).ok()?.to_owned(),
        settings: Some(settings.to_vec()),
    })
}
