//! What an agent would feel.

use cogmap_proto as wire;
use cognitive_map::{CognitiveMap, Expected, Predicted, Prediction};

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
    let Predicted {
        remembered,
        confidence,
    } = predicted;
    let channel = map.channel(remembered.channel)?;
    let expected = match remembered.expected {
        Expected::Level { mean, sd } => wire::ExpectedPercept::Level { mean, sd },
        Expected::Descriptor(direction) => wire::ExpectedPercept::Descriptor {
            vector: direction.into_vec(),
        },
    };
    Some(wire::PredictedPercept {
        channel: channel.label().as_str().to_owned(),
        expected,
        place: remembered.place.0.into(),
        confidence,
        percepts: remembered.percepts,
        strength: remembered.strength,
    })
}
