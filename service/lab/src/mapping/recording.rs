//! What one robot measured, in the order in which it arrived.

use nalgebra::{Isometry3, Point3, Vector3};
use pose_graph::{Freedom, Kernel, PoseInformation, PositionInformation};

/// A recording. Poses are numbered as their steps, landmarks by themselves.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// How poses and landmarks may move.
    pub freedom: Freedom,
    /// The poses, each with what was measured from or of it.
    pub steps: Vec<Step>,
    /// What is known of the landmarks beforehand.
    pub landmarks: Vec<Landmark>,
    /// What a match is.
    pub matches: Matches,
}

/// The arrival of one pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// When \[ns\].
    pub stamp_ns: i64,
    /// Where the pose begins if no measurement ties it to an earlier one.
    pub guess: Isometry3<f64>,
    /// Whether it stays there.
    pub is_held: bool,
    /// What can be said as soon as this pose is there: none of it names a later pose.
    pub measured: Vec<Measured>,
}

/// A landmark before it was seen.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Landmark {
    /// Where it is, if it is surveyed.
    pub held_at: Option<Point3<f64>>,
}

/// One measurement.
#[derive(Clone, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "nearly all measurements are of the large kind"
)]
pub enum Measured {
    /// One pose as seen from another.
    Relative {
        /// The pose that measured.
        from: usize,
        /// The pose that was measured.
        to: usize,
        /// The second in the frame of the first.
        transform: Isometry3<f64>,
        /// Information in the axes of the second.
        information: PoseInformation,
        /// Whether it is the robot's own motion, which is believed; a match is judged.
        is_motion: bool,
    },
    /// A landmark as seen from a pose.
    Sighting {
        /// The pose that saw.
        from: usize,
        /// The landmark.
        landmark: usize,
        /// Its position in the frame of the pose \[m\].
        position: Vector3<f64>,
        /// Information in the axes of the pose.
        information: PositionInformation,
    },
}

/// What the recording's matches are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Matches {
    /// Measurements with Gaussian errors, as their information says. They hold unless they are far
    /// from what is expected.
    Measurements,
    /// Recognised places, of which many may be false: they are doubted by this kernel from
    /// beginning to end.
    Recognised(Kernel),
}

impl Recording {
    /// Number of measurements.
    pub fn n_measured(&self) -> usize {
        self.steps.iter().map(|step| step.measured.len()).sum()
    }
}
