//! The canonical bytes of state: what is digested is what a checkpoint holds.
//!
//! Little endian; a float is its bits, so that equal bytes mean equal behaviour to the last bit.
//! Reading trusts nothing: bytes from a disk may be damaged.

use crate::Digest;

/// Bytes that are no state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CorruptState {
    /// The bytes end before the state does.
    #[error("the bytes end too early")]
    Truncated,
    /// The bytes go on after the state's end.
    #[error("the bytes go on after the end")]
    Trailing,
    /// A value is not allowed where it stands.
    #[error("a value is not allowed")]
    Invalid,
}

/// What can be written as bytes and read back.
pub trait State: Sized {
    /// Appends the bytes.
    fn write(&self, out: &mut StateWriter);

    /// Takes the bytes from the front.
    ///
    /// # Errors
    /// The bytes are none of such a state.
    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState>;
}

/// Bytes being written.
#[derive(Debug, Default)]
pub struct StateWriter(Vec<u8>);

impl StateWriter {
    /// The digest of what was written.
    pub fn digest(&self) -> Digest {
        Digest::of(&self.0)
    }

    /// Appends bytes as they are.
    pub fn extend(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    /// What was written.
    pub fn into_bytes(self) -> Vec<u8> {
        self.0
    }
}

/// Bytes being read.
#[derive(Debug)]
pub struct StateReader<'a>(&'a [u8]);

impl<'a> StateReader<'a> {
    /// Reads from the front of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// Checks that nothing is left.
    ///
    /// # Errors
    /// Something is.
    pub fn end(self) -> Result<(), CorruptState> {
        if self.0.is_empty() {
            Ok(())
        } else {
            Err(CorruptState::Trailing)
        }
    }

    /// The next `len` bytes.
    ///
    /// # Errors
    /// There are fewer.
    pub fn take(&mut self, len: usize) -> Result<&'a [u8], CorruptState> {
        let (taken, rest) = self
            .0
            .split_at_checked(len)
            .ok_or(CorruptState::Truncated)?;
        self.0 = rest;
        Ok(taken)
    }
}

/// Implements [`State`] for integers by their little-endian bytes.
macro_rules! state_of_integer {
    ($($name:ty),+) => {
        $(impl State for $name {
            fn write(&self, out: &mut StateWriter) {
                out.0.extend(self.to_le_bytes());
            }

            fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
                let bytes = input.take(size_of::<$name>())?;
                Ok(Self::from_le_bytes(bytes.try_into().expect("as many bytes as asked for")))
            }
        })+
    };
}
state_of_integer!(u8, u16, u32, u64, u128, i32, i64);

/// Most items of a list that no smaller bound is known of: against counts that no bytes can follow.
pub const ITEMS_MAX: u32 = 1 << 20;

/// Writes the count of items, then the items.
///
/// # Panics
/// There are more than 2³² - 1.
pub fn write_list<'a, T: State + 'a>(
    items: impl ExactSizeIterator<Item = &'a T>,
    out: &mut StateWriter,
) {
    u32::try_from(items.len())
        .expect("lists are bounded")
        .write(out);
    for item in items {
        item.write(out);
    }
}

/// Reads what [`write_list`] wrote.
///
/// # Errors
/// There are more than `most`, or the bytes are none of such items.
pub fn read_list<T: State>(input: &mut StateReader<'_>, most: u32) -> Result<Vec<T>, CorruptState> {
    let count = u32::read(input)?;
    if count > most {
        return Err(CorruptState::Invalid);
    }
    (0..count).map(|_| T::read(input)).collect()
}

/// Implements [`State`] for floats by their bits.
macro_rules! state_of_float {
    ($($name:ty),+) => {
        $(impl State for $name {
            fn write(&self, out: &mut StateWriter) {
                self.to_bits().write(out);
            }

            fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
                Ok(Self::from_bits(State::read(input)?))
            }
        })+
    };
}
state_of_float!(f32, f64);

impl State for bool {
    fn write(&self, out: &mut StateWriter) {
        u8::from(*self).write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        match u8::read(input)? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(CorruptState::Invalid),
        }
    }
}

