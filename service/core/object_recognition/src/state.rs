//! State of contacts and models, for checkpoints.

use crate::{
    Contact, DescriptorReading, LevelMemory, LevelReading, ModelPlace, ModelSettings, ObjectId,
    ObjectModel, Orientation, Reached, Verdict,
};
use state::{
    CorruptState, Counted, State, StateReader, StateWriter, state_of_enum, state_of_newtype,
    state_of_struct, write_list,
};

state_of_struct!(LevelMemory {
    channel,
    count,
    mean,
    squares,
    noise
});
state_of_struct!(LevelReading { channel, value, sd });

state_of_newtype!(ObjectId);
state_of_enum!(Reached {
    Found = 0,
    Aimed = 1,
    Drawn = 2
});

state_of_struct!(DescriptorReading {
    channel,
    vector as Counted<u32>,
});
state_of_struct!(Contact {
    position_m,
    position_sd_m,
    drift_sd_m,
    normal,
    normal_sd_rad,
    levels,
    descriptors,
    reached,
});
state_of_struct!(ModelPlace {
    position_m,
    normals,
    count,
    visits,
    variance_m2,
    normal_variance,
    levels,
    descriptors,
});
state_of_enum!(Orientation {
    Known = 0,
    Free = 1,
    Finite(rotations) = 2,
    Yaw = 3,
});

impl State for ObjectModel {
    fn write(&self, out: &mut StateWriter) {
        let settings = self.settings();
        (settings.spacing_m, settings.places_max as u64).write(out);
        self.spacing_m().write(out);
        write_list(self.places().iter(), out);
        self.latest().map(|place| place as u64).write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let (spacing_m, places_max): (f64, u64) = State::read(input)?;
        let settings = ModelSettings {
            spacing_m,
            places_max: usize::try_from(places_max).map_err(|_| CorruptState::Invalid)?,
        };
        let spacing_m = State::read(input)?;
        let places: Vec<ModelPlace> = State::read(input)?;
        let latest: Option<u64> = State::read(input)?;
        let latest = latest.map(usize::try_from).transpose();
        let latest = latest.map_err(|_| CorruptState::Invalid)?;
        if latest.is_some_and(|latest| latest >= places.len()) {
            return Err(CorruptState::Invalid);
        }
        Ok(Self::with_places(settings, spacing_m, places).after(latest))
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
