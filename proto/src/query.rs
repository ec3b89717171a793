//! Bodies of queries, the same over HTTP and Zenoh.

use serde::{Deserialize, Serialize};

use crate::percept::{Descriptor, Level};

/// Queries that a space answers on `cogmap/{space}/query/{verb}`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verb {
    /// [`RecallQuery`] → [`crate::RecallAnswer`].
    Recall,
    /// [`WatermarkQuery`] → [`crate::Watermark`].
    Watermark,
    /// [`crate::PredictQuery`] → [`crate::PredictAnswer`].
    Predict,
    /// [`crate::IdentifyQuery`] → [`crate::Identification`].
    Identify,
    /// [`crate::LocalizeQuery`] → [`crate::Localization`].
    Localize,
    /// [`crate::RouteQuery`] → [`crate::RouteAnswer`].
    Route,
    /// [`crate::SequenceQuery`] → [`crate::SequenceAnswer`].
    Sequence,
    /// [`crate::FeltQuery`] → [`crate::FeltAnswer`].
    Felt,
}

impl Verb {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Recall,
        Self::Watermark,
        Self::Predict,
        Self::Identify,
        Self::Localize,
        Self::Route,
        Self::Sequence,
        Self::Felt,
    ];

    /// Last chunk of the key.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Recall => "recall",
            Self::Watermark => "watermark",
            Self::Predict => "predict",
            Self::Identify => "identify",
            Self::Localize => "localize",
            Self::Route => "route",
            Self::Sequence => "sequence",
            Self::Felt => "felt",
        }
    }
}

/// Asks for the watermark of an agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct WatermarkQuery {
    /// The agent.
    pub agent: String,
}

/// Asks for places. `position_m`, `code` and `percept` are cues, alone or together, and rank them;
/// the other fields filter. Without a cue the latest places come first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields, default)]
pub struct RecallQuery {
    /// Cue: a position in `map` \[m\].
    pub position_m: Option<[f64; 3]>,
    /// Cue: a grid code, one entry per module: phase `[0, 1)³` or null for an erased module.
    pub code: Option<Vec<Option<[f64; 3]>>>,
    /// Only places within this distance of `position_m` \[m\].
    pub radius_m: Option<f64>,
    /// Only places that this agent founded.
    pub agent: Option<String>,
    /// Only places visited at or after this stamp \[ns\].
    pub since_ns: Option<i64>,
    /// Only places founded before this stamp \[ns\].
    pub until_ns: Option<i64>,
    /// Most places in the answer, 1 to 1000; 10 when absent.
    pub limit: Option<u32>,
    /// Cue: a percept. Only places that remember something of its channel answer.
    pub percept: Option<PerceptCue>,
}

/// A percept to recall places by, as in a sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum PerceptCue {
    /// A level; its `offset_m` and `normal` say nothing here.
    Level(Level),
    /// A descriptor.
    Descriptor(Descriptor),
}
