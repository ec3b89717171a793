//! The bytes of bounded lists and maps.

use std::collections::BTreeMap;

use ::state::{CorruptState, State, StateReader, StateWriter};

/// Writes a number of things or of a thing.
pub(super) fn write_count(count: usize, out: &mut StateWriter) {
    (count as u64).write(out);
}

/// Reads a number that is bounded.
pub(super) fn read_count(input: &mut StateReader<'_>, most: usize) -> Result<usize, CorruptState> {
    let count = usize::try_from(u64::read(input)?).map_err(|_| CorruptState::Invalid)?;
    if count <= most {
        Ok(count)
    } else {
        Err(CorruptState::Invalid)
    }
}

/// Writes how many there are, and each.
pub(super) fn write_all<'a, T: State + 'a>(
    count: usize,
    items: impl IntoIterator<Item = &'a T>,
    out: &mut StateWriter,
) {
    write_count(count, out);
    for item in items {
        item.write(out);
    }
}

/// Writes how many keys there are, and each with its value.
pub(super) fn write_pairs<'a, K: State + 'a, V: State + 'a>(
    count: usize,
    pairs: impl IntoIterator<Item = (&'a K, &'a V)>,
    out: &mut StateWriter,
) {
    write_count(count, out);
    for (key, value) in pairs {
        key.write(out);
        value.write(out);
    }
}

/// Reads a bounded number.
pub(super) fn read_all<T: State>(
    input: &mut StateReader<'_>,
    most: usize,
) -> Result<Vec<T>, CorruptState> {
    (0..read_count(input, most)?)
        .map(|_| T::read(input))
        .collect()
}

/// Writes keys with their values, in order.
pub(super) fn write_map<K: State, V: State>(map: &BTreeMap<K, V>, out: &mut StateWriter) {
    write_pairs(map.len(), map, out);
}

/// Reads a bounded number of keys with their values, in order.
pub(super) fn read_map<K: State + Ord, V: State>(
    input: &mut StateReader<'_>,
    most: usize,
) -> Result<BTreeMap<K, V>, CorruptState> {
    let items: Vec<(K, V)> = read_all(input, most)?;
    if items.is_sorted_by(|one, next| one.0 < next.0) {
        Ok(items.into_iter().collect())
    } else {
        Err(CorruptState::Invalid)
    }
}
