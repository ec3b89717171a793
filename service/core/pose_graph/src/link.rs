//! Links: measurements between nodes.

use nalgebra::{Isometry3, Point3, Vector3, Vector6};

use super::calibration::{Calibration, Reading};
use super::information::{
    InvalidInformation, PoseInformation, PositionInformation, RangeInformation,
};
use super::node::{CalibrationId, PointId, PoseId};

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
/// | `Range` | \|p − T_from a\| − z, with the target's position p and the antenna a |
/// | `Odometry` | log(M(c)⁻¹ T_from⁻¹ T_to), with the motion M that the calibration c corrects the reading to |
/// | `CalibrationPrior` | c − z |
/// | `CalibrationWander` | c_to − c_from |
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
    /// A distance alone, as ultra-wideband radios measure it.
    Range {
        /// The pose that measured.
        from: PoseId,
        /// The antenna in the frame of that pose \[m\].
        antenna: Vector3<f64>,
        /// What it was measured to.
        target: SightingTarget,
        /// The distance from the antenna to the target \[m\].
        range_m: f64,
        /// Information about the distance.
        information: RangeInformation,
    },
    /// The motion from one pose to another, as odometry with unknown lasting errors read it.
    Odometry {
        /// The pose before.
        from: PoseId,
        /// The pose after.
        to: PoseId,
        /// The lasting errors.
        calibration: CalibrationId,
        /// The reading.
        reading: Reading,
        /// Information about the rest of the error, in the axes of the pose after.
        information: PoseInformation,
    },
    /// What is known of a calibration beforehand.
    CalibrationPrior {
        /// The calibration.
        calibration: CalibrationId,
        /// As it is expected.
        at: Calibration,
        /// Information about its components.
        information: CalibrationInformation,
    },
    /// By how much a calibration changes until a later one.
    CalibrationWander {
        /// The calibration before.
        from: CalibrationId,
        /// The calibration after.
        to: CalibrationId,
        /// Information about the change of its components.
        information: CalibrationInformation,
    },
}

/// Information about the components of a calibration, which are independent: the inverses of their
/// variances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationInformation(Vector6<f64>);

impl CalibrationInformation {
    /// Of the variances of the length, the angle, the veer and the bias \[1, 1, rad²/m², rad²/s²\].
    /// A component of which nothing is known has an infinite one.
    ///
    /// # Errors
    /// A variance is not positive.
    pub fn of_variances(
        length: f64,
        angle: f64,
        veer: f64,
        bias: &Vector3<f64>,
    ) -> Result<Self, InvalidInformation> {
        let variances = Vector6::new(length, angle, veer, bias.x, bias.y, bias.z);
        if variances.iter().any(|variance| variance.is_nan()) {
            return Err(InvalidInformation::NotFinite);
        }
        if variances
            .iter()
            .any(|variance| *variance < f64::MIN_POSITIVE)
        {
            return Err(InvalidInformation::Singular);
        }
        Ok(Self(variances.map(f64::recip)))
    }

    /// By the places of the components in a twist.
    pub(super) fn diagonal(&self) -> &Vector6<f64> {
        &self.0
    }
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
            }
            | Self::CalibrationPrior {
                calibration: CalibrationId(node),
                ..
            } => (node, node),
            Self::Between { from, to, .. } | Self::Odometry { from, to, .. } => (from.0, to.0),
            Self::Sighting { from, target, .. } | Self::Range { from, target, .. } => {
                (from.0, target.node())
            }
            Self::CalibrationWander { from, to, .. } => (from.0, to.0),
        }
    }

    /// Whether it is between nodes, and not a prior of one.
    pub(super) fn joins_two(&self) -> bool {
        match self {
            Self::PosePrior { .. } | Self::PointPrior { .. } | Self::CalibrationPrior { .. } => {
                false
            }
            Self::Between { .. }
            | Self::Sighting { .. }
            | Self::Range { .. }
            | Self::Odometry { .. }
            | Self::CalibrationWander { .. } => true,
        }
    }

    /// The node of the calibration, of a link that joins two poses by way of one.
    pub(super) fn calibration(&self) -> Option<u32> {
        match self {
            Self::Odometry { calibration, .. } => Some(calibration.0),
            _ => None,
        }
    }
}
