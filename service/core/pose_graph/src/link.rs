//! Links: measurements between nodes.

use nalgebra::{Isometry3, Point3, Vector3};

use super::information::{PoseInformation, PositionInformation};
use super::node::{PointId, PoseId};

/// A link in a pose graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LinkId(pub(super) u32);

/// One measurement with its information.
///
/// | link | residual r |
/// |---|---|
/// | `PosePrior` | log(Z⁻¹ T) |
/// | `PointPrior` | p − z |
/// | `Between` | log(Z⁻¹ T_from⁻¹ T_to) |
/// | `Sighting` | T_from⁻¹ p − z, with the target's position p = T_target l |
#[derive(Clone, Debug, PartialEq)]
pub enum Link {
    /// Where a pose is, in `map`.
    PosePrior {
        /// The pose.
        pose: PoseId,
        /// Where it was measured to be.
        at: Isometry3<f64>,
        /// Information in the axes of `at`.
        information: PoseInformation,
    },
    /// Where a point is, in `map`.
    PointPrior {
        /// The point.
        point: PointId,
        /// Where it was measured to be \[m\].
        at: Point3<f64>,
        /// Information in the axes of `map`.
        information: PositionInformation,
    },
    /// One pose as seen from another: motion, a loop closure, a landmark with an orientation.
    Between {
        /// The pose that measured.
        from: PoseId,
        /// The pose that was measured.
        to: PoseId,
        /// The second in the frame of the first.
        transform: Isometry3<f64>,
        /// Information in the axes of the second.
        information: PoseInformation,
    },
    /// A position as seen from a pose: range and bearing, or a position alone.
    Sighting {
        /// The pose that saw.
        from: PoseId,
        /// The target of the sighting.
        target: SightingTarget,
        /// The target in the frame of the pose \[m\].
        position: Vector3<f64>,
        /// Information in the axes of the pose.
        information: PositionInformation,
    },
}

/// Target of a sighting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SightingTarget {
    /// A landmark.
    Point(PointId),
    /// Another robot, of which the orientation was not seen.
    Pose(PoseId),
    /// A point that lies fixed in the frame of another pose \[m\]: where a robot was a little after
    /// it was there.
    PointOf(PoseId, Vector3<f64>),
}

impl SightingTarget {
    /// Where the target lies in the frame of its node \[m\].
    pub(super) fn lever(self) -> Vector3<f64> {
        match self {
            Self::Point(_) | Self::Pose(_) => Vector3::zeros(),
            Self::PointOf(_, lever) => lever,
        }
    }

    fn node(self) -> u32 {
        match self {
            Self::Point(PointId(node))
            | Self::Pose(PoseId(node))
            | Self::PointOf(PoseId(node), _) => node,
        }
    }
}

impl Link {
    /// The node that was measured, and before it the one that measured; twice the same if there is
    /// only one.
    pub(super) fn nodes(&self) -> (u32, u32) {
        match *self {
            Self::PosePrior {
                pose: PoseId(node), ..
            }
            | Self::PointPrior {
                point: PointId(node),
                ..
            } => (node, node),
            Self::Between { from, to, .. } => (from.0, to.0),
            Self::Sighting { from, target, .. } => (from.0, target.node()),
        }
    }
}
