//! How far estimates are from the truth.

use cogmap::decode::stamped_pose;
use cogmap_lab::coverage::Coverage;
use cogmap_lab::nees::Nees;
use cogmap_proto::StampedPose as Row;
use nalgebra::Vector3;
use trajectory::{Alignment, Pairs, Span, StampedPose, Trajectory};

use super::outcome::RobotOutcome;
use super::team::Known;

/// Which moments of an estimate are compared with the truth.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pairing {
    /// Those of a grid of 10 Hz over a span.
    Grid(Span),
    /// Its own, the truth being interpolated. Heights in a plane are left out where the estimate is
    /// aligned.
    Own,
}

/// How estimates are scored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scoring {
    pub(super) pairing: Pairing,
    /// How they are laid on the truth.
    pub(super) alignment: Alignment,
    /// Whether stamps are times and the truth is one: otherwise there is no speed and no NEES.
    pub(super) is_recorded: bool,
}

impl Scoring {
    /// RMSE of position, plain and aligned \[m\]; none without a moment to compare.
    pub(super) fn errors_m(
        &self,
        poses: &[StampedPose],
        truth: Option<&Trajectory>,
    ) -> [Option<f64>; 2] {
        let (Some(truth), Ok(estimate)) = (truth, Trajectory::from_poses(poses)) else {
            return [None; 2];
        };
        [Alignment::None, self.alignment].map(|alignment| {
            let pairs = match self.pairing {
                Pairing::Grid(span) => Pairs::on_grid(&estimate, truth, span),
                Pairing::Own => own(&estimate, truth, alignment == Alignment::Planar)?,
            };
            Some(pairs.errors(alignment).ok()?.rmse_m)
        })
    }

    /// The same of rows.
    pub(super) fn errors_of_rows_m(
        &self,
        rows: &[Row],
        truth: Option<&Trajectory>,
    ) -> [Option<f64>; 2] {
        let poses: Vec<StampedPose> = rows.iter().map(stamped_pose).collect();
        self.errors_m(&poses, truth)
    }

    /// Errors against their covariances, of the poses that were believed.
    pub(super) fn nees(&self, came_out: &RobotOutcome, known: &Known) -> Nees {
        let mut nees = Nees::default();
        let Some(truth) = known.truth.as_ref().filter(|_| self.is_recorded) else {
            return nees;
        };
        for (belief, covariance) in &came_out.beliefs {
            let believed = stamped_pose(belief).pose;
            if let Some(pose) = known.true_pose(belief.stamp_ns) {
                nees.add(&pose, &believed, covariance);
            } else if let Some(truth_m) = truth.at(belief.stamp_ns) {
                nees.add_position(&truth_m, &believed, covariance);
            }
        }
        nees
    }

    /// How many of the poses that were believed lie within the ellipses of their covariances.
    pub(super) fn coverage(&self, came_out: &RobotOutcome, known: &Known) -> Coverage {
        let mut coverage = Coverage::default();
        let Some(truth) = known.truth.as_ref().filter(|_| self.is_recorded) else {
            return coverage;
        };
        for (belief, covariance) in &came_out.beliefs {
            if let Some(truth_m) = truth.at(belief.stamp_ns) {
                coverage.add(&truth_m, &stamped_pose(belief).pose, covariance);
            }
        }
        coverage
    }
}

/// Each position of the estimate with the truth at its moment; before the truth begins and after it
/// ends, with its ends.
fn own(estimate: &Trajectory, truth: &Trajectory, is_flat: bool) -> Option<Pairs> {
    let span = truth.span();
    let flat = |at: Vector3<f64>| {
        if is_flat {
            Vector3::new(at.x, at.y, 0.0)
        } else {
            at
        }
    };
    let pairs = estimate.positions().iter().filter_map(|row| {
        let there = truth.at(row.stamp_ns.clamp(span.start_ns, span.end_ns))?;
        Some((flat(row.position_m), flat(there)))
    });
    let (estimate, truth): (Vec<_>, Vec<_>) = pairs.unzip();
    Pairs::by_index(estimate, truth).ok()
}
