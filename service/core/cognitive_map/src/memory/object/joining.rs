//! Objects that turn out to be one, and one that turns out to be two.
//!
//! Nothing else than [recognition](object_recognition) decides. Two objects that a visit fits
//! equally well are one if what was learned of the one, touched again, is the other. What was
//! joined last to an object stays in doubt: a visit that fits the object as it was before, or what
//! was joined to it, better than both together takes them apart again; one that fits both together
//! better settles it.

use nalgebra::Isometry3;

use super::joined::is_clear;
use super::memory::{KnownObject, ObjectMemory};
use crate::input::Label;
use crate::memory::strength::Clock;
use object_recognition::{
    Contact, ObjectId, ObjectLibrary, Orientation, Posterior, Recognition, Verdict,
};

/// Contacts by which two objects, or the parts of one, are compared: they tell about as much as a
/// whole visit does.
const CONTACTS_MAX: usize = 48;
/// Most objects of a visit that are compared with one another.
const COMPARED_MAX: usize = 4;
/// Fit below which a model is not explained by another one that it would be taken for, in
/// deviations.
const FIT_LEAST: f64 = -3.0;

/// Numbers of the parts while they are compared.
const BEFORE: ObjectId = ObjectId(0);
const ADDED: ObjectId = ObjectId(1);
const TOGETHER: ObjectId = ObjectId(2);

/// Pose of one object's frame in that of another.
#[derive(Clone, Copy)]
enum FramePose {
    Unique(Isometry3<f64>),
    /// Something symmetric, which is explained in each of several poses.
    Ambiguous,
}

impl FramePose {
    /// Pose of the other frame in the one.
    fn inverse(self) -> Self {
        match self {
            Self::Unique(pose) => Self::Unique(pose.inverse()),
            Self::Ambiguous => Self::Ambiguous,
        }
    }
}

/// What a visit brought to light of what is known already.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Insight {
    /// Two objects are one, and the name of the one that is no more.
    Merged { object: ObjectId, absorbed: Label },
    /// What was joined to an object is one of its own.
    Split { object: ObjectId, part: ObjectId },
}

impl ObjectMemory {
    /// Whether nothing that is known may turn out to be something else.
    pub(super) fn is_settled(&self) -> bool {
        self.joinings.is_empty() && self.are_all_named()
    }

    /// The object that one looks like, turned about the vertical or not, with its probability: what
    /// was learned of the one, touched again, would be taken for the other.
    pub(crate) fn alike(&self, id: ObjectId) -> Option<(ObjectId, f64)> {
        let others = self.known.keys().filter(|&&other| other != id);
        let others = self.library.select(others.map(|&other| (other, other)));
        let contacts = self.sampled(id);
        let posterior = recognised(&others, &Orientation::Yaw, contacts);
        match (posterior.verdict(), posterior.objects.first()) {
            (Verdict::Object(other), Some(&(_, probability))) => Some((other, probability)),
            _ => None,
        }
    }

    /// Places of an object, taken for contacts.
    fn sampled(&self, id: ObjectId) -> impl Iterator<Item = Contact> {
        let places = self.places(id);
        let step = places.len().div_ceil(CONTACTS_MAX).max(1);
        { places.iter().step_by(step) }.map(|place| place.contact().aimed())
    }

    /// What a visit's contacts say of the objects that they fit.
    pub(super) fn reflect(
        &mut self,
        posterior: &Posterior,
        orientation: &Orientation,
        contacts: &[Contact],
        when: (Clock, u64),
    ) -> Option<Insight> {
        if posterior.verdict() == Verdict::Undecided {
            let live = { posterior.objects.iter() }.filter(|(_, probability)| *probability > 0.01);
            let live: Vec<ObjectId> = live.map(|&(id, _)| id).take(COMPARED_MAX).collect();
            return self.unite(&live, orientation, when);
        }
        // What was mixed up may explain a visit so badly that it passes for something new.
        let &(id, _) = posterior.objects.first()?;
        self.doubt(id, orientation, contacts, when)
    }

