//! Contacts with objects: episodes that teach or identify them.

use super::CognitiveMap;
use super::apply::Fold;
use crate::event::EventKind;
use crate::input::AgentId;
use crate::input::Label;
use crate::input::{ObjectMark, Spacing, Touch};
use crate::memory::object::{
    Episode, Identified, IndexingJob, Insight, KnownObject, News, ObjectMemory,
};
use object_recognition::{Contact, Density, ModelPlace, ObjectId, ObjectModel, Orientation};

impl Fold<'_> {
    /// An episode with an object begins or ends. One that is under way ends in any case.
    pub(super) fn object_mark(&mut self, mark: &ObjectMark) {
        self.end_episode();
        self.agent.episode = match mark {
            ObjectMark::End => None,
            ObjectMark::Learn {
                name,
                spacing,
                orientation,
                noise,
            } => {
                let (name, orientation) = (name.clone(), orientation.clone());
                Some(Episode::learn(name, spacing.model(), orientation, *noise))
            }
            ObjectMark::Identify {
                orientation,
                noise,
                learns,
            } => {
                let model = Spacing::default().model();
                let learns = *learns && self.settings.learns_unknown_objects;
                let episode = Episode::identify(model, orientation.clone(), *noise);
                Some(episode.learning(learns))
            }
        };
    }

    /// Something was sensed, in an episode if one is under way.
    pub(super) fn touch(
        &mut self,
        extend: impl FnOnce(&mut Episode, &mut ObjectMemory) -> Vec<News>,
    ) {
        if let Some(episode) = &mut self.agent.episode {
            let news = extend(episode, self.objects);
            let contacts = episode.count();
            self.emit_object_news(news, contacts);
        }
    }

    /// Ends the episode under way, if any.
    pub(super) fn end_episode(&mut self) {
        let Some(mut episode) = self.agent.episode.take() else {
            return;
        };
        let (news, said) = episode.end(self.objects, (self.now, self.revision));
        self.emit_object_news(news, episode.count());
        self.emit(EventKind::EpisodeEnded {
            session: self.agent.session(),
            teaches: episode.teaches(),
            posterior: said.map(Box::new),
        });
    }

    fn emit_object_news(&mut self, news: Vec<News>, contacts: u64) {
        for news in news {
            let name =
                |object: ObjectId| self.objects.get(object).map(|known| known.name().clone());
            let kind = match news {
                News::Narrowed { live } => Some(EventKind::ObjectsNarrowed { live }),
                News::Recognised {
                    object,
                    probability,
                } => name(object).map(|name| EventKind::ObjectRecognised {
                    object,
                    name,
                    probability,
                }),
                News::Unknown => Some(EventKind::ObjectUnknown),
                News::Learned { object } => name(object).map(|name| EventKind::ObjectLearned {
                    object,
                    name,
                    contacts,
                }),
                News::Insight(Insight::Merged { object, absorbed }) => {
                    name(object).map(|name| EventKind::ObjectsMerged {
                        object,
                        name,
                        absorbed,
                    })
                }
                News::Insight(Insight::Split { object, part }) => {
                    let names = name(object).zip(name(part));
                    names.map(|(name, part_name)| EventKind::ObjectSplit {
                        object,
                        name,
                        part,
                        part_name,
                    })
                }
                News::NotLearned => Some(EventKind::ObjectNotLearned { contacts }),
            };
            if let Some(kind) = kind {
                self.emit(kind);
            }
        }
    }
}

impl CognitiveMap {
    /// The objects, in the order in which they were met: what is known of each, and its places.
    pub fn objects(&self) -> impl Iterator<Item = (ObjectId, &KnownObject, &ObjectModel)> {
        self.objects.iter()
    }

    /// Lessons and wishes to forget so far: the number of the next one.
    pub fn lessons(&self) -> u64 {
        self.objects.lessons()
    }

    /// What is to be computed before objects are recognised that were learned or restored. None
    /// without objects, and if they have not changed after a revision.
    pub fn indexing(&self, after: Option<u64>) -> Option<IndexingJob> {
        self.objects.indexing(after)
    }

    /// Number of objects.
    pub fn object_count(&self) -> usize {
        self.objects.library().len()
    }

    /// What is known of an object.
    pub fn object(&self, object: ObjectId) -> Option<&KnownObject> {
        self.objects.get(object)
    }

    /// The object of a name.
    pub fn object_by_name(&self, name: &Label) -> Option<ObjectId> {
        self.objects.by_name(name)
    }

    /// The places of an object, in its own frame.
    pub fn object_places(&self, object: ObjectId) -> &[ModelPlace] {
        self.objects.places(object)
    }

    /// Name of a channel on which objects are sensed.
    pub fn object_channel(&self, channel: u16) -> Option<&Label> {
        self.objects.channel_name(channel)
    }

    /// Which object explains a sequence of contacts, in which pose, and which touch would tell
    /// most. Levels and descriptors of channels on which no object was sensed do not count.
    pub fn identify(&self, orientation: &Orientation, touches: &[Touch]) -> Identified {
        self.objects.identify(orientation, touches)
    }

    /// How densely an object was felt.
    pub fn object_density(&self, object: ObjectId) -> Option<Density> {
        self.objects.library().density(object)
    }

    /// The object that one looks like, turned about the vertical or not, and how probable it is
    /// that a hand which feels the one takes it for the other.
    pub fn object_alike(&self, object: ObjectId) -> Option<(ObjectId, f64)> {
        self.objects.alike(object)
    }

    /// The first contacts of an agent's episode, by which it recognises: in the frame of the body
    /// when it began. None where no episode is under way.
    pub fn episode_contacts(&self, agent: AgentId) -> &[Contact] {
        let episode = self.agent(agent).and_then(|agent| agent.episode.as_ref());
        episode.map(Episode::contacts).unwrap_or_default()
    }

    /// What an agent's episode says so far, if one is under way: whether it teaches, and what is
    /// recognised.
    pub fn episode(&self, agent: AgentId) -> Option<(bool, Identified)> {
        let episode = self.agent(agent)?.episode.as_ref()?;
        Some((episode.teaches(), episode.identified(&self.objects)))
    }
}
