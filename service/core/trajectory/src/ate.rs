//! The absolute trajectory error (ATE).

use nalgebra::Vector3;

use super::alignment::Alignment;
use super::trajectory::{GRID_STEP_NS, Span, Trajectory};

/// Fewest pairs to which a rigid motion is fitted; fewer always fit.
const PAIRS_TO_ALIGN_MIN: usize = 3;

/// Why an error cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AteError {
    /// No instant is covered by both trajectories.
    #[error("the trajectories have no instant in common")]
    NoPairs,
    /// Too few pairs to fit a motion.
    #[error("fewer than three pairs always align")]
    TooFewToAlign,
    /// Estimates and truths given by index differ in number.
    #[error("there are not as many estimates as truths")]
    UnequalLengths,
}

/// Errors of position over all pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AteSummary {
    /// Root of the mean square \[m\]: the figure called ATE.
    pub rmse_m: f64,
    /// Mean \[m\].
    pub mean_m: f64,
    /// Largest \[m\].
    pub max_m: f64,
    /// Number of pairs.
    pub n_pairs: usize,
    /// Instants that were asked for and that one of the trajectories does not cover. An estimate
    /// that stopped early is not scored after its end: a figure with many of them flatters.
    pub n_unmatched: u64,
}

/// Positions which belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pairs {
    estimate_m: Vec<Vector3<f64>>,
    truth_m: Vec<Vector3<f64>>,
    n_unmatched: u64,
}

impl Pairs {
    /// By index, for trajectories without time such as the nodes of a pose graph.
    ///
    /// # Errors
    /// The lengths differ.
    pub fn by_index(
        estimate_m: Vec<Vector3<f64>>,
        truth_m: Vec<Vector3<f64>>,
    ) -> Result<Self, AteError> {
        if estimate_m.len() != truth_m.len() {
            return Err(AteError::UnequalLengths);
        }
        Ok(Self {
            estimate_m,
            truth_m,
            n_unmatched: 0,
        })
    }

    /// On the 10 Hz grid `start + k · 0.1 s < end` over `span`, both interpolated linearly.
    pub fn on_grid(estimate: &Trajectory, truth: &Trajectory, span: Span) -> Self {
        let mut pairs = Self::default();
        let start = i128::from(span.start_ns);
        let step = i128::from(GRID_STEP_NS);
        let n_instants = (i128::from(span.end_ns) - start + step - 1)
            .div_euclid(step)
            .max(0);
        // Only the covered part of the grid is walked: a span may be much longer than the data.
        let first = i128::from(estimate.span().start_ns.max(truth.span().start_ns));
        let last = i128::from(estimate.span().end_ns.min(truth.span().end_ns));
        let k_first = (first - start + step - 1).div_euclid(step).max(0);
        let k_last = (last - start).div_euclid(step).min(n_instants - 1);
        for k in k_first..=k_last {
            // Every instant of the loop lies inside both spans, so none is left out.
            let Ok(instant) = i64::try_from(start + k * step) else {
                continue;
            };
            if let (Some(e), Some(g)) = (estimate.at(instant), truth.at(instant)) {
                pairs.estimate_m.push(e);
                pairs.truth_m.push(g);
            }
        }
        let n_instants = u64::try_from(n_instants).unwrap_or(u64::MAX);
        pairs.n_unmatched = n_instants - pairs.estimate_m.len() as u64;
        pairs
    }

    /// Each stamp of the shorter trajectory with the nearest one of the longer, if they differ by
    /// at most `max_diff_ns`; of two equally near ones the earlier. Nothing is interpolated.
    pub fn nearest(estimate: &Trajectory, truth: &Trajectory, max_diff_ns: u64) -> Self {
        let swapped = estimate.positions().len() > truth.positions().len();
        let (short, long) = if swapped {
            (truth, estimate)
        } else {
            (estimate, truth)
        };
        let mut pairs = Self::default();
        for position in short.positions() {
            let after = long
                .positions()
                .partition_point(|p| p.stamp_ns < position.stamp_ns);
            let nearest = long.positions()[after.saturating_sub(1)..]
                .iter()
                .take(2)
                .min_by_key(|p| p.stamp_ns.abs_diff(position.stamp_ns))
                .filter(|p| p.stamp_ns.abs_diff(position.stamp_ns) <= max_diff_ns);
            let Some(nearest) = nearest else {
                pairs.n_unmatched += 1;
                continue;
            };
            let (e, g) = if swapped {
                (nearest, position)
            } else {
                (position, nearest)
            };
            pairs.estimate_m.push(e.position_m);
            pairs.truth_m.push(g.position_m);
        }
        pairs
    }

    /// The errors after the best motion of the given kind.
    ///
    /// # Errors
    /// There is no pair, or there are fewer than three to align.
    pub fn errors(&self, alignment: Alignment) -> Result<AteSummary, AteError> {
        let n_pairs = self.estimate_m.len();
        if n_pairs == 0 {
            return Err(AteError::NoPairs);
        }
        if alignment != Alignment::None && n_pairs < PAIRS_TO_ALIGN_MIN {
            return Err(AteError::TooFewToAlign);
        }
        let motion = alignment.fit(&self.estimate_m, &self.truth_m);
        let (mut sum, mut sum_of_squares, mut max_m) = (0.0, 0.0, 0.0_f64);
        for (estimate, truth) in self.estimate_m.iter().zip(&self.truth_m) {
            let moved = motion.rotation * estimate + motion.translation.vector;
            let error = (moved - truth).norm();
            sum += error;
            sum_of_squares += error * error;
            max_m = max_m.max(error);
        }
        Ok(AteSummary {
            rmse_m: (sum_of_squares / n_pairs as f64).sqrt(),
            mean_m: sum / n_pairs as f64,
            max_m,
            n_pairs,
            n_unmatched: self.n_unmatched,
        })
    }
}

