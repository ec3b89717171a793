//! What the estimate makes of a sample.

use nalgebra::{Isometry3, Vector3, Vector6};

use super::calibration::Calibrated;
use crate::input::Relation;

/// What became of an agent's sightings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Sightings taken in.
    pub accepted: u64,
    /// Sightings refused.
    pub refused: u64,
    /// Of those, how many one after the other, up to now.
    pub refused_in_a_row: u32,
    /// Sum of the normalised innovations squared of those taken in. It has the mean of `components`
    /// where the stated noise is honest.
    pub nis: f64,
    /// Number of their components.
    pub components: u64,
}

/// A motion as the estimate takes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Displacement along the axes of the agent's frame \[m\].
    pub displacement: Vector3<f64>,
    /// What odometry read, corrected by what it is known to get wrong all the time.
    pub increment: Isometry3<f64>,
    /// Variances of the increment's noise along and about the body axes at its end \[m², rad²\]. The
    /// lasting errors of odometry come on top.
    pub variance: Vector6<f64>,
    /// How the increment was corrected.
    pub calibrated: Calibrated,
}

impl Step {
    /// Of an agent that is not known.
    pub(super) fn none() -> Self {
        Self {
            displacement: Vector3::zeros(),
            increment: Isometry3::identity(),
            variance: Vector6::zeros(),
            calibrated: Calibrated::default(),
        }
    }
}

/// What became of a sighting of a landmark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandmarkOutcome {
    /// Whether the landmark is new in the agent's frame.
    pub is_new: bool,
    /// Whether the sighting counts. That of a new landmark does.
    pub accepted: bool,
    /// Variances of its components: distance, azimuth and elevation \[m², rad²\], or three lengths
    /// \[m²\]. They hold what the agent's sensor was learned to get wrong, and not the loss of weight of
    /// an outlying component.
    pub variance: Vector3<f64>,
}

impl LandmarkOutcome {
    /// Of an agent that is not known.
    pub(super) fn nothing() -> Self {
        Self {
            is_new: false,
            accepted: false,
            variance: Vector3::zeros(),
        }
    }
}

/// What became of a sighting of an agent, as soon as both were in one frame and had moved up to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// Who saw.
    pub observer: u32,
    /// Whom.
    pub target: u32,
    /// When \[ns\].
    pub stamp_ns: i64,
    /// Where.
    pub relation: Relation,
    /// Whether it counts.
    pub accepted: bool,
    /// Variances of its components as in [`LandmarkOutcome`]; of a pose all six, of a point the first three.
    pub variance: Vector6<f64>,
}

/// A frame was laid into another one.
#[derive(Clone, Debug, PartialEq)]
pub struct Merged {
    /// Number of the frame, which has nobody in it from now on.
    pub frame: usize,
    /// Number of the frame that it was laid into; the map's is 0.
    pub into: usize,
    /// Pose of the former in the latter, before the landmarks known in both corrected everything.
    pub pose: Isometry3<f64>,
    /// The agents that came over, by their numbers.
    pub agents: Vec<u32>,
}
