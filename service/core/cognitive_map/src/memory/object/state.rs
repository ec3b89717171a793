//! Bytes of objects and episodes. What follows from them is made anew when they are read.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::episode::{CONTACTS_MAX, Episode, Purpose};
use super::joined::Joining;
use super::memory::{KnownObject, ObjectMemory};
use crate::input::Label;
use ::state::{
    CorruptState, ITEMS_MAX, State, StateReader, StateWriter, read_list, state_of_struct,
    write_list,
};
use object_recognition::{ObjectId, ObjectModel};

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
impl State for Episode {
    fn write(&self, out: &mut StateWriter) {
        // What it is for: 0 to recognise, 1 to teach, 2 to recognise and learn nothing.
        let (teaches, name): (u8, Option<Label>) = match &self.purpose {
            Purpose::Learn(name) => (1, name.clone()),
            Purpose::Identify { learns: true } => (0, None),
            Purpose::Identify { learns: false } => (2, None),
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
            (1, name) => Purpose::Learn(name),
            (0, None) => Purpose::Identify { learns: true },
            (2, None) => Purpose::Identify { learns: false },
            (0u8 | 2.., _) => return Err(CorruptState::Invalid),
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
            Purpose::Identify { learns } => {
                Self::identify(model, orientation, noise).learning(learns)
            }
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
