//! The canonical bytes of state: what is digested is what a checkpoint holds.
//!
//! Little endian; a float is its bits, so that equal bytes mean equal behaviour to the last bit.
//! Reading trusts nothing: bytes from a disk may be damaged.

mod types;

use crate::digest::Digest;

/// Bytes that are no state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum CorruptState {
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
pub(crate) trait State: Sized {
    /// Appends the bytes.
    fn write(&self, out: &mut StateWriter);

    /// Takes the bytes from the front.
    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState>;
}

/// Bytes being written.
#[derive(Debug, Default)]
pub(crate) struct StateWriter(Vec<u8>);

impl StateWriter {
    /// The digest of what was written.
    pub(crate) fn digest(&self) -> Digest {
        Digest::of(&self.0)
    }

    /// What was written.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.0
    }
}

/// Bytes being read.
#[derive(Debug)]
pub(crate) struct StateReader<'a>(&'a [u8]);

impl<'a> StateReader<'a> {
    /// Reads from the front of `bytes`.
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// Checks that nothing is left.
    pub(crate) fn end(self) -> Result<(), CorruptState> {
        if self.0.is_empty() {
            Ok(())
        } else {
            Err(CorruptState::Trailing)
        }
    }

    /// The next `len` bytes.
    fn take(&mut self, len: usize) -> Result<&'a [u8], CorruptState> {
        let (taken, rest) = self
            .0
            .split_at_checked(len)
            .ok_or(CorruptState::Truncated)?;
        self.0 = rest;
        Ok(taken)
    }
}

/// Implements [`State`] for a struct, field by field.
macro_rules! state_of_struct {
    ($name:ty { $($field:ident),+ $(,)? }) => {
        impl $crate::state::State for $name {
            fn write(&self, out: &mut $crate::state::StateWriter) {
                $($crate::state::State::write(&self.$field, out);)+
            }

            fn read(
                input: &mut $crate::state::StateReader<'_>,
            ) -> Result<Self, $crate::state::CorruptState> {
                Ok(Self { $($field: $crate::state::State::read(input)?),+ })
            }
        }
    };
}
pub(crate) use state_of_struct;

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
state_of_integer!(u8, u16, u32, u64, u128, i64);

impl State for f32 {
    fn write(&self, out: &mut StateWriter) {
        self.to_bits().write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self::from_bits(State::read(input)?))
    }
}

impl State for f64 {
    fn write(&self, out: &mut StateWriter) {
        self.to_bits().write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self::from_bits(State::read(input)?))
    }
}

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
    use crate::sample::Label;
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
        let label = Label::new(&"é".repeat(64)).unwrap();
        assert_eq!(read(&bytes(&label)), Ok(label));
        let nested = (Some([1u64, u64::MAX]), (None::<bool>, i64::MIN));
        assert_eq!(read(&bytes(&nested)), Ok(nested));
    }

    #[test]
    fn damaged_bytes_are_refused() {
        let whole = bytes(&Some(Label::new("dock").unwrap()));
        for len in 0..whole.len() {
            assert_eq!(
                read::<Option<Label>>(&whole[..len]),
                Err(CorruptState::Truncated)
            );
        }
        assert_eq!(
            read::<Option<Label>>(&[&whole[..], b"!"].concat()),
            Err(CorruptState::Trailing)
        );
        assert_eq!(read::<bool>(&[2]), Err(CorruptState::Invalid));
        assert_eq!(read::<Label>(&[1, 0xff]), Err(CorruptState::Invalid));
        assert_eq!(read::<Label>(&[0]), Err(CorruptState::Invalid));
    }
}
