//! Places that are recalled.

use cogmap_proto as wire;
use cognitive_map::{CognitiveMap, Recalled, Rivals};

use super::{FRAME, place};

/// The places that answer a cue, best first, and those that look like the best one.
pub fn recall(
    space: &str,
    map: &CognitiveMap,
    recalled: Vec<Recalled>,
    rivals: Option<&Rivals>,
) -> wire::RecallAnswer {
    let rivals = rivals.map(|rivals| wire::Rivals {
        count: rivals.count as u64,
        place: rivals.place.0.into(),
        cosine: rivals.cosine,
        distance_m: rivals.distance_m,
    });
    let places = recalled.into_iter().filter_map(|recalled| {
        Some(wire::RecalledPlace {
            place: place(map, recalled.place, map.place(recalled.place)?),
            cosine: recalled.cosine,
            confidence: recalled.confidence,
            distance_m: recalled.distance_m,
            percept_match: recalled.percept_match,
        })
    });
    wire::RecallAnswer {
        space: space.to_owned(),
        frame: FRAME.to_owned(),
        map_revision: map.revision(),
        places: places.collect(),
        rivals,
    }
}
