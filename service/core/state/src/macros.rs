//! Implementations of `State`, written by macros.

/// Implements [`State`](crate::State) for a struct, field by field. A field `as` a [`Codec`](crate::Codec) is
/// written by that.
///
/// ```
/// struct Survey {
///     station: u32,
///     heights_m: Vec<f64>,
/// }
/// state::state_of_struct!(Survey { station, heights_m as state::Counted<u8> });
/// ```
#[macro_export]
macro_rules! state_of_struct {
    (@write $value:expr, $out:ident) => {
        $crate::State::write($value, $out)
    };
    (@write $value:expr, $out:ident, $codec:ty) => {
        <$codec as $crate::Codec<_>>::write($value, $out)
    };
    (@read $input:ident) => {
        $crate::State::read($input)?
    };
    (@read $input:ident, $codec:ty) => {
        <$codec as $crate::Codec<_>>::read($input)?
    };
    ($name:ty { $($field:ident $(as $codec:ty)?),+ $(,)? }) => {
        impl $crate::State for $name {
            fn write(&self, out: &mut $crate::StateWriter) {
                $($crate::state_of_struct!(@write &self.$field, out $(, $codec)?);)+
            }

            fn read(
                input: &mut $crate::StateReader<'_>,
            ) -> Result<Self, $crate::CorruptState> {
                Ok(Self { $($field: $crate::state_of_struct!(@read input $(, $codec)?)),+ })
            }
        }
    };
}

/// Implements [`State`](crate::State) for a struct of one unnamed field: the bytes are those of the field.
///
/// ```
/// #[derive(Debug, PartialEq)]
/// struct Number(u32);
/// state::state_of_newtype!(Number);
/// ```
#[macro_export]
macro_rules! state_of_newtype {
    ($($name:ty),+ $(,)?) => {
        $(impl $crate::State for $name {
            fn write(&self, out: &mut $crate::StateWriter) {
                $crate::State::write(&self.0, out);
            }

            fn read(
                input: &mut $crate::StateReader<'_>,
            ) -> Result<Self, $crate::CorruptState> {
                $crate::State::read(input).map(Self)
            }
        })+
    };
}

/// Implements [`State`](crate::State) for an enum: one byte, a code for each variant, then the variant's field,
/// if it has one.
///
/// ```
/// enum Colour {
///     Red,
///     Grey(f32),
/// }
/// state::state_of_enum!(Colour { Red = 0, Grey(level) = 1 });
/// ```
#[macro_export]
macro_rules! state_of_enum {
    (@read $field:ident, $input:ident) => {
        $crate::State::read($input)?
    };
    ($name:ty { $($variant:ident $(($field:ident))? = $code:literal),+ $(,)? }) => {
        impl $crate::State for $name {
            fn write(&self, out: &mut $crate::StateWriter) {
                match self {
                    $(Self::$variant $(($field))? => {
                        <u8 as $crate::State>::write(&$code, out);
                        $($crate::State::write($field, out);)?
                    })+
                }
            }

            fn read(
                input: &mut $crate::StateReader<'_>,
            ) -> Result<Self, $crate::CorruptState> {
                match <u8 as $crate::State>::read(input)? {
                    $($code => Ok(
                        Self::$variant $(($crate::state_of_enum!(@read $field, input)))?
                    ),)+
                    _ => Err($crate::CorruptState::Invalid),
                }
            }
        }
    };
}
