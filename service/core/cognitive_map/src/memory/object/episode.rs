//! An agent's episode with an object.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Unit, Vector3, Vector6};

use super::joined::is_clear;
use super::joining::Insight;
use super::memory::{Identified, ObjectMemory};
use crate::input::TouchNoise;
use crate::input::{Descriptor, LEVEL_MAX, Label, Level};
use crate::memory::strength::Clock;
use geometry::MotionSum;
use object_recognition::{
    Contact, DescriptorReading, LevelReading, ObjectId, ObjectModel, Orientation, Posterior,
    Recognition, Verdict,
};

/// Contacts by which an episode recognises; further ones only teach.
pub(super) const CONTACTS_MAX: usize = 128;
/// Most objects that one episode makes one of two, or two of one.
const REFLECTIONS_MAX: usize = 4;

/// What an episode is for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Purpose {
    /// To teach an object: of this name, or of whichever it is.
    Learn(Option<Label>),
    /// To recognise one, and to learn one that is unknown or not.
    Identify { learns: bool },
}

/// An agent's episode with an object.
#[derive(Clone, Debug)]
pub(crate) struct Episode {
    pub(super) purpose: Purpose,
    pub(super) orientation: Orientation,
    pub(super) noise: TouchNoise,
    /// Motion of the body since the episode began.
    pub(super) travel: MotionSum,
    /// What path integration has drifted until the latest contact, per axis \[m\].
    pub(super) drift_sd_m: f64,
    /// The first contacts, up to [`CONTACTS_MAX`].
    pub(super) contacts: Vec<Contact>,
    /// All contacts, learned in the episode's frame.
    pub(super) model: ObjectModel,
    pub(super) count: u64,
    /// What was said last: how many objects are live, and the verdict.
    pub(super) live: u32,
    pub(super) verdict: Verdict,
    /// What the contacts say, and as of which change of the memory. Follows from the rest.
    pub(super) recognition: Option<(u64, Arc<Recognition>)>,
}

/// What an episode brought about.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum News {
    /// Fewer objects come into question.
    Narrowed {
        /// How many.
        live: u32,
    },
    /// It is this one.
    Recognised {
        /// The object.
        object: ObjectId,
        /// How probable that is.
        probability: f64,
    },
    /// It is none that was learned.
    Unknown,
    /// Two objects are one, or one is two.
    Insight(Insight),
    /// An object was learned, or more of it.
    Learned {
        /// The object.
        object: ObjectId,
    },
    /// An episode that was to teach has taught nothing: it did not become clear how its frame lies
    /// in the object's.
    NotLearned,
}

impl Episode {
    /// An episode that teaches.
    pub(crate) fn learn(
        name: Option<Label>,
        spacing: ObjectModel,
        orientation: Orientation,
        noise: TouchNoise,
    ) -> Self {
        Self::new(Purpose::Learn(name), spacing, orientation, noise)
    }

    /// An episode that is to recognise. `model` is empty, and what it is learned as if it is
    /// unknown.
    pub(crate) fn identify(
        model: ObjectModel,
        orientation: Orientation,
        noise: TouchNoise,
    ) -> Self {
        Self::new(
            Purpose::Identify { learns: true },
            model,
            orientation,
            noise,
        )
    }

    /// The same, with this said of whether it learns an object that is unknown.
    #[must_use]
    pub(crate) fn learning(self, learns: bool) -> Self {
        let purpose = match self.purpose {
            Purpose::Identify { .. } => Purpose::Identify { learns },
            Purpose::Learn(name) => Purpose::Learn(name),
        };
        Self { purpose, ..self }
    }

    fn new(
        purpose: Purpose,
        model: ObjectModel,
        orientation: Orientation,
        noise: TouchNoise,
    ) -> Self {
        Self {
            purpose,
            orientation,
            noise,
            travel: MotionSum::default(),
            drift_sd_m: 0.0,
            contacts: Vec::new(),
            model,
            count: 0,
            live: u32::MAX,
            verdict: Verdict::Undecided,
            recognition: None,
        }
    }

    /// Whether it teaches.
    pub(crate) fn teaches(&self) -> bool {
        matches!(self.purpose, Purpose::Learn(_))
    }

