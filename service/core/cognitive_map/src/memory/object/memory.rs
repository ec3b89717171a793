//! The objects that a space knows.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Isometry3;

use super::joined::{Joining, is_clear};
use crate::input::Label;
use crate::input::{Lesson, Touch};
use crate::memory::strength::{Clock, Strength};
use ::state::{State, StateWriter};
use object_recognition::{
    Contact, Explanation, ModelPlace, NextTouch, ObjectId, ObjectLibrary, ObjectModel, Orientation,
    Posterior, Recognition, Verdict, explain,
};

/// Most objects; of more, the weakest is forgotten.
const OBJECTS_MAX: usize = 1024;
/// Most channels that objects are sensed on. What is sensed on further ones does not count.
const CHANNELS_MAX: usize = 256;

/// What is known of an object beside its places.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownObject {
    pub(super) name: Label,
    /// Whether somebody has given it the name.
    pub(super) is_named: bool,
    pub(super) visits: u64,
    pub(super) contacts: u64,
    pub(super) strength: Strength,
    pub(super) revision: u64,
    /// Digest of its places.
    pub(super) digest: u128,
}

impl KnownObject {
    /// An object after its first visit.
    fn new(name: Label, is_named: bool, contacts: u64, now: Clock, revision: u64) -> Self {
        Self {
            name,
            is_named,
            visits: 1,
            contacts,
            strength: Strength::new(now),
            revision,
            digest: 0,
        }
    }

    /// Its name.
    pub fn name(&self) -> &Label {
        &self.name
    }

    /// Whether somebody has given it the name; of one that was learned on the spot it follows from
    /// its number.
    pub fn is_named(&self) -> bool {
        self.is_named
    }

    /// How many episodes or lessons taught it.
    pub fn visits(&self) -> u64 {
        self.visits
    }

    /// How many contacts taught it.
    pub fn contacts(&self) -> u64 {
        self.contacts
    }

    /// Revision of the map that changed it last.
    pub fn revision(&self) -> u64 {
        self.revision
    }
}

/// The objects that a space knows. A clone shares what it holds.
#[derive(Clone, Debug, Default)]
pub(crate) struct ObjectMemory {
    pub(super) library: Arc<ObjectLibrary>,
    pub(super) known: Arc<BTreeMap<ObjectId, KnownObject>>,
    /// What was joined last to an object and is still in doubt.
    pub(super) joinings: Arc<BTreeMap<ObjectId, Joining>>,
    /// Names of the channels, by number.
    pub(super) channels: Arc<Vec<Label>>,
    /// Number of the next object; none is given twice.
    pub(super) next: u32,
    /// Objects that were forgotten, with the revision: for checkpoints.
    pub(super) gone: Arc<BTreeMap<ObjectId, u64>>,
    /// Lessons and wishes to forget so far.
    pub(super) lessons: u64,
    /// Revision of the latest change of what may be recognised.
    pub(super) changed: u64,
}

impl ObjectMemory {
    /// A memory without objects, about which an answer is given from a probability on.
    pub(crate) fn new(answer_probability: f64) -> Self {
        Self {
            library: Arc::new(ObjectLibrary::answering_from(answer_probability)),
            ..Self::default()
        }
    }

    /// What may be recognised.
    pub(crate) fn library(&self) -> &ObjectLibrary {
        &self.library
    }

    /// When what may be recognised changed last.
    pub(crate) fn changed(&self) -> u64 {
        self.changed
    }

    /// Lessons and wishes to forget so far.
    pub(crate) fn lessons(&self) -> u64 {
        self.lessons
    }

    /// Whether the lesson or wish of this number is next in line.
    pub(crate) fn awaits(&self, number: u64) -> bool {
        number == self.lessons
    }

    /// Whether no object was ever touched.
    pub(crate) fn is_untouched(&self) -> bool {
        self.next == 0 && self.lessons == 0 && self.channels.is_empty()
    }

