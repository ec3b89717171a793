//! Spaces.

use cogmap_proto as wire;
use cognitive_map::CognitiveMap;

/// A space as the wire has it.
pub fn space_info(
    name: &str,
    settings: &wire::SpaceSettings,
    map: &CognitiveMap,
) -> wire::SpaceInfo {
    wire::SpaceInfo {
        name: name.to_owned(),
        settings: settings.clone(),
        map_revision: map.revision(),
        digest: map.digest().to_string(),
        agents: map.agent_count() as u64,
        places: map.place_count() as u64,
        trips: map.trip_count() as u64,
        landmarks: map.landmark_count() as u64,
    }
}
