//! Prediction: from the question to the motion, and from what is expected to the answer.

use cogmap_proto as wire;
use cogmap_proto::PredictQuery;
use cogmap_proto::limits::METRES_MAX;
use cognitive_map::{AgentId, CognitiveMap, Expected, InvalidSample, Label, Predicted};
use nalgebra::Vector3;

use super::FRAME;
use super::channel::{InvalidChannel, check_channel};
use crate::decode::{self, fault};

/// Why nothing can be predicted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidPrediction {
    /// The motion makes no sense.
    #[error("{0}: {1}")]
    Motion(String, InvalidSample),
    /// A coordinate of `offset_m` is not a number or is too large.
    #[error("offset_m must hold finite numbers of at most {METRES_MAX} m, not {0:?}")]
    Offset([f64; 3]),
    /// The channel cannot be asked for.
    #[error("channel: {0}")]
    Channel(#[from] InvalidChannel),
    /// There is no agent in the query.
    #[error("agent must name an agent")]
    NoAgent,
    /// The agent in the body is not that of the path.
    #[error("agent is {0:?}, which is another one than in the path")]
    OtherAgent(String),
    /// Nobody knows where the agent is.
    #[error("the agent is lost: it is not known where it stands in the map")]
    NotPlaced,
}

/// What an agent would feel if it moved so.
///
/// # Errors
/// Says which rule the query breaks, or that the agent is not placed.
pub fn predict(
    space: &str,
    map: &CognitiveMap,
    agent: AgentId,
    query: &PredictQuery,
) -> Result<wire::PredictAnswer, InvalidPrediction> {
    let motion = decode::motion(&query.motion)
        .map_err(|error| InvalidPrediction::Motion(fault::in_motion(&query.motion), error))?;
    // A comparison with NaN is false.
    if !query.offset_m.iter().all(|metre| metre.abs() <= METRES_MAX) {
        return Err(InvalidPrediction::Offset(query.offset_m));
    }
    let offset_m = Vector3::from(query.offset_m);
    if let Some(channel) = &query.channel {
        check_channel(map, channel)?;
    }
    let channel = query
        .channel
        .as_deref()
        .and_then(|name| Label::new(name).ok());
    let prediction = map
        .predict(agent, &motion, &offset_m, channel.as_ref())
        .ok_or(InvalidPrediction::NotPlaced)?;
    let name = map.agent(agent).ok_or(InvalidPrediction::NotPlaced)?.name();
    let percepts = prediction.percepts.into_iter();
    Ok(wire::PredictAnswer {
        space: space.to_owned(),
        agent: name.as_str().to_owned(),
        frame: FRAME.to_owned(),
        map_revision: map.revision(),
        translation_m: prediction.pose.translation.vector.into(),
        rotation_xyzw: prediction.pose.rotation.coords.into(),
        place: prediction.place.map(|(place, _)| place.0.into()),
        confidence: prediction.place.map_or(0.0, |(_, confidence)| confidence),
        percepts: percepts
            .filter_map(|predicted| percept(map, predicted))
            .collect(),
    })
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