    /// The objects, by number.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (ObjectId, &KnownObject, &ObjectModel)> {
        self.known
            .iter()
            .filter_map(|(&id, known)| Some((id, known, self.library.get(id)?)))
    }

    /// An object.
    pub(crate) fn get(&self, id: ObjectId) -> Option<&KnownObject> {
        self.known.get(&id)
    }

    /// The object of a name.
    pub(crate) fn by_name(&self, name: &Label) -> Option<ObjectId> {
        let mut known = self.known.iter();
        known.find_map(|(&id, known)| (known.name == *name).then_some(id))
    }

    /// Number of a channel that is known.
    pub(crate) fn channel(&self, label: &Label) -> Option<u16> {
        let at = self.channels.iter().position(|channel| channel == label)?;
        u16::try_from(at).ok()
    }

    /// Number of a channel; a new one if there may be one more.
    pub(crate) fn open_channel(&mut self, label: &Label) -> Option<u16> {
        self.channel(label).or_else(|| {
            if self.channels.len() >= CHANNELS_MAX {
                return None;
            }
            Arc::make_mut(&mut self.channels).push(label.clone());
            u16::try_from(self.channels.len() - 1).ok()
        })
    }

    /// Name of a channel.
    pub(crate) fn channel_name(&self, channel: u16) -> Option<&Label> {
        self.channels.get(usize::from(channel))
    }

    /// Teaches an object at once, in place of what was known of it.
    pub(crate) fn teach(&mut self, name: &Label, lesson: &Lesson, now: Clock, revision: u64) {
        self.lessons += 1;
        let mut model = lesson.spacing.model();
        for touch in &lesson.touches {
            let contact = touch.contact(|label| self.open_channel(label));
            model.learn(&contact);
        }
        let contacts = lesson.touches.len() as u64;
        let id = self.by_name(name);
        let id = id.unwrap_or_else(|| self.number(revision));
        let known = KnownObject::new(name.clone(), true, contacts, now, revision);
        self.put(id, known, model, None, revision);
    }

    /// Remembers a new object that an episode sensed; answers its number. Without a name it gets
    /// one by its number.
    pub(crate) fn found(
        &mut self,
        name: Option<Label>,
        model: ObjectModel,
        contacts: u64,
        now: Clock,
        revision: u64,
    ) -> Option<ObjectId> {
        let id = self.number(revision);
        let is_named = name.is_some();
        let name = match name {
            Some(name) => name,
            None => self.unused_name(id)?,
        };
        let known = KnownObject::new(name, is_named, contacts, now, revision);
        self.put(id, known, model, None, revision);
        Some(id)
    }

    /// Extends an object by what so many visits and contacts sensed, whose frame lies in the
    /// object's so.
    pub(crate) fn extend(
        &mut self,
        id: ObjectId,
        visit: &ObjectModel,
        taught: (u64, u64),
        object_from_visit: &Isometry3<f64>,
        (now, revision): (Clock, u64),
    ) {
        let (Some(known), Some(model)) = (self.known.get(&id), self.library.get(id)) else {
            return;
        };
        let (mut known, before) = (known.clone(), model.clone());
        let mut added = ObjectModel::new(*visit.settings());
        added.extend(visit, object_from_visit);
        let mut model = before.clone();
        model.extend(&added, &Isometry3::identity());
        known.visits += taught.0;
        known.contacts += taught.1;
        known.strength.used(now, 1.0);
        known.revision = revision;
        let joining = Joining {
            before,
            added,
            taught,
        };
        self.put(id, known, model, Some(joining), revision);
    }

    /// An object that was learned on the spot is given a name that no other has.
    pub(crate) fn rename(&mut self, id: ObjectId, name: &Label, revision: u64) {
        if let Some(known) = Arc::make_mut(&mut self.known).get_mut(&id) {
            known.name = name.clone();
            known.is_named = true;
            known.revision = revision;
        }
    }

    /// An object was recognised.
    pub(crate) fn used(&mut self, id: ObjectId, now: Clock, revision: u64) {
        if let Some(known) = Arc::make_mut(&mut self.known).get_mut(&id) {
            known.strength.used(now, 1.0);
            known.revision = revision;
        }
    }

    /// Forgets the object of a name, if there is one.
    pub(crate) fn forget(&mut self, name: &Label, revision: u64) {
        self.lessons += 1;
        if let Some(id) = self.by_name(name) {
            self.remove(id, revision);
        }
    }

    /// What a sequence of contacts says that no agent sensed.
    pub(crate) fn identify(&self, orientation: &Orientation, touches: &[Touch]) -> Identified {
        let contacts = { touches.iter() }.map(|touch| touch.contact(|label| self.channel(label)));
        let contacts: Vec<_> = contacts.collect();
        let mut recognition = Recognition::new(orientation);
        for contact in &contacts {
            recognition.touch(&self.library, contact.clone());
        }
        self.identified(&recognition, orientation, &contacts)
    }

    /// What the contacts of an episode say.
    pub(super) fn identified(
        &self,
        recognition: &Recognition,
        orientation: &Orientation,
        contacts: &[Contact],
    ) -> Identified {
        let posterior = recognition.posterior(&self.library);
        Identified {
            next_touch: recognition.next_touch(&self.library),
            explanation: explain(&self.library, orientation, contacts, &posterior),
            posterior,
        }
    }

    /// Which object a visit was to, if its contacts say so, and where its frame lies in the
    /// object's.
    pub(super) fn visited(
        &self,
        orientation: &Orientation,
        contacts: &[Contact],
    ) -> Option<(ObjectId, Isometry3<f64>)> {
        let mut recognition = Recognition::new(orientation);
        for contact in contacts {
            recognition.touch(&self.library, contact.clone());
        }
        let posterior = recognition.posterior(&self.library);
        let Verdict::Object(id) = posterior.verdict() else {
            return None;
        };
        let pose = posterior.pose;
        let pose = pose.filter(|pose| pose.object == id && is_clear(pose))?;
        Some((id, pose.map_from_episode))
    }

    /// Whether all objects were given names.
    pub(super) fn are_all_named(&self) -> bool {
        self.known.values().all(|known| known.is_named)
    }

    /// Where a visit's frame lies in an object's, if its contacts say so.
    pub(super) fn align(
        &self,
        id: ObjectId,
        orientation: &Orientation,
        contacts: &[Contact],
    ) -> Option<Isometry3<f64>> {
        let mut recognition = Recognition::new(orientation);
        let mut was_it = false;
        for contact in contacts {
            recognition.touch(&self.library, contact.clone());
            // A visit may well lead beyond what is known of the object.
            was_it |= recognition.posterior(&self.library).verdict() == Verdict::Object(id);
        }
        let pose = { recognition.posterior(&self.library).pose }
            .filter(|pose| was_it && pose.object == id && is_clear(pose))?;
        Some(pose.map_from_episode)
    }

    /// Places of an object.
    pub(crate) fn places(&self, id: ObjectId) -> &[ModelPlace] {
        self.library.get(id).map_or(&[], ObjectModel::places)
    }

    pub(super) fn put(
        &mut self,
        id: ObjectId,
        mut known: KnownObject,
        model: ObjectModel,
        joining: Option<Joining>,
        revision: u64,
    ) {
        known.digest = digest_of(&model, joining.as_ref());
        let joinings = Arc::make_mut(&mut self.joinings);
        match joining {
            Some(joining) => drop(joinings.insert(id, joining)),
            None => drop(joinings.remove(&id)),
        }
        Arc::make_mut(&mut self.library).put(id, model);
        Arc::make_mut(&mut self.known).insert(id, known);
        self.changed = revision;
    }

    /// What was joined last to an object is in doubt no more. What may be recognised stays as it
    /// is, and its index with it.
    pub(super) fn settle(&mut self, id: ObjectId, revision: u64) {
        let Some(model) = self.library.get(id) else {
            return;
        };
        let digest = digest_of(model, None);
        if let Some(known) = Arc::make_mut(&mut self.known).get_mut(&id) {
            (known.digest, known.revision) = (digest, revision);
        }
        Arc::make_mut(&mut self.joinings).remove(&id);
    }

    pub(super) fn remove(&mut self, id: ObjectId, revision: u64) {
        Arc::make_mut(&mut self.joinings).remove(&id);
        Arc::make_mut(&mut self.library).remove(id);
        Arc::make_mut(&mut self.known).remove(&id);
        Arc::make_mut(&mut self.gone).insert(id, revision);
        self.changed = revision;
    }

    /// The next number, after the weakest object has made room for it.
    fn number(&mut self, revision: u64) -> ObjectId {
        if self.known.len() >= OBJECTS_MAX {
            let known = self.known.iter();
            let weakest = known.min_by(|a, b| a.1.strength.cmp(b.1.strength));
            if let Some(id) = weakest.map(|(&id, _)| id) {
                self.remove(id, revision);
            }
        }
        let id = ObjectId(self.next);
        self.next += 1;
        id
    }

    /// A name that no object has.
    fn unused_name(&self, id: ObjectId) -> Option<Label> {
        let names = (0..).map(|suffix: u32| match suffix {
            0 => format!("object-{}", id.0),
            _ => format!("object-{}-{suffix}", id.0),
        });
        let labels = names
            .take(OBJECTS_MAX + 1)
            .filter_map(|name| Label::new(&name).ok());
        labels
            .into_iter()
            .find(|label| self.by_name(label).is_none())
    }
}

/// Digest of what an object is made of.
fn digest_of(model: &ObjectModel, joining: Option<&Joining>) -> u128 {
    let mut out = StateWriter::default();
    model.write(&mut out);
    joining.cloned().write(&mut out);
    out.digest().0
}

/// What contacts say, and which touch would tell most.
#[derive(Clone, Debug)]
pub struct Identified {
    /// What they say.
    pub posterior: Posterior,
    /// What would tell more.
    pub next_touch: Option<NextTouch>,
    /// Why.
    pub explanation: Explanation,
}