    /// Makes one of the likeliest object and the first that is the same. An object that somebody
    /// has named stays what it was said to be.
    fn unite(
        &mut self,
        similar: &[ObjectId],
        orientation: &Orientation,
        when: (Clock, u64),
    ) -> Option<Insight> {
        let (&one, others) = similar.split_first()?;
        for &other in others {
            let (kept, absorbed) = match (self.get(one)?.is_named(), self.get(other)?.is_named()) {
                (true, true) => continue,
                (true, false) => (one, other),
                (false, true) => (other, one),
                (false, false) => (one.min(other), one.max(other)),
            };
            let pose = |part, whole| self.frame_pose(part, whole, similar, orientation);
            let pose = pose(absorbed, kept).or_else(|| Some(pose(kept, absorbed)?.inverse()));
            if let Some(pose) = pose {
                return self.merge(kept, absorbed, pose, when);
            }
        }
        None
    }

    /// Pose of one object's frame in that of another one, if what was learned of it is that one,
    /// and no other of those that are similar.
    fn frame_pose(
        &self,
        part: ObjectId,
        whole: ObjectId,
        similar: &[ObjectId],
        orientation: &Orientation,
    ) -> Option<FramePose> {
        let others = similar.iter().filter(|&&other| other != part);
        let others = self.library.select(others.map(|&other| (other, other)));
        let posterior = recognised(&others, orientation, self.sampled(part));
        if posterior.verdict() != Verdict::Object(whole) || posterior.fit < FIT_LEAST {
            return None;
        }
        match posterior.pose {
            Some(pose) if is_clear(&pose) => Some(FramePose::Unique(pose.map_from_episode)),
            Some(_) if *orientation == Orientation::Free => Some(FramePose::Ambiguous),
            _ => None,
        }
    }

    fn merge(
        &mut self,
        kept: ObjectId,
        absorbed: ObjectId,
        kept_from_absorbed: FramePose,
        (now, revision): (Clock, u64),
    ) -> Option<Insight> {
        let other = self.get(absorbed)?.clone();
        let added = self.library.get(absorbed)?.clone();
        self.remove(absorbed, revision);
        match kept_from_absorbed {
            FramePose::Unique(pose) => {
                let taught = (other.visits, other.contacts);
                self.extend(kept, &added, taught, &pose, (now, revision));
            }
            FramePose::Ambiguous => self.used(kept, now, revision),
        }
        Some(Insight::Merged {
            object: kept,
            absorbed: other.name,
        })
    }

    /// Settles or undoes what was joined to an object last, if a visit to it decides.
    fn doubt(
        &mut self,
        id: ObjectId,
        orientation: &Orientation,
        contacts: &[Contact],
        (now, revision): (Clock, u64),
    ) -> Option<Insight> {
        let joining = self.joinings.get(&id)?.clone();
        let mut parts = self.library.select([(id, TOGETHER)]);
        parts.put(BEFORE, joining.before.clone());
        parts.put(ADDED, joining.added.clone());
        let step = contacts.len().div_ceil(CONTACTS_MAX).max(1);
        // Which of them it is should not depend on how far a visit went.
        let aimed = { contacts.iter().step_by(step) }.map(|contact| contact.clone().aimed());
        let verdict = recognised(&parts, orientation, aimed).verdict();
        match verdict {
            Verdict::Object(TOGETHER) => {
                self.settle(id, revision);
                None
            }
            Verdict::Object(_) => {
                let known = self.get(id)?.clone();
                let (visits, contacts) = joining.taught;
                let mut left = KnownObject { revision, ..known };
                left.visits = left.visits.saturating_sub(visits);
                left.contacts = left.contacts.saturating_sub(contacts);
                self.put(id, left, joining.before, None, revision);
                let part = self.found(None, joining.added, contacts, now, revision)?;
                Some(Insight::Split { object: id, part })
            }
            Verdict::Undecided | Verdict::Unknown => None,
        }
    }
}

fn recognised(
    library: &ObjectLibrary,
    orientation: &Orientation,
    contacts: impl Iterator<Item = Contact>,
) -> Posterior {
    let mut recognition = Recognition::new(orientation);
    for contact in contacts {
        recognition.touch(library, contact);
    }
    recognition.posterior(library)
}
