//! What is done with how many objects.

use object_recognition::ANSWER_PROBABILITY;

use crate::eval::object::Rotate;
use crate::objects::ExplorationNoise;

/// Most objects: what a gigabyte holds.
const OBJECTS_MAX: u32 = 10_000;

/// The third experiment: objects are learned by exploring them, and recognised by exploring them
/// again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectProtocol {
    /// Number of objects.
    pub objects: u32,
    /// Noise, while learning too.
    pub noise: ExplorationNoise,
    /// Which turns the objects may have made since.
    pub rotate: Rotate,
    /// Whether contacts tell the surface's normal.
    pub normals: Normals,
    /// Explorations of learned objects, which take turns. A quarter as many are of objects that
    /// were never learned.
    pub trials: u32,
    /// Most touches of an exploration.
    pub touches_max: usize,
    /// An answer is given as soon as its probability is this high; [`ANSWER_PROBABILITY`] is the
    /// service's.
    pub sure: f64,
    /// Most touches of each object while learning.
    pub learning_touches: usize,
    /// Seed of objects, explorations and noise.
    pub seed: u64,
}

/// Whether contacts tell the surface's normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normals {
    /// Only place and level, as in the paper.
    Untold,
    /// The normal too.
    Told,
}

/// An option that makes no sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidObjectProtocol {
    /// The number of objects.
    #[error("the number of objects must be from 1 to {OBJECTS_MAX}")]
    Objects,
    /// Noise.
    #[error("noise must be from 0 to 10, and is a share of the range or of a move")]
    Noise,
    /// The number of explorations or touches.
    #[error("explorations and touches must be at least 1")]
    Trials,
    /// The certainty.
    #[error("the probability of an answer must be above one half and below 1")]
    Sure,
}

impl ObjectProtocol {
    /// As the paper has it, with 10 % of value noise: one thousand explorations, the objects as
    /// they were learned.
    pub fn of_paper(objects: u32) -> Self {
        Self {
            objects,
            noise: ExplorationNoise {
                value: 0.1,
                motion: 0.0,
            },
            rotate: Rotate::None,
            normals: Normals::Untold,
            trials: 1000,
            touches_max: 200,
            sure: ANSWER_PROBABILITY,
            learning_touches: 10_000,
            seed: 1,
        }
    }

    /// # Errors
    /// Names the first option that makes no sense.
    pub fn check(&self) -> Result<(), InvalidObjectProtocol> {
        if !(1..=OBJECTS_MAX).contains(&self.objects) {
            return Err(InvalidObjectProtocol::Objects);
        }
        let noises = [self.noise.value, self.noise.motion];
        if !noises.iter().all(|noise| (0.0..=10.0).contains(noise)) {
            return Err(InvalidObjectProtocol::Noise);
        }
        if self.trials == 0 || self.touches_max == 0 || self.learning_touches == 0 {
            return Err(InvalidObjectProtocol::Trials);
        }
        if !(self.sure > 0.5 && self.sure < 1.0) {
            return Err(InvalidObjectProtocol::Sure);
        }
        Ok(())
    }

    /// Accuracy \[%\], mean steps to convergence and their deviation, as the paper states them for
    /// so many objects (Table 2).
    pub fn paper(objects: u32) -> Option<(f64, f64, f64)> {
        match objects {
            2 => Some((98.2, 180.0, 25.0)),
            3 => Some((94.6, 260.0, 40.0)),
            4 => Some((91.3, 340.0, 55.0)),
            _ => None,
        }
    }
}
