//! The bytes of objects and episodes. What follows from them is made anew when they are read.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Unit, Vector3};

use super::episode::{CONTACTS_MAX, Episode, Purpose};
use super::joining::Joining;
use super::mark::TouchNoise;
use super::memory::{KnownObject, ObjectMemory};
use crate::recognition::{
    Contact, Felt, LevelMemory, ModelPlace, ModelSettings, ObjectId, ObjectModel, Orientation,
    Reached, Seen, Verdict,
};
use crate::sample::Label;
use crate::state::{CorruptState, State, StateReader, StateWriter, state_of_struct};

/// Most items of any list here, against counts that no bytes can follow.
const ITEMS_MAX: u32 = 1 << 20;

state_of_struct!(KnownObject {
    name,
    is_named,
    visits,
    contacts,
    strength,
    revision,
    digest
});
state_of_struct!(Joining {
    before,
    added,
    taught
});
state_of_struct!(LevelMemory {
    channel,
    count,
    mean,
    squares,
    noise
});
state_of_struct!(Felt { channel, value, sd });

fn write_list<'a, T: State + 'a>(
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

fn read_list<T: State>(input: &mut StateReader<'_>, most: u32) -> Result<Vec<T>, CorruptState> {
    let count = u32::read(input)?;
    if count > most {
        return Err(CorruptState::Invalid);
    }
    (0..count).map(|_| T::read(input)).collect()
}

impl State for ObjectId {
    fn write(&self, out: &mut StateWriter) {
        self.0.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        State::read(input).map(Self)
    }
}

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
        let reached: u8 = match self.reached {
            Reached::Found => 0,
            Reached::Aimed => 1,
            Reached::Drawn => 2,
        };
        reached.write(out);
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
            reached: match u8::read(input)? {
                0 => Reached::Found,
                1 => Reached::Aimed,
                2 => Reached::Drawn,
                _ => return Err(CorruptState::Invalid),
            },
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

impl State for TouchNoise {
    fn write(&self, out: &mut StateWriter) {
        [self.position_sd_m(), self.normal_sd_rad(), self.level_sd()].write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let [position_sd_m, normal_sd_rad, level_sd] = State::read(input)?;
        Self::new(position_sd_m, normal_sd_rad, level_sd).map_err(|_| CorruptState::Invalid)
    }
}

impl State for Episode {
    fn write(&self, out: &mut StateWriter) {
        let (teaches, name): (bool, Option<Label>) = match &self.purpose {
            Purpose::Learn(name) => (true, name.clone()),
            Purpose::Identify => (false, None),
        };
        (teaches, name).write(out);
        self.orientation.write(out);
        self.noise.write(out);
        self.travel.write(out);
        self.drift_sd_m.write(out);
        write_list(self.contacts.iter(), out);
        self.model.write(out);
        (self.count, self.live).write(out);
        self.verdict.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let purpose = match State::read(input)? {
            (true, name) => Purpose::Learn(name),
            (false, None) => Purpose::Identify,
            (false, Some(_)) => return Err(CorruptState::Invalid),
        };
        let orientation = State::read(input)?;
        let noise = State::read(input)?;
        let travel = State::read(input)?;
        let drift_sd_m = State::read(input)?;
        let contacts = read_list(input, u32::try_from(CONTACTS_MAX).unwrap_or(u32::MAX))?;
        let model = State::read(input)?;
        let (count, live) = State::read(input)?;
        let verdict = State::read(input)?;
        let episode = match purpose {
            Purpose::Learn(name) => Self::learn(name, model, orientation, noise),
            Purpose::Identify => Self::identify(model, orientation, noise),
        };
        Ok(Self {
            travel,
            drift_sd_m,
            contacts,
            count,
            live,
            verdict,
            ..episode
        })
    }
}

impl ObjectMemory {
    /// What opens the part of a checkpoint and of the digest that is about objects.
    pub(crate) fn write_head(&self, out: &mut StateWriter) {
        (self.next, (self.lessons, self.changed)).write(out);
        write_list(self.channels.iter(), out);
        u32::try_from(self.known.len())
            .expect("objects are bounded")
            .write(out);
    }

    /// The objects that changed after a revision, each as bytes; none where it was forgotten.
    pub(crate) fn changed_since(&self, since: u64) -> impl Iterator<Item = (u32, Vec<u8>)> {
        let known = self
            .iter()
            .filter(move |(_, known, _)| known.revision() > since);
        let known = known.map(|(id, known, model)| {
            let mut out = StateWriter::default();
            known.write(&mut out);
            model.write(&mut out);
            self.joinings.get(&id).cloned().write(&mut out);
            (id.0, out.into_bytes())
        });
        let gone = self.gone.iter().filter(move |&(_, &at)| at > since);
        known.chain(gone.map(|(id, _)| (id.0, Vec::new())))
    }

    /// All that is known of objects, for the map's digest.
    pub(crate) fn write_digests(&self, out: &mut StateWriter) {
        self.write_head(out);
        for (id, known, _) in self.iter() {
            id.write(out);
            known.write(out);
        }
    }

    /// Reads what [`write_head`](Self::write_head) wrote; answers how many objects follow.
    pub(crate) fn read_head(&mut self, bytes: &[u8]) -> Result<u32, CorruptState> {
        let mut input = StateReader::new(bytes);
        (self.next, (self.lessons, self.changed)) = State::read(&mut input)?;
        self.channels = Arc::new(read_list(&mut input, ITEMS_MAX)?);
        let count = u32::read(&mut input)?;
        input.end()?;
        Ok(count)
    }

    /// Adds objects of a checkpoint.
    pub(crate) fn restore(&mut self, objects: &BTreeMap<u32, Vec<u8>>) -> Result<(), CorruptState> {
        for (&id, bytes) in objects {
            let mut input = StateReader::new(bytes);
            let known = KnownObject::read(&mut input)?;
            let model = ObjectModel::read(&mut input)?;
            let joining = State::read(&mut input)?;
            input.end()?;
            let changed = self.changed;
            self.put(ObjectId(id), known, model, joining, changed);
        }
        Ok(())
    }
}
