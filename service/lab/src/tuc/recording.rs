//! A data set as the robot recorded it.

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Matrix3, Matrix6};
use pose_graph::{Freedom, Kernel, PoseInformation, Scale};

use super::data_set::{Match, Tuc};
use crate::mapping::{Matches, Measured, Recording, Step};

/// How far apart two samples of one place are taken, along each axis \[m\] …
const POSITION_SD_M: f64 = 0.5;
/// … and in heading \[rad\].
const HEADING_SD_RAD: f64 = 0.2;
/// Scale of the kernel by which matches are doubted \[standard deviations\].
const DOUBT_SCALE: f64 = 3.0;

impl Tuc {
    /// The set with these matches, which need not be its own: a pose at every step of odometry, the
    /// first where the robot was, and each match with the later of its moments. A match says that
    /// two poses are one, to within what recognition of a place is good for. A moment is put at the
    /// step next to it.
    pub fn recording(&self, matches: &[Match]) -> Recording {
        let mut variances = Matrix6::zeros();
        for (axis, sd) in [(0, POSITION_SD_M), (1, POSITION_SD_M), (5, HEADING_SD_RAD)] {
            variances[(axis, axis)] = sd * sd;
        }
        let same_place = planar_information(&variances);
        let mut steps: Vec<Step> = Vec::with_capacity(self.steps().len());
        for (index, odometry) in self.steps().iter().enumerate() {
            let mut measured = Vec::new();
            if index > 0 {
                let covariance =
                    PoseCovariance::zero().after_motion(&odometry.motion, &odometry.noise_sd);
                measured.push(Measured::Relative {
                    from: index - 1,
                    to: index,
                    transform: odometry.motion,
                    information: planar_information(covariance.matrix()),
                    is_motion: true,
                });
            }
            steps.push(Step {
                stamp_ns: odometry.stamp_ns,
                guess: *self.start(),
                is_held: index == 0,
                measured,
            });
        }
        for found in matches {
            let (from, to) = (self.step_at(found.earlier_ns), self.step_at(found.later_ns));
            // Two moments next to the same step are one pose, and say nothing.
            if from != to {
                steps[to].measured.push(Measured::Relative {
                    from,
                    to,
                    transform: Isometry3::identity(),
                    information: same_place,
                    is_motion: false,
                });
            }
        }
        Recording {
            freedom: Freedom::Planar,
            steps,
            landmarks: Vec::new(),
            matches: Matches::Recognised(doubt()),
        }
    }
}

/// The kernel by which matches are doubted.
fn doubt() -> Kernel {
    Kernel::GemanMcClure(Scale::new(DOUBT_SCALE).expect("a positive constant"))
}

/// The inverse of the planar part of a covariance, and nothing about the other directions.
fn planar_information(covariance: &Matrix6<f64>) -> PoseInformation {
    let axes = [0, 1, 5];
    // A robot said to move without any error still has a micrometre and a microradian of it.
    let planar =
        Matrix3::from_fn(|r, c| covariance[(axes[r], axes[c])]) + Matrix3::identity() * 1e-12;
    let inverse = planar
        .cholesky()
        .expect("the diagonal is above zero")
        .inverse();
    let mut matrix = Matrix6::zeros();
    for (r, &row) in axes.iter().enumerate() {
        for (c, &column) in axes.iter().enumerate() {
            matrix[(row, column)] = 0.5 * (inverse[(r, c)] + inverse[(c, r)]);
        }
    }
    PoseInformation::new(&matrix).expect("an inverse of a positive matrix is positive")
}
