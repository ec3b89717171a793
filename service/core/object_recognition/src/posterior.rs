//! The posterior of an episode.

use geometry::PoseCovariance;
use nalgebra::Isometry3;

use crate::object_id::ObjectId;

/// Answer of an episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// More contacts are needed.
    Undecided,
    /// It is this one.
    Object(ObjectId),
    /// It is none of the library.
    Unknown,
}

/// Pose of the episode's frame in a model.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseEstimate {
    /// Object.
    pub object: ObjectId,
    /// The most likely pose.
    pub map_from_episode: Isometry3<f64>,
    /// Its covariance, of an error on its right (in the episode's axes).
    pub covariance: PoseCovariance,
    /// Share of the object's evidence that this pose holds.
    pub share: f64,
    /// Further poses in the same model with their shares: for symmetric objects, the symmetric
    /// ones.
    pub others: Vec<(Isometry3<f64>, f64)>,
}

/// Posterior over objects and poses.
#[derive(Clone, Debug, PartialEq)]
pub struct Posterior {
    /// Probability of each object, most probable first; equal ones by number.
    pub objects: Vec<(ObjectId, f64)>,
    /// Probability of an unknown object.
    pub unknown: f64,
    /// Pose in the most probable object.
    pub pose: Option<PoseEstimate>,
    /// Number of hypotheses (object, pose) that hold 99 % of all mass.
    pub live_hypotheses: usize,
    /// Number of objects with a probability above 1 %.
    pub live_objects: usize,
    /// Entropy over objects and unknown \[nats\].
    pub entropy_nats: f64,
    /// Contacts so far.
    pub contacts: usize,
    /// Goodness of fit of the best hypothesis, as a z-score: about 0 for a learned object, far
    /// below −3 for others. 0 where the orientation is not free.
    pub fit: f64,
    /// Probability from which on an answer is given.
    pub answer_probability: f64,
}

impl Posterior {
    /// The answer, once one is as probable as the library asks for.
    pub fn verdict(&self) -> Verdict {
        let least = self.answer_probability;
        match self.objects.first() {
            _ if self.unknown >= least => Verdict::Unknown,
            Some((object, probability)) if *probability >= least => Verdict::Object(*object),
            _ => Verdict::Undecided,
        }
    }
}

/// Shannon entropy of probabilities \[nats\].
pub(crate) fn entropy_nats(probabilities: impl Iterator<Item = f64>) -> f64 {
    let logs = probabilities.filter(|p| *p > 0.0).map(|p| p * p.ln());
    // Certainty is 0, not -0.
    0.0 - logs.sum::<f64>()
}
