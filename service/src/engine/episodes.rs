//! The latest episode with an object of each agent that has ended. It is no part of the map, which
//! does nothing with it: like the events it is told by the map as it was then, and kept beside it.

use std::sync::Arc;

use cogmap_proto::EndedEpisode;

/// The latest ended episode of each agent, in the agents' order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct EndedEpisodes(pub(crate) Vec<Option<Arc<EndedEpisode>>>);

impl EndedEpisodes {
    /// Notes the latest ended episode of an agent, by its number; none where the agent is removed.
    pub(crate) fn put(&mut self, agent: u32, episode: Option<Arc<EndedEpisode>>) {
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

    /// Reads what [`EndedEpisodes::write`] wrote of at most so many agents; nothing where that is
    /// not what the bytes are, as those of older versions.
    pub(crate) fn read(bytes: &[u8], agents: usize) -> Self {
        let known: Vec<(u32, EndedEpisode)> = postcard::from_bytes(bytes).unwrap_or_default();
        let mut episodes = Self::default();
        for (agent, episode) in known {
            if (agent as usize) < agents {
                episodes.put(agent, Some(Arc::new(episode)));
            }
        }
        episodes
    }
}

#[cfg(test)]
mod tests {
    use cogmap_proto::EpisodeKind;

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
        episodes.put(2, Some(Arc::new(episode)));
        let bytes = episodes.write();
        assert_eq!(EndedEpisodes::read(&bytes, 3), episodes);
        assert_eq!(EndedEpisodes::read(&bytes, 2), EndedEpisodes::default());
        for len in 0..bytes.len() {
            let read = EndedEpisodes::read(&bytes[..len], 3);
            assert_eq!(read, EndedEpisodes::default());
        }
    }
}
