//! Bytes of fields that are not written as their type is.

use std::marker::PhantomData;
use std::ops::Deref;

use crate::{CorruptState, State, StateReader, StateWriter};

/// A way to write a field, by [`state_of_struct!`](crate::state_of_struct).
pub trait Codec<T> {
    /// Appends the bytes.
    fn write(value: &T, out: &mut StateWriter);

    /// Takes the bytes from the front.
    ///
    /// # Errors
    /// The bytes are none of such a field.
    fn read(input: &mut StateReader<'_>) -> Result<T, CorruptState>;
}

/// A list with its count as an integer of the type `C`. Writing panics where that is too small.
#[derive(Debug)]
pub struct Counted<C>(PhantomData<C>);

impl<C, L, T> Codec<L> for Counted<C>
where
    C: State + TryFrom<usize> + Into<u64>,
    L: Deref<Target = [T]> + FromIterator<T>,
    T: State,
{
    fn write(list: &L, out: &mut StateWriter) {
        let Ok(count) = C::try_from(list.len()) else {
            panic!("{} items are more than their count can say", list.len());
        };
        count.write(out);
        for item in list.iter() {
            item.write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<L, CorruptState> {
        let count: u64 = C::read(input)?.into();
        (0..count).map(|_| T::read(input)).collect()
    }
}

/// A field that is not stored: it is read as its default.
#[derive(Debug)]
pub struct Unstored;

impl<T: Default> Codec<T> for Unstored {
    fn write(_: &T, _: &mut StateWriter) {}

    fn read(_: &mut StateReader<'_>) -> Result<T, CorruptState> {
        Ok(T::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state_of_struct;

    #[derive(Debug, PartialEq)]
    struct Survey {
        heights: Box<[u16]>,
        notes: Vec<u8>,
        sum: u32,
    }

    state_of_struct!(Survey {
        heights as Counted<u8>,
        notes as Counted<u64>,
        sum as Unstored,
    });

    #[test]
    fn a_count_takes_as_many_bytes_as_its_type() {
        let survey = Survey {
            heights: [1, 2].into(),
            notes: vec![3],
            sum: 4,
        };
        let mut out = StateWriter::default();
        survey.write(&mut out);
        let bytes = out.into_bytes();
        assert_eq!(bytes, [2, 1, 0, 2, 0, 1, 0, 0, 0, 0, 0, 0, 0, 3]);
        let read = Survey::read(&mut StateReader::new(&bytes));
        assert_eq!(read, Ok(Survey { sum: 0, ..survey }));
        let cut = Survey::read(&mut StateReader::new(&bytes[..4]));
        assert_eq!(cut, Err(CorruptState::Truncated));
    }
}
