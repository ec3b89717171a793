//! What an episode says so far.

use nalgebra::Isometry3;

use super::library::ObjectId;
use geometry::PoseCovariance;

/// Least probability at which an answer is given: one in two hundred such answers may be wrong.
pub const SURE: f64 = 0.995;

/// Answer of an episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// More contacts are needed.
    Undecided,
    /// It is this one.
    Object(ObjectId),
    /// It is none that was learned.
    Unknown,
}

/// Where the episode's frame lies in a map.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseEstimate {
    /// Map.
    pub object: ObjectId,
    /// The most likely pose.
    pub map_from_episode: Isometry3<f64>,
    /// Its covariance, of an error on its right (in the episode's axes).
    pub covariance: PoseCovariance,
    /// Share of the object's evidence that this pose holds.
    pub share: f64,
    /// Other poses in the same map that hold a share: for something symmetric, the symmetric ones.
    pub others: Vec<(Isometry3<f64>, f64)>,
}

/// What an episode says so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Posterior {
    /// Probability of each object, most probable first; equal ones by number.
    pub objects: Vec<(ObjectId, f64)>,
    /// Probability that it is none of them.
    pub unknown: f64,
    /// Pose in the most probable object.
    pub pose: Option<PoseEstimate>,
    /// How many hypotheses (map, pose) together hold 99 % of the mass of all.
    pub live_hypotheses: usize,
    /// How many objects hold more than one hundredth of the probability each.
    pub live_objects: usize,
    /// Entropy over objects and unknown \[nats\].
    pub entropy_nats: f64,
    /// Contacts so far.
    pub contacts: usize,
    /// How far the best hypothesis explains the contacts below what a right one does, in standard
    /// deviations; about 0 for what was learned, and far below −3 for what was not.
    pub fit: f64,
}

impl Posterior {
    /// The answer, once one is at least 99.5 % probable.
    pub fn verdict(&self) -> Verdict {
        match self.objects.first() {
            _ if self.unknown >= SURE => Verdict::Unknown,
            Some((object, probability)) if *probability >= SURE => Verdict::Object(*object),
            _ => Verdict::Undecided,
        }
    }
}

/// Most probable first, and the rest.
pub(super) fn entropy_nats(probabilities: impl Iterator<Item = f64>) -> f64 {
    -probabilities
        .filter(|p| *p > 0.0)
        .map(|p| p * p.ln())
        .sum::<f64>()
}
