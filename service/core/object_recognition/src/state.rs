//! State of contacts and models, for checkpoints.

use nalgebra::{Unit, Vector3};

use crate::{
    Contact, Felt, LevelMemory, ModelPlace, ModelSettings, ObjectId, ObjectModel, Orientation,
    Reached, Seen, Verdict,
};
use state::{
    CorruptState, ITEMS_MAX, State, StateReader, StateWriter, read_list, state_of_enum,
    state_of_newtype, state_of_struct, write_list,
};

state_of_struct!(LevelMemory {
    channel,
    count,
    mean,
    squares,
    noise
});
state_of_struct!(Felt { channel, value, sd });

state_of_newtype!(ObjectId);
state_of_enum!(Reached {
    Found = 0,
    Aimed = 1,
    Drawn = 2
});

impl State for Seen {
    fn write(&self, out: &mut StateWriter) {
        self.channel.write(out);
        write_list(self.vector.iter(), out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            channel: State::read(input)?,
            vector: read_list::<f32>(input, ITEMS_MAX)?.into(),
        })
    }
}

impl State for Contact {
    fn write(&self, out: &mut StateWriter) {
        self.position_m.write(out);
        (self.position_sd_m, self.drift_sd_m).write(out);
        self.normal.map(Unit::into_inner).write(out);
        self.normal_sd_rad.write(out);
        write_list(self.levels.iter(), out);
        write_list(self.descriptors.iter(), out);
        self.reached.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let position_m = State::read(input)?;
        let (position_sd_m, drift_sd_m) = State::read(input)?;
        // Not normalised again: that might change the last bit.
        let normal = Option::<Vector3<f64>>::read(input)?.map(Unit::new_unchecked);
        Ok(Self {
            position_m,
            position_sd_m,
            drift_sd_m,
            normal,
            normal_sd_rad: State::read(input)?,
            levels: read_list(input, ITEMS_MAX)?,
            descriptors: read_list(input, ITEMS_MAX)?,
            reached: State::read(input)?,
        })
    }
}

impl State for ModelPlace {
    fn write(&self, out: &mut StateWriter) {
        self.position_m.write(out);
        self.normals.write(out);
        [self.count, self.variance_m2, self.normal_variance].write(out);
        write_list(self.levels.iter(), out);
        write_list(self.descriptors.iter(), out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let (position_m, normals) = State::read(input)?;
        let [count, variance_m2, normal_variance] = State::read(input)?;
        Ok(Self {
            position_m,
            normals,
            count,
            variance_m2,
            normal_variance,
            levels: read_list(input, ITEMS_MAX)?,
            descriptors: read_list(input, ITEMS_MAX)?,
        })
    }
}

impl State for ObjectModel {
    fn write(&self, out: &mut StateWriter) {
        let settings = self.settings();
        (settings.spacing_m, settings.places_max as u64).write(out);
        self.spacing_m().write(out);
        write_list(self.places().iter(), out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let (spacing_m, places_max): (f64, u64) = State::read(input)?;
        let settings = ModelSettings {
            spacing_m,
            places_max: usize::try_from(places_max).map_err(|_| CorruptState::Invalid)?,
        };
        let spacing_m = State::read(input)?;
        let places = read_list(input, ITEMS_MAX)?;
        Ok(Self::with_places(settings, spacing_m, places))
    }
}

impl State for Orientation {
    fn write(&self, out: &mut StateWriter) {
        match self {
            Self::Known => 0u8.write(out),
            Self::Free => 1u8.write(out),
            Self::Finite(rotations) => {
                2u8.write(out);
                write_list(rotations.iter(), out);
            }
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(match u8::read(input)? {
            0 => Self::Known,
            1 => Self::Free,
            2 => Self::Finite(read_list(input, ITEMS_MAX)?),
            _ => return Err(CorruptState::Invalid),
        })
    }
}

impl State for Verdict {
    fn write(&self, out: &mut StateWriter) {
        let (kind, object) = match self {
            Self::Undecided => (0u8, 0),
            Self::Object(object) => (1, object.0),
            Self::Unknown => (2, 0),
        };
        (kind, object).write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(match State::read(input)? {
            (0u8, 0u32) => Self::Undecided,
            (1, object) => Self::Object(ObjectId(object)),
            (2, 0) => Self::Unknown,
            _ => return Err(CorruptState::Invalid),
        })
    }
}
