//! Motions whose percepts are to be predicted.

use cogmap_proto::PredictQuery;
use cogmap_proto::limits::METRES_MAX;
use cognitive_map::{CognitiveMap, InvalidSample, Label, Motion};
use nalgebra::Vector3;

use super::channel::{InvalidChannel, check_channel};
use super::{fault, motion};

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
    #[error("it is not known where the agent stands in the map; its status says when it is")]
    NotPlaced,
}

/// What an agent would feel where: the question as the map takes it.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictionCue {
    /// How the agent would move.
    pub motion: Motion,
    /// Where it would feel, in its body frame \[m\].
    pub offset_m: Vector3<f64>,
    /// The channel that is asked for; all where there is none.
    pub channel: Option<Label>,
}

/// The motion, the offset and the channel of a query.
///
/// # Errors
/// Says which rule the query breaks.
pub fn prediction(
    map: &CognitiveMap,
    query: &PredictQuery,
) -> Result<PredictionCue, InvalidPrediction> {
    let motion = motion::motion(&query.motion)
        .map_err(|error| InvalidPrediction::Motion(fault::in_motion(&query.motion), error))?;
    // A comparison with NaN is false.
    if !query.offset_m.iter().all(|metre| metre.abs() <= METRES_MAX) {
        return Err(InvalidPrediction::Offset(query.offset_m));
    }
    if let Some(channel) = &query.channel {
        check_channel(map, channel)?;
    }
    let channel = query.channel.as_deref();
    Ok(PredictionCue {
        motion,
        offset_m: Vector3::from(query.offset_m),
        channel: channel.and_then(|name| Label::new(name).ok()),
    })
}
