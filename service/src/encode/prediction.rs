//! What an agent would feel, and what places remember.

use cogmap_proto as wire;
use cognitive_map::{CognitiveMap, Expected, PlaceId, Predicted, Prediction, Remembered};

use super::FRAME;

/// What an agent would feel, and where it would be.
pub fn prediction(
    space: &str,
    map: &CognitiveMap,
    agent: &str,
    prediction: Prediction,
) -> wire::PredictAnswer {
    let percepts = prediction.percepts.into_iter();
    wire::PredictAnswer {
        space: space.to_owned(),
        agent: agent.to_owned(),
        frame: FRAME.to_owned(),
        map_revision: map.revision(),
        translation_m: prediction.pose.translation.vector.into(),
        rotation_xyzw: prediction.pose.rotation.coords.into(),
        place: prediction.place.map(|(place, _)| place.0.into()),
        confidence: prediction.place.map_or(0.0, |(_, confidence)| confidence),
        percepts: percepts
            .filter_map(|predicted| percept(map, predicted))
            .collect(),
    }
}

fn percept(map: &CognitiveMap, predicted: Predicted) -> Option<wire::PredictedPercept> {
    let place = predicted.remembered.place.0.into();
    let remembered = remembered(map, predicted.remembered)?;
    Some(wire::PredictedPercept {
        channel: remembered.channel,
        expected: remembered.expected,
        place,
        confidence: predicted.confidence,
        percepts: remembered.percepts,
        strength: remembered.strength,
    })
}

/// What a place remembers.
pub fn place_percepts(space: &str, map: &CognitiveMap, place: PlaceId) -> wire::PlacePercepts {
    wire::PlacePercepts {
        space: space.to_owned(),
        place: place.0.into(),
        map_revision: map.revision(),
        percepts: { map.remembered(place) }
            .filter_map(|one| remembered(map, one))
            .collect(),
    }
}

fn remembered(map: &CognitiveMap, of: Remembered) -> Option<wire::RememberedPercept> {
    let channel = map.channel(of.channel)?;
    let expected = match of.expected {
        Expected::Level { mean, sd } => wire::ExpectedPercept::Level { mean, sd },
        Expected::Descriptor(direction) => wire::ExpectedPercept::Descriptor {
            vector: direction.into_vec(),
        },
    };
    Some(wire::RememberedPercept {
        channel: channel.label().as_str().to_owned(),
        expected,
        percepts: of.percepts,
        strength: of.strength,
    })
}
