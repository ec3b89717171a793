//! Places.

use cogmap_proto as wire;
use cognitive_map::{AgentId, CognitiveMap, Place, PlaceId};

/// A place as the wire has it.
pub fn place(map: &CognitiveMap, id: PlaceId, place: &Place) -> wire::Place {
    let code = place.code(map.modules());
    wire::Place {
        id: id.0.into(),
        translation_m: place.position().coords.into(),
        rotation_xyzw: place.rotation().coords.into(),
        position_sd_m: (*place.position_sd_m()).into(),
        code: code
            .phases()
            .iter()
            .map(|phase| (*phase.turns()).into())
            .collect(),
        visits: place.visits(),
        founder: agent_name(map, place.founder()),
        first_stamp_ns: place.first_stamp_ns(),
        last_stamp_ns: place.last_stamp_ns(),
        strength: map.place_strength(id),
    }
}

/// Name of an agent that the map refers to.
pub(super) fn agent_name(map: &CognitiveMap, agent: AgentId) -> String {
    let agent = map
        .agent(agent)
        .expect("a map refers to its own agents only");
    agent.name().as_str().to_owned()
}