    /// Contacts so far.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// The first contacts, by which it recognises, in its own frame.
    pub(crate) fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// The body moved, with noise of these variances.
    pub(crate) fn go(&mut self, increment: &Isometry3<f64>, variance: &Vector6<f64>) {
        self.travel.append(increment, variance);
    }

    /// A level was sensed.
    pub(crate) fn level(&mut self, level: &Level, memory: &mut ObjectMemory) -> Vec<News> {
        let at = self.travel.motion() * Point3::from(*level.offset_m());
        let mut contact = self.contact(at);
        if let Some(normal) = level.normal() {
            let normal: Vector3<f64> = self.travel.motion().rotation * normal.into_inner();
            contact = contact.with_normal(Unit::new_normalize(normal), self.noise.normal_sd_rad());
        }
        if level.value().abs() <= LEVEL_MAX
            && let Some(channel) = memory.open_channel(level.channel())
        {
            contact.levels.push(LevelReading {
                channel,
                value: level.value(),
                sd: self.noise.level_sd(),
            });
        }
        self.take(contact, memory)
    }

    /// A descriptor was seen.
    pub(crate) fn descriptor(
        &mut self,
        descriptor: &Descriptor,
        memory: &mut ObjectMemory,
    ) -> Vec<News> {
        let mut contact = self.contact(self.travel.motion().translation.vector.into());
        if let Some(channel) = memory.open_channel(descriptor.channel()) {
            contact.descriptors.push(DescriptorReading {
                channel,
                vector: Arc::from(descriptor.vector()),
            });
        }
        self.take(contact, memory)
    }

    /// The episode ends. Answers what it brought about, and what its contacts said before anything
    /// was learned from it, if that was asked.
    pub(crate) fn end(
        &mut self,
        memory: &mut ObjectMemory,
        (now, revision): (Clock, u64),
    ) -> (Vec<News>, Option<Posterior>) {
        if self.count == 0 {
            let is_named = matches!(self.purpose, Purpose::Learn(Some(_)));
            return (Vec::new(), (!is_named).then(|| self.posterior(memory)));
        }
        let (mut news, mut said) = self.reflect(memory, (now, revision));
        let learned = match &self.purpose {
            Purpose::Learn(Some(name)) => match memory.by_name(name) {
                None => self.name_or_find(name, memory, (now, revision)),
                Some(id) => memory
                    .align(id, &self.orientation, &self.contacts)
                    .map(|pose| self.extend(id, &pose, memory, (now, revision))),
            },
            Purpose::Learn(None) => {
                let posterior = said.insert(self.posterior(memory));
                match (posterior.verdict(), &posterior.pose) {
                    (Verdict::Object(id), Some(pose)) => (pose.object == id && is_clear(pose))
                        .then(|| self.extend(id, &pose.map_from_episode, memory, (now, revision))),
                    (Verdict::Unknown, _) => self.found(None, memory, (now, revision)),
                    _ if memory.library().is_empty() => self.found(None, memory, (now, revision)),
                    _ => None,
                }
            }
            Purpose::Identify { learns } => match self.verdict {
                Verdict::Object(id) => {
                    memory.used(id, now, revision);
                    None
                }
                Verdict::Unknown if *learns => self.found(None, memory, (now, revision)),
                Verdict::Unknown | Verdict::Undecided => None,
            },
        };
        match learned {
            Some(object) => news.push(News::Learned { object }),
            None if self.teaches() => news.push(News::NotLearned),
            None => {}
        }
        (news, said)
    }

    /// What all contacts say of the objects that are known by now, in their own light; and what an
    /// episode that is to recognise says after that.
    fn reflect(
        &mut self,
        memory: &mut ObjectMemory,
        when: (Clock, u64),
    ) -> (Vec<News>, Option<Posterior>) {
        let mut news = Vec::new();
        // Each turn makes one object of two, or two of one that was in doubt.
        for _ in 0..REFLECTIONS_MAX {
            if memory.is_settled() {
                break;
            }
            let posterior = self.posterior(memory);
            let insight = memory.reflect(&posterior, &self.orientation, &self.contacts, when);
            let Some(insight) = insight else {
                break;
            };
            news.push(News::Insight(insight));
        }
        if !matches!(self.purpose, Purpose::Identify { .. }) {
            return (news, None);
        }
        let posterior = self.posterior(memory);
        news.extend(self.heed(&posterior));
        (news, Some(posterior))
    }