/// A list of at most [`ITEMS_MAX`] items, as [`write_list`] writes it.
impl<T: State> State for Vec<T> {
    fn write(&self, out: &mut StateWriter) {
        write_list(self.iter(), out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        read_list(input, ITEMS_MAX)
    }
}

impl<T: State> State for Option<T> {
    fn write(&self, out: &mut StateWriter) {
        self.is_some().write(out);
        if let Some(value) = self {
            value.write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        if bool::read(input)? {
            T::read(input).map(Some)
        } else {
            Ok(None)
        }
    }
}

impl<A: State, B: State> State for (A, B) {
    fn write(&self, out: &mut StateWriter) {
        self.0.write(out);
        self.1.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok((A::read(input)?, B::read(input)?))
    }
}

impl<T: State + Copy + Default, const N: usize> State for [T; N] {
    fn write(&self, out: &mut StateWriter) {
        for value in self {
            value.write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let mut values = [T::default(); N];
        for value in &mut values {
            *value = T::read(input)?;
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state_of_enum;
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};

    fn bytes(state: &impl State) -> Vec<u8> {
        let mut out = StateWriter::default();
        state.write(&mut out);
        out.into_bytes()
    }

    fn read<T: State>(bytes: &[u8]) -> Result<T, CorruptState> {
        let mut input = StateReader::new(bytes);
        let state = T::read(&mut input)?;
        input.end().map(|()| state)
    }

    #[test]
    fn every_bit_survives() {
        for value in [
            0.0,
            -0.0,
            f64::MIN_POSITIVE / 2.0,
            1e300,
            f64::INFINITY,
            f64::NAN,
        ] {
            assert_eq!(
                read::<f64>(&bytes(&value)).unwrap().to_bits(),
                value.to_bits()
            );
        }
        let rotation = UnitQuaternion::from_euler_angles(0.1, -2.0, 3.0);
        let pose = Isometry3::from_parts(Translation3::new(1.0, -2.0, 3e8), rotation);
        assert_eq!(read(&bytes(&pose)), Ok(pose));
        let nested = (Some([1u64, u64::MAX]), (None::<bool>, i64::MIN));
        assert_eq!(read(&bytes(&nested)), Ok(nested));
    }

    #[test]
    fn an_enum_without_fields_is_one_byte() {
        #[derive(Debug, PartialEq)]
        enum Colour {
            Red,
            Green,
        }
        state_of_enum!(Colour { Red = 0, Green = 7 });
        assert_eq!(
            (bytes(&Colour::Red), bytes(&Colour::Green)),
            (vec![0], vec![7])
        );
        assert_eq!(read::<Colour>(&[7]), Ok(Colour::Green));
        assert_eq!(read::<Colour>(&[1]), Err(CorruptState::Invalid));
    }

    #[test]
    fn an_enum_with_a_field_is_one_byte_and_the_field() {
        #[derive(Debug, PartialEq)]
        enum Shade {
            None,
            Grey(u16),
        }
        state_of_enum!(Shade { None = 0, Grey(level) = 1 });
        assert_eq!(bytes(&Shade::Grey(2)), [1, 2, 0]);
        assert_eq!(read(&[1, 2, 0]), Ok(Shade::Grey(2)));
        assert_eq!(read(&[0]), Ok(Shade::None));
        assert_eq!(read::<Shade>(&[1, 2]), Err(CorruptState::Truncated));
    }

    #[test]
    fn damaged_bytes_are_refused() {
        let whole = bytes(&Some([1.0, 2.0, 3.0]));
        for len in 0..whole.len() {
            let cut = read::<Option<[f64; 3]>>(&whole[..len]);
            assert_eq!(cut, Err(CorruptState::Truncated));
        }
        let longer = [&whole[..], b"!"].concat();
        assert_eq!(
            read::<Option<[f64; 3]>>(&longer),
            Err(CorruptState::Trailing)
        );
        assert_eq!(read::<bool>(&[2]), Err(CorruptState::Invalid));
    }
}