/// The RMSE \[m\] on the 10 Hz grid over `span`.
///
/// # Errors
/// There is no pair, or there are fewer than three to align.
pub fn ate_rmse_m(
    estimate: &Trajectory,
    truth: &Trajectory,
    span: Span,
    alignment: Alignment,
) -> Result<f64, AteError> {
    Ok(Pairs::on_grid(estimate, truth, span)
        .errors(alignment)?
        .rmse_m)
}

#[cfg(test)]
mod tests {
    use super::super::trajectory::StampedPosition;
    use super::*;

    fn trajectory(points: &[(i64, [f64; 3])]) -> Trajectory {
        Trajectory::new(
            points
                .iter()
                .map(|&(milliseconds, position)| StampedPosition {
                    stamp_ns: milliseconds * 1_000_000,
                    position_m: position.into(),
                }),
        )
        .unwrap()
    }

    #[test]
    fn a_growing_offset_has_its_closed_form() {
        // The error grows from 0 to 1 m over one second: 0, 0.1, ..., 0.9 on the grid.
        let truth = trajectory(&[(0, [0.0; 3]), (1000, [4.0, 0.0, 0.0])]);
        let estimate = trajectory(&[(0, [0.0; 3]), (1000, [4.0, 0.0, -1.0])]);
        let pairs = Pairs::on_grid(&estimate, &truth, truth.span());
        let errors = pairs.errors(Alignment::None).unwrap();
        assert_eq!((errors.n_pairs, errors.n_unmatched), (10, 0));
        assert!((errors.mean_m - 0.45).abs() < 1e-12);
        assert!((errors.rmse_m - 0.285_f64.sqrt()).abs() < 1e-12);
        assert!((errors.max_m - 0.9).abs() < 1e-12);
    }

    #[test]
    fn an_early_turn_costs_much_unaligned_and_nothing_aligned() {
        let corner = [
            (0, [0.0; 3]),
            (1000, [3.0, 0.0, 0.0]),
            (2000, [3.0, 5.0, 0.0]),
        ];
        let truth = trajectory(&corner);
        let turned = trajectory(&corner.map(|(t, [x, y, z])| (t, [1.0 - y, 2.0 + x, z])));
        let unaligned = ate_rmse_m(&turned, &truth, truth.span(), Alignment::None).unwrap();
        assert!(unaligned > 1.0);
        for alignment in [Alignment::Planar, Alignment::Spatial] {
            let aligned = ate_rmse_m(&turned, &truth, truth.span(), alignment).unwrap();
            assert!(aligned < 1e-12, "{alignment:?}: {aligned}");
        }
    }

    #[test]
    fn what_is_not_covered_is_counted() {
        let truth = trajectory(&[(0, [0.0; 3]), (1000, [1.0; 3])]);
        let estimate = trajectory(&[(250, [0.25; 3]), (600, [0.6; 3])]);
        let whole = Span {
            start_ns: i64::MIN,
            end_ns: i64::MAX,
        };
        let errors = Pairs::on_grid(&estimate, &truth, truth.span()).errors(Alignment::None);
        let errors = errors.unwrap();
        assert_eq!((errors.n_pairs, errors.n_unmatched), (4, 6)); // 0.3, 0.4, 0.5, 0.6 s
        assert!(errors.rmse_m < 1e-12);
        let errors = Pairs::on_grid(&estimate, &truth, whole)
            .errors(Alignment::None)
            .unwrap();
        assert_eq!(errors.n_unmatched + errors.n_pairs as u64, 184_467_440_738);
        let later = trajectory(&[(5000, [0.0; 3])]);
        assert_eq!(
            ate_rmse_m(&later, &truth, truth.span(), Alignment::None),
            Err(AteError::NoPairs)
        );
        let backwards = Span {
            start_ns: 5,
            end_ns: -5,
        };
        assert_eq!(
            ate_rmse_m(&truth, &truth, backwards, Alignment::None),
            Err(AteError::NoPairs)
        );
    }

    #[test]
    fn nearest_stamps_pair_within_the_tolerance() {
        let truth = trajectory(&[
            (0, [0.0; 3]),
            (10, [1.0; 3]),
            (20, [2.0; 3]),
            (30, [3.0; 3]),
        ]);
        let estimate = trajectory(&[(-4, [0.0; 3]), (15, [1.0; 3]), (99, [9.0; 3])]);
        for (a, b) in [(&estimate, &truth), (&truth, &estimate)] {
            let errors = Pairs::nearest(a, b, 5_000_000)
                .errors(Alignment::None)
                .unwrap();
            assert_eq!((errors.n_pairs, errors.n_unmatched), (2, 1));
            assert!(errors.max_m < 1e-15);
        }
    }

    #[test]
    fn two_pairs_are_too_few_to_align() {
        let pairs = Pairs::by_index(vec![Vector3::zeros(); 2], vec![Vector3::x(); 2]).unwrap();
        assert_eq!(
            pairs.errors(Alignment::Spatial),
            Err(AteError::TooFewToAlign)
        );
        assert!((pairs.errors(Alignment::None).unwrap().rmse_m - 1.0).abs() < 1e-15);
        assert_eq!(
            Pairs::by_index(vec![Vector3::zeros()], vec![]),
            Err(AteError::UnequalLengths)
        );
    }
}
