//! The relative pose of two stretches, from ranges between their views.

use geometry::se3::twist;
use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};

use super::sequence_match::SequenceMatch;
use crate::appearance::Prior;
use crate::levenberg_marquardt::NormalEquations;
use crate::tuning::ranges as tuning;

/// The expected pose.
struct PosePrior {
    pose: Isometry3<f64>,
    /// Inverse variances \[m⁻², rad⁻²\].
    information: Vector6<f64>,
}

/// A range between a point of the present stretch and one of the earlier stretch.
pub(crate) struct Range {
    pub(crate) now: Vector3<f64>,
    pub(crate) then: Point3<f64>,
    pub(crate) mean_m: f64,
    pub(crate) sd_m: f64,
}

/// A minimum.
struct Solution {
    pose: Isometry3<f64>,
    cost: f64,
    /// Cost of the ranges alone.
    ranges_cost: f64,
}

/// The poses of the earlier frame in the present one that explain the ranges of a sequence match
/// about as well as the best one, which comes first. `expected` is the pose by the map, with its
/// standard deviations \[m, rad\]. Empty if the ranges contradict one another or the map.
pub(crate) fn align_roughly(
    matched: &SequenceMatch,
    expected: &Isometry3<f64>,
    spread: [f64; 2],
) -> Vec<Isometry3<f64>> {
    let (now, then) = (
        matched.now.in_odom.inverse(),
        matched.then.in_odom.inverse(),
    );
    let ranges: Vec<Range> = matched
        .pairs
        .iter()
        .map(|pair| Range {
            now: (now * pair.now).coords,
            then: then * pair.then,
            mean_m: pair.mean_m,
            sd_m: pair.sd_m,
        })
        .collect();
    let mean_m = ranges.iter().map(|range| range.mean_m).sum::<f64>() / ranges.len() as f64;
    let prior = PosePrior {
        pose: *expected,
        information: Prior::inverse_variances(spread),
    };
    let mut solutions = solutions(&ranges, &prior, mean_m);
    solutions.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let Some(best) = solutions.first() else {
        return Vec::new();
    };
    let agree = tuning::AGREE * tuning::INDEPENDENT * ranges.len() as f64;
    if best.ranges_cost > agree || prior.cost(&best.pose) > tuning::NEAR {
        return Vec::new();
    }
    let most = best.cost + tuning::RIVAL;
    let rivals = solutions
        .iter()
        .take_while(|solution| solution.cost <= most);
    rivals.map(|solution| solution.pose).collect()
}

/// Minima of the descents from the expected pose, and from its six sides.
fn solutions(ranges: &[Range], prior: &PosePrior, mean_m: f64) -> Vec<Solution> {
    let count = ranges.len() as f64;
    let now = ranges.iter().map(|range| range.now).sum::<Vector3<f64>>() / count;
    let then = ranges
        .iter()
        .map(|range| range.then.coords)
        .sum::<Vector3<f64>>()
        / count;
    let middle = now - prior.pose.rotation * then;
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let sides = axes.into_iter().flat_map(|axis| [axis, -axis]);
    let starts = sides
        .map(|side| Isometry3::from_parts((middle + side * mean_m).into(), prior.pose.rotation));
    let mut solutions: Vec<Solution> = Vec::new();
    for start in std::iter::once(prior.pose).chain(starts) {
        let found = descend(ranges, prior, &start);
        let is_known = solutions.iter().any(|known| {
            let apart = known.pose.inv_mul(&found.pose) * Point3::from(then) - Point3::from(then);
            apart.norm() < tuning::SAME * mean_m
                && known.pose.rotation.angle_to(&found.pose.rotation) < tuning::SAME
        });
        if !is_known {
            solutions.push(found);
        }
    }
    solutions
}

/// Descends to the next minimum.
fn descend(ranges: &[Range], prior: &PosePrior, start: &Isometry3<f64>) -> Solution {
    let (pose, cost) = tuning::DESCENT.run(start, |pose| {
        let mut sum = equations(ranges, pose);
        let off = twist(&prior.pose.inv_mul(pose));
        sum.gradient += prior.information.component_mul(&off);
        sum.hessian += Matrix6::from_diagonal(&prior.information);
        sum.cost += prior.cost(pose);
        sum
    });
    Solution {
        pose,
        cost,
        ranges_cost: equations(ranges, &pose).cost,
    }
}

impl PosePrior {
    fn cost(&self, pose: &Isometry3<f64>) -> f64 {
        let off = twist(&self.pose.inv_mul(pose));
        off.dot(&self.information.component_mul(&off))
    }
}

