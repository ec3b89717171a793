//! Sequences: which trips the last places look like, and what comes next.

use serde::{Deserialize, Serialize};

use crate::query::PerceptCue;

/// Asks what comes next after the last places of somebody, by the trips that they look like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct SequenceQuery {
    /// The last places, or what was sensed at each, oldest first; 1 to 64.
    pub cue: Vec<SequenceElement>,
    /// How many of them are wrong, 0.001 to 0.5; 0.1 when absent.
    #[serde(default)]
    pub error_rate: Option<f64>,
    /// How likely nobody has travelled such a sequence, before it is compared with anything, 0.001
    /// to 0.999; 0.05 when absent.
    #[serde(default)]
    pub none_prior: Option<f64>,
    /// Most places and most trips in the answer, 1 to 1000; 10 when absent.
    #[serde(default)]
    pub limit: Option<u32>,
}

/// One element of a sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum SequenceElement {
    /// A place, which may have been forgotten.
    Place(u64),
    /// What was sensed at one.
    Percept(PerceptCue),
}

/// Answer to a [`SequenceQuery`]. The probabilities of the places, `others` and `none` add up to 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct SequenceAnswer {
    /// Space.
    pub space: String,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// What comes next, the likeliest first, equally likely places by number.
    pub next: Vec<NextPlace>,
    /// Probability of further places, beyond the limit.
    pub others: f64,
    /// Probability that nothing of what was travelled comes next: nobody travelled such a sequence,
    /// it cannot be told where on the trips it is, or a trip ended there.
    pub none: f64,
    /// The trips that it looks like, the likeliest first, equally likely ones by number.
    pub trips: Vec<SequenceTrip>,
}

/// A place that may come next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct NextPlace {
    /// The place, which may have been forgotten.
    pub place: u64,
    /// Its probability.
    pub probability: f64,
}

/// A trip that a sequence looks like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct SequenceTrip {
    /// The trip.
    pub trip: u64,
    /// The agent that travelled it.
    pub agent: String,
    /// Probability that the sequence is on this trip.
    pub probability: f64,
    /// Where on it most likely: the number of the leg that comes next, counted from 0; as many as
    /// it has legs where it ended there.
    pub leg: u64,
}
