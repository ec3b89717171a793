//! Nodes: poses, points and calibrations.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector6};

use super::calibration::{CALIBRATION_AXES, Calibration, PLANAR_CALIBRATION_AXES};
use geometry::{ALL_AXES, PLANAR_AXES, se3};

/// A pose in a pose graph: a place, an agent's keyframe, a landmark with an orientation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PoseId(pub(super) u32);

/// A point in a pose graph: a landmark of which only the position is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PointId(pub(super) u32);

/// The calibration of a robot's odometry over a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct CalibrationId(pub(super) u32);

impl PoseId {
    /// Its number among the nodes of its graph, counted from 0.
    pub fn number(self) -> u32 {
        self.0
    }
}

impl PointId {
    /// Its number among the nodes of its graph, counted from 0.
    pub fn number(self) -> u32 {
        self.0
    }
}

/// How a node may move when the graph is relaxed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// Not at all: surveyed, or the origin of the frame.
    Held,
    /// In the plane: along its own x and y and about its own z. A planar robot's nodes keep height,
    /// roll and pitch, and cost an eighth of free ones.
    Planar,
    /// Every way.
    Full,
}

/// What a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Pose,
    Point,
    Calibration,
}

/// Whether the lengths that odometry reads are calibrated with its rotations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lengths {
    /// Their error is as stated. Loop closures that say no more than that two poses are one leave
    /// the scale of a map open, and are the more probable the smaller it is.
    Known,
    /// Their error is estimated.
    Estimated,
}

/// Whether the veer of odometry is calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Veer {
    /// It is as stated.
    Known,
    /// It is estimated.
    Estimated,
}

/// A node with its place. A point is a pose that keeps the axes of `map`; a calibration is one as
/// [`Calibration::place`] says.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) pose: Isometry3<f64>,
    axes: &'static [usize],
    freedom: Freedom,
    kind: Kind,
}

impl Node {
    pub(super) fn pose(pose: Isometry3<f64>, freedom: Freedom) -> Self {
        let axes: &[usize] = match freedom {
            Freedom::Held => &[],
            Freedom::Planar => &PLANAR_AXES,
            Freedom::Full => &ALL_AXES,
        };
        Self {
            pose,
            axes,
            freedom,
            kind: Kind::Pose,
        }
    }

    pub(super) fn point(point: Point3<f64>, freedom: Freedom) -> Self {
        let axes: &[usize] = match freedom {
            Freedom::Held => &[],
            Freedom::Planar => &[0, 1],
            Freedom::Full => &[0, 1, 2],
        };
        let pose = Isometry3::from_parts(Translation3::from(point), UnitQuaternion::identity());
        Self {
            pose,
            axes,
            freedom,
            kind: Kind::Point,
        }
    }

    pub(super) fn calibration(
        calibration: &Calibration,
        freedom: Freedom,
        lengths: Lengths,
        veer: Veer,
    ) -> Self {
        let whole: &[usize] = match (freedom, veer) {
            (Freedom::Held, _) => &[],
            (Freedom::Planar, Veer::Known) => &[0, 1, 5],
            (Freedom::Planar, Veer::Estimated) => &PLANAR_CALIBRATION_AXES,
            (Freedom::Full, Veer::Known) => &[0, 1, 3, 4, 5],
            (Freedom::Full, Veer::Estimated) => &CALIBRATION_AXES,
        };
        let axes = match lengths {
            Lengths::Estimated => whole,
            Lengths::Known => whole.get(1..).unwrap_or_default(),
        };
        Self {
            pose: calibration.place(),
            axes,
            freedom,
            kind: Kind::Calibration,
        }
    }

    /// The components of a twist ξ = (ρ, φ) along which the node moves.
    pub(super) fn axes(&self) -> &'static [usize] {
        self.axes
    }

    pub(super) fn freedom(&self) -> Freedom {
        self.freedom
    }

    pub(super) fn is_pose(&self) -> bool {
        self.kind == Kind::Pose
    }

    pub(super) fn is_point(&self) -> bool {
        self.kind == Kind::Point
    }

    /// The unknowns in their places in a twist.
    pub(super) fn twist(&self, unknowns: &[f64]) -> Vector6<f64> {
        let mut twist = Vector6::zeros();
        for (&axis, unknown) in self.axes.iter().zip(unknowns) {
            twist[axis] = *unknown;
        }
        twist
    }

    /// The node's pose `from` after a motion by its unknowns: T exp(ξ), p + ρ for a point, and the
    /// sum for a calibration.
    pub(super) fn moved(&self, from: &Isometry3<f64>, unknowns: &[f64]) -> Isometry3<f64> {
        let twist = self.twist(unknowns);
        match self.kind {
            Kind::Pose => se3::plus(from, &twist),
            Kind::Point => {
                let (linear, _) = se3::split(&twist);
                let at = Translation3::from(from.translation.vector + linear);
                Isometry3::from_parts(at, from.rotation)
            }
            Kind::Calibration => {
                let components = Calibration::of_place(from).components() + twist;
                Calibration::of_components(&components).place()
            }
        }
    }
}