/// Σ of the squared deviations of |now − T then| from the distances, bounded, and its derivatives
/// by ξ of T exp(ξ).
///
/// ```text
/// e = now − T then    v = Rᵀ e / |e|    ∂|e|/∂(ρ, φ) = (−v, −then × v)
/// ```
pub(crate) fn equations(ranges: &[Range], pose: &Isometry3<f64>) -> NormalEquations {
    let mut sum = NormalEquations {
        hessian: Matrix6::zeros(),
        gradient: Vector6::zeros(),
        cost: 0.0,
    };
    for range in ranges {
        let error = range.now - (pose * range.then).coords;
        // The direction is regularised where the points meet.
        let length = (error.norm_squared() + 0.25 * range.sd_m * range.sd_m).sqrt();
        let along = pose.rotation.inverse() * error / length;
        let lever = range.then.coords.cross(&along);
        let jacobian =
            Vector6::new(-along.x, -along.y, -along.z, -lever.x, -lever.y, -lever.z) / range.sd_m;
        let off = (length - range.mean_m) / range.sd_m;
        let (cost, weight) = if off.abs() <= tuning::BOUNDED {
            (off * off, 1.0)
        } else {
            (
                2.0 * tuning::BOUNDED * off.abs() - tuning::BOUNDED * tuning::BOUNDED,
                tuning::BOUNDED / off.abs(),
            )
        };
        sum.cost += tuning::INDEPENDENT * cost;
        sum.gradient += jacobian * (tuning::INDEPENDENT * weight * off);
        sum.hessian += jacobian * jacobian.transpose() * (tuning::INDEPENDENT * weight);
    }
    sum
}

#[cfg(test)]
mod tests {
    use nalgebra::Translation3;

    use super::*;
    use crate::keyframes::SampleKey;
    use crate::views::{Distance, StoredView};

    fn view(ordinal: u32, at: Vector3<f64>) -> StoredView {
        StoredView {
            channel: 0,
            sample: SampleKey {
                agent: 0,
                session: 0,
                seq: ordinal.into(),
            },
            ordinal,
            in_odom: Translation3::from(at).into(),
            in_map: at.into(),
            spread: [1.0, 0.3],
            vector: Box::default(),
        }
    }

    /// Two stretches of seven views each. Motion has the earlier one where `apart` takes it from
    /// where it is.
    fn matched(
        now: impl Fn(f64) -> Vector3<f64>,
        then: impl Fn(f64) -> Vector3<f64>,
        apart: &Isometry3<f64>,
    ) -> (SequenceMatch, Isometry3<f64>) {
        let along = |k: u32| f64::from(k) * 0.3 - 0.9;
        let mut matched: Option<SequenceMatch> = None;
        for k in 0..7 {
            for j in 0..7 {
                let (here, there) = (now(along(k)), then(along(j)));
                let distance = Distance {
                    mean_m: (here - there).norm(),
                    sd_m: 0.03,
                };
                let carried = apart * Point3::from(there);
                let (here, there) = (view(k, here), view(j, carried.coords));
                match &mut matched {
                    None => matched = Some(SequenceMatch::new(&here, &there, distance)),
                    Some(matched) => matched.add(&here, &there, distance),
                }
            }
        }
        let matched = matched.unwrap();
        let carried = matched.then.in_odom;
        let there = apart.inverse() * carried;
        let truth = matched.now.in_odom.inverse() * there;
        (matched, truth)
    }

    fn bent(t: f64) -> Vector3<f64> {
        Vector3::new(t, 0.4 * t * t, 0.3 * t * t * t)
    }

    /// How far a pose is from another one \[m, rad\].
    fn apart(one: &Isometry3<f64>, other: &Isometry3<f64>) -> (f64, f64) {
        let off = one.inv_mul(other);
        (off.translation.vector.norm(), off.rotation.angle())
    }

    #[test]
    fn bent_stretches_are_laid_over_each_other() {
        let across = |t: f64| Vector3::new(0.2 * t * t, t, 0.5 - 0.3 * t);
        for turn in [-0.3, 0.2] {
            let moved =
                Isometry3::new(Vector3::new(0.5, -0.4, 0.3), Vector3::new(turn, 0.1, -turn));
            let (matched, truth) = matched(bent, across, &moved);
            let expected = matched.now.in_odom.inverse() * matched.then.in_odom;
            let found = align_roughly(&matched, &expected, [1.0, 0.5]);
            let (off_m, off_rad) = apart(&found[0], &truth);
            assert!(off_m < 0.05 && off_rad < 0.05, "{off_m} {off_rad}");
        }
    }

    #[test]
    fn straight_stretches_that_cross_leave_open_which_is_above() {
        let (matched, truth) = matched(
            |t| Vector3::new(t, 0.0, 0.0),
            |t| Vector3::new(0.0, t, 0.6),
            &Isometry3::identity(),
        );
        let below = truth * Isometry3::translation(0.0, 0.0, -1.2);
        let found = align_roughly(&matched, &truth, [2.0, 0.3]);
        for each in [truth, below] {
            let is_there = |pose: &Isometry3<f64>| apart(pose, &each).0 < 0.4;
            assert!(found.iter().any(is_there), "{found:?}");
        }
    }

    #[test]
    fn what_contradicts_the_map_is_no_revisit() {
        let (matched, truth) = matched(bent, bent, &Isometry3::identity());
        let far = truth * Isometry3::translation(3.0, 0.0, 0.0);
        assert_eq!(align_roughly(&matched, &far, [0.2, 0.1]), []);
    }
}