    /// What all contacts say now.
    fn posterior(&mut self, memory: &ObjectMemory) -> Posterior {
        let recognition = self.recognise(memory);
        let posterior = recognition.posterior(memory.library());
        self.recognition = Some((memory.changed(), recognition));
        posterior
    }

    /// What its contacts say now, with what would tell more.
    pub(crate) fn identified(&self, memory: &ObjectMemory) -> Identified {
        let fresh = self.clone().recognise(memory);
        memory.identified(&fresh, &self.orientation, &self.contacts)
    }

    /// Learns an object of a new name: one that was learned on the spot, if it is that, or a new
    /// one.
    fn name_or_find(
        &self,
        name: &Label,
        memory: &mut ObjectMemory,
        when: (Clock, u64),
    ) -> Option<ObjectId> {
        if !memory.are_all_named()
            && let Some((id, pose)) = memory.visited(&self.orientation, &self.contacts)
            && memory.get(id).is_some_and(|known| !known.is_named())
        {
            self.extend(id, &pose, memory, when);
            memory.rename(id, name, when.1);
            return Some(id);
        }
        self.found(Some(name.clone()), memory, when)
    }

    fn found(
        &self,
        name: Option<Label>,
        memory: &mut ObjectMemory,
        (now, revision): (Clock, u64),
    ) -> Option<ObjectId> {
        memory.found(name, self.model.clone(), self.count, now, revision)
    }

    fn extend(
        &self,
        id: ObjectId,
        pose: &Isometry3<f64>,
        memory: &mut ObjectMemory,
        when: (Clock, u64),
    ) -> ObjectId {
        memory.extend(id, &self.model, (1, self.count), pose, when);
        id
    }

    fn contact(&mut self, at: Point3<f64>) -> Contact {
        let covariance = self.travel.covariance();
        let drift_sd_m = covariance.position_sd_m() / 3.0_f64.sqrt();
        self.drift_sd_m = self.drift_sd_m.max(drift_sd_m);
        Contact::at(at, self.noise.position_sd_m()).with_drift(self.drift_sd_m)
    }

    /// Takes in a contact; says what it changed.
    fn take(&mut self, contact: Contact, memory: &ObjectMemory) -> Vec<News> {
        self.count += 1;
        self.model.learn(&contact);
        if self.contacts.len() >= CONTACTS_MAX {
            return Vec::new();
        }
        // Whoever teaches an object knows which it is.
        if matches!(self.purpose, Purpose::Learn(_)) {
            self.contacts.push(contact);
            return Vec::new();
        }
        let mut recognition = self.recognise(memory);
        Arc::make_mut(&mut recognition).touch(memory.library(), contact.clone());
        self.contacts.push(contact);
        let posterior = recognition.posterior(memory.library());
        self.recognition = Some((memory.changed(), recognition));
        self.heed(&posterior)
    }

    /// Says what the contacts say now, if it is something else than before.
    fn heed(&mut self, posterior: &Posterior) -> Vec<News> {
        let mut news = Vec::new();
        let live = u32::try_from(posterior.live_objects).unwrap_or(u32::MAX);
        if live < self.live {
            self.live = live;
            news.push(News::Narrowed { live });
        }
        let verdict = posterior.verdict();
        if verdict != self.verdict {
            self.verdict = verdict;
            match (verdict, posterior.objects.first()) {
                (Verdict::Object(object), Some(&(_, probability))) => {
                    news.push(News::Recognised {
                        object,
                        probability,
                    });
                }
                (Verdict::Unknown, _) => news.push(News::Unknown),
                _ => {}
            }
        }
        news
    }

    /// What the contacts so far say. After a change of the memory all of them are judged anew, so
    /// that a restored episode goes on like one that was never stored.
    fn recognise(&mut self, memory: &ObjectMemory) -> Arc<Recognition> {
        match self.recognition.take() {
            Some((changed, recognition)) if changed == memory.changed() => recognition,
            _ => {
                let mut recognition = Recognition::new(&self.orientation);
                for contact in &self.contacts {
                    recognition.touch(memory.library(), contact.clone());
                }
                Arc::new(recognition)
            }
        }
    }
}
