//! Sequences: which trips the last places look like, and what comes next on them.

mod alignment;
mod evidence;
mod window;

pub(crate) use alignment::align;
pub(crate) use evidence::Evidence;

use crate::memory::ids::{PlaceId, TripId};
use crate::memory::percept::PerceptCue;

/// The last places of somebody, or what was sensed there, oldest first.
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceCue {
    /// One for each place.
    pub elements: Vec<SequenceElement>,
    /// How many of them are wrong, in (0, 1).
    pub error_rate: f64,
    /// Probability, before anything is compared, that nobody travelled such a sequence, in (0, 1).
    pub none_prior: f64,
    /// Most places and most trips of the answer.
    pub limit: usize,
}

/// One element of a sequence.
#[derive(Clone, Debug, PartialEq)]
pub enum SequenceElement {
    /// A place, which may have been forgotten.
    Place(PlaceId),
    /// What was sensed at one.
    Percept(PerceptCue),
}

/// What a sequence recalls. The probabilities of the places, `others` and `none` add up to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceRecall {
    /// What comes next, the likeliest first, equally likely places by number.
    pub next: Vec<NextPlace>,
    /// Probability of further places, beyond the limit.
    pub others: f64,
    /// Probability that nothing of what was travelled comes next: nobody travelled such a sequence,
    /// it cannot be told where on the trips it is, or a trip ended there.
    pub none: f64,
    /// The trips that it looks like, the likeliest first, equally likely ones by number.
    pub trips: Vec<SequenceMatch>,
}

/// A place that may come next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextPlace {
    /// The place, which may have been forgotten.
    pub place: PlaceId,
    /// Its probability.
    pub probability: f64,
}

/// A trip that a sequence looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SequenceMatch {
    /// The trip.
    pub trip: TripId,
    /// Probability that the sequence is on this trip.
    pub probability: f64,
    /// Where on it most likely: the number of the leg that comes next, counted from 0; as many as
    /// it has legs where it ended there.
    pub leg: u32,
}
