//! What the estimate makes of a sample.

use nalgebra::{Isometry3, Vector3, Vector6};

use super::calibration::Calibrated;
use super::standing::MeasuredBias;

/// What became of an agent's sightings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Sightings taken in.
    pub accepted: u64,
    /// Sightings refused.
    pub refused: u64,
    /// Of those, how many one after the other up to now, without those of unconfirmed landmarks;
    /// some, too, when they have put the agent elsewhere.
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
    /// Variances of the increment's noise along and about the body axes at its end \[m², rad²\].
    /// The lasting errors of odometry come on top.
    pub variance: Vector6<f64>,
    /// Variances of the rotation's noise as the settings assume them \[rad²\], of odometry that
    /// states none.
    pub(super) assumed_turn: Option<Vector3<f64>>,
    /// How the increment was corrected.
    pub calibrated: Calibrated,
    /// What the odometry read of its bias while the body stood before.
    pub(super) measured_bias: Option<MeasuredBias>,
}

impl Step {
    /// Whether the odometry is corrected otherwise from the next motion on, for what it read while
    /// the body stood.
    pub(crate) fn ends_stand(&self) -> bool {
        self.measured_bias.is_some()
    }

    /// Of an agent that is not known.
    pub(super) fn none() -> Self {
        Self {
            displacement: Vector3::zeros(),
            increment: Isometry3::identity(),
            variance: Vector6::zeros(),
            assumed_turn: None,
            calibrated: Calibrated::default(),
            measured_bias: None,
        }
    }
}

/// What became of a sighting of a landmark; of an agent that is not known, nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LandmarkOutcome {
    /// Whether the landmark is new in the agent's frame.
    pub is_new: bool,
    /// Whether the sighting was accepted. That of a new landmark is.
    pub accepted: bool,
}
