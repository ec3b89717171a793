//! Codecs of bounded numbers, lists and maps, and of what is shared.

use std::collections::BTreeMap;
use std::sync::Arc;

use ::state::{Codec, CorruptState, State, StateReader, StateWriter};

/// A number of at most `MOST`.
pub(super) struct UpTo<const MOST: usize>;

impl<const MOST: usize> Codec<usize> for UpTo<MOST> {
    fn write(number: &usize, out: &mut StateWriter) {
        (*number as u64).write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<usize, CorruptState> {
        let number = usize::try_from(u64::read(input)?);
        number
            .ok()
            .filter(|number| *number <= MOST)
            .ok_or(CorruptState::Invalid)
    }
}

impl<const MOST: usize> Codec<[usize; 2]> for UpTo<MOST> {
    fn write(numbers: &[usize; 2], out: &mut StateWriter) {
        for number in numbers {
            <Self as Codec<usize>>::write(number, out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<[usize; 2], CorruptState> {
        Ok([Self::read(input)?, Self::read(input)?])
    }
}

/// A list of at most `MOST` items.
pub(super) struct ListUpTo<const MOST: usize>;

impl<const MOST: usize, L> Codec<L> for ListUpTo<MOST>
where
    L: IntoIterator + FromIterator<L::Item>,
    for<'a> &'a L: IntoIterator<Item = &'a L::Item>,
    L::Item: State,
{
    fn write(list: &L, out: &mut StateWriter) {
        UpTo::<MOST>::write(&list.into_iter().count(), out);
        for item in list {
            item.write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<L, CorruptState> {
        let count: usize = UpTo::<MOST>::read(input)?;
        (0..count).map(|_| State::read(input)).collect()
    }
}

/// A list of at most `MOST` items in their own order, none of them twice.
pub(super) struct SortedUpTo<const MOST: usize>;

impl<const MOST: usize, T: State + Ord> Codec<Vec<T>> for SortedUpTo<MOST> {
    fn write(list: &Vec<T>, out: &mut StateWriter) {
        ListUpTo::<MOST>::write(list, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Vec<T>, CorruptState> {
        let list: Vec<T> = ListUpTo::<MOST>::read(input)?;
        if list.is_sorted_by(|one, next| one < next) {
            Ok(list)
        } else {
            Err(CorruptState::Invalid)
        }
    }
}

/// A map of at most `MOST` keys, in their order.
pub(super) struct MapUpTo<const MOST: usize>;

impl<const MOST: usize, K: State + Ord, V: State> Codec<BTreeMap<K, V>> for MapUpTo<MOST> {
    fn write(map: &BTreeMap<K, V>, out: &mut StateWriter) {
        UpTo::<MOST>::write(&map.len(), out);
        for (key, value) in map {
            key.write(out);
            value.write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<BTreeMap<K, V>, CorruptState> {
        let items: Vec<(K, V)> = ListUpTo::<MOST>::read(input)?;
        if items.is_sorted_by(|one, next| one.0 < next.0) {
            Ok(items.into_iter().collect())
        } else {
            Err(CorruptState::Invalid)
        }
    }
}

impl<const MOST: usize, K: State + Ord, V: State> Codec<Arc<BTreeMap<K, V>>> for MapUpTo<MOST> {
    fn write(map: &Arc<BTreeMap<K, V>>, out: &mut StateWriter) {
        <Self as Codec<BTreeMap<K, V>>>::write(map, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Arc<BTreeMap<K, V>>, CorruptState> {
        Self::read(input).map(Arc::new)
    }
}

/// Something that is shared, as itself.
pub(super) struct Shared;

impl<T: State> Codec<Arc<T>> for Shared {
    fn write(shared: &Arc<T>, out: &mut StateWriter) {
        shared.as_ref().write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Arc<T>, CorruptState> {
        T::read(input).map(Arc::new)
    }
}
