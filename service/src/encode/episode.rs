//! Episodes with objects that have ended.

use std::sync::Arc;

use cogmap_proto::{EndedEpisode, EpisodeKind};
use cognitive_map::{CognitiveMap, Event, EventKind, Identified};
use object_recognition::Explanation;

use super::identification;

/// The latest ended episode of an agent, if there is one.
pub(crate) struct LatestEpisode(pub(crate) Option<Arc<EndedEpisode>>);

/// What an event makes of its agent's latest ended episode, if anything.
pub(crate) fn ended_episode(
    space: &str,
    map: &CognitiveMap,
    event: &Event,
) -> Option<LatestEpisode> {
    match &event.kind {
        EventKind::EpisodeEnded {
            session,
            teaches,
            posterior,
        } => {
            let identified = posterior.as_deref().map(|posterior| Identified {
                posterior: posterior.clone(),
                next_touch: None,
                explanation: Explanation::default(),
            });
            let ended = EndedEpisode {
                episode: EpisodeKind::of(*teaches),
                session: *session,
                stamp_ns: event.stamp_ns,
                identification: identified.map(|said| identification(space, map, &said)),
            };
            Some(LatestEpisode(Some(Arc::new(ended))))
        }
        EventKind::AgentRemoved { .. } => Some(LatestEpisode(None)),
        _ => None,
    }
}
