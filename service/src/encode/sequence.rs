//! What a sequence recalls.

use cogmap_proto as wire;
use cognitive_map::{CognitiveMap, SequenceRecall};

use super::place::agent_name;

/// What comes next, and the trips that the sequence looks like.
pub fn sequence(
    space: &str,
    map: &CognitiveMap,
    recalled: &SequenceRecall,
) -> wire::SequenceAnswer {
    let next = recalled.next.iter().map(|next| wire::NextPlace {
        place: next.place.0.into(),
        probability: next.probability,
    });
    let trips = recalled.trips.iter().filter_map(|found| {
        Some(wire::SequenceTrip {
            trip: found.trip.0.into(),
            agent: agent_name(map, map.trip(found.trip)?.agent()),
            probability: found.probability,
            leg: found.leg.into(),
        })
    });
    wire::SequenceAnswer {
        space: space.to_owned(),
        map_revision: map.revision(),
        next: next.collect(),
        others: recalled.others,
        none: recalled.none,
        trips: trips.collect(),
    }
}
