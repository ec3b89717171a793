//! Attachments: places that keep their pose relative to a keyframe when a relaxation moves it.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector4};

use state::{CorruptState, State, StateReader, StateWriter};

/// A place with its pose relative to a keyframe.
#[derive(Clone, Debug)]
pub(super) struct Attachment {
    pub(super) keyframe: u32,
    /// The next attachment of the same keyframe.
    pub(super) next: u32,
    /// Number of the place.
    pub(super) place: u32,
    /// Its pose relative to the keyframe: for a few metres single precision suffices.
    pub(super) offset: Isometry3<f32>,
}

impl State for Attachment {
    fn write(&self, out: &mut StateWriter) {
        (self.keyframe, self.next).write(out);
        self.place.write(out);
        let (shift, turn) = (&self.offset.translation, &self.offset.rotation);
        for number in shift.vector.iter().chain(turn.coords.iter()) {
            number.to_bits().write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let (keyframe, next) = State::read(input)?;
        let place = State::read(input)?;
        let mut numbers = [0.0; 7];
        for number in &mut numbers {
            *number = f32::from_bits(State::read(input)?);
        }
        let [x, y, z, turn @ ..] = numbers;
        // Not normalised again: that might change the last bit.
        let turn = UnitQuaternion::new_unchecked(Vector4::from(turn).into());
        Ok(Self {
            keyframe,
            next,
            place,
            offset: Isometry3::from_parts(Translation3::new(x, y, z), turn),
        })
    }
}
