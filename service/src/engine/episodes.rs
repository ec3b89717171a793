//! The latest episode with an object of each agent that has ended. It is no part of the map, which does
//! nothing with it: like the events it is told by the map as it was then, and kept beside it.

use std::sync::Arc;

use cogmap_proto::{EndedEpisode, EpisodeKind};
use cognitive_map::{AgentId, CognitiveMap, Event, EventKind, Identified};

use crate::answer;

/// The latest ended episode of each agent, in the agents' order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct EndedEpisodes(pub(crate) Vec<Option<Arc<EndedEpisode>>>);

/// The latest ended episode of an agent, if there is one.
pub(crate) struct Latest(pub(crate) Option<Arc<EndedEpisode>>);

/// What an event makes of its agent's latest ended episode, if anything.
pub(crate) fn change(space: &str, map: &CognitiveMap, event: &Event) -> Option<Latest> {
    match &event.kind {
        EventKind::EpisodeEnded {
            session,
            teaches,
            posterior,
        } => {
            let said = posterior.as_deref().map(|posterior| {
                let said = Identified {
                    posterior: posterior.clone(),
                    next_touch: None,
                };
                answer::identification(space, map, &said)
            });
            let ended = EndedEpisode {
                episode: EpisodeKind::of(*teaches),
                session: *session,
                stamp_ns: event.stamp_ns,
                identification: said,
            };
            Some(Latest(Some(Arc::new(ended))))
        }
        EventKind::AgentRemoved { .. } => Some(Latest(None)),
        _ => None,
    }
}

impl EndedEpisodes {
    /// Notes what the latest record of a map has brought about.
    pub(crate) fn note(&mut self, space: &str, map: &CognitiveMap, events: &[Event]) {
        for event in events {
            if let Some(Latest(episode)) = change(space, map, event) {
                self.put(event.agent, episode);
            }
        }
    }

    fn put(&mut self, AgentId(agent): AgentId, episode: Option<Arc<EndedEpisode>>) {
        let index = agent as usize;
        if self.0.len() <= index {
            self.0.resize(index + 1, None);
        }
        self.0[index] = episode;
    }

    /// Their bytes, for a checkpoint.
    pub(crate) fn write(&self) -> Vec<u8> {
        let known = (0_u32..).zip(&self.0);
        let known: Vec<(u32, &EndedEpisode)> = known
            .filter_map(|(agent, episode)| Some((agent, episode.as_deref()?)))
            .collect();
        postcard::to_stdvec(&known).expect("plain data encodes")
    }

    /// Reads what [`EndedEpisodes::write`] wrote of at most so many agents; nothing where that is not what
    /// the bytes are, as those of older versions.
    pub(crate) fn read(bytes: &[u8], agents: usize) -> Self {
        let known: Vec<(u32, EndedEpisode)> = postcard::from_bytes(bytes).unwrap_or_default();
        let mut episodes = Self::default();
        for (agent, episode) in known {
            if (agent as usize) < agents {
                episodes.put(AgentId(agent), Some(Arc::new(episode)));
            }
        }
        episodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn episodes_are_read_as_they_were_written_and_other_bytes_are_none() {
        let episode = EndedEpisode {
            episode: EpisodeKind::Learn,
            session: 7,
            stamp_ns: -3,
            identification: None,
        };
        let mut episodes = EndedEpisodes::default();
        episodes.put(AgentId(2), Some(Arc::new(episode)));
        let bytes = episodes.write();
        assert_eq!(EndedEpisodes::read(&bytes, 3), episodes);
        assert_eq!(EndedEpisodes::read(&bytes, 2), EndedEpisodes::default());
        for len in 0..bytes.len() {
            let read = EndedEpisodes::read(&bytes[..len], 3);
            assert_eq!(read, EndedEpisodes::default());
        }
    }
}
