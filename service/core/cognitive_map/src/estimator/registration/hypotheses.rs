//! Hypotheses: rigid motions that take two landmarks of one frame (three in space) to two of
//! another.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::tuning::{DISTANCE_MIN, HYPOTHESES_MAX, SEEDS_MAX};
use super::{GATE, UncertainPoint};
use geometry::align;

/// A rigid motion that takes two landmarks (three in space) of the newer frame to two of the older
/// one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hypothesis {
    /// Pose of the newer frame in the older one.
    pub(super) pose: Isometry3<f64>,
    /// The landmarks, of the older and of the newer frame; in a plane the second pair comes twice.
    pub(super) pairs: [(usize, usize); 3],
    /// Middle of the landmarks, in the older frame.
    middle: Point3<f64>,
    /// How far they are from there \[m\].
    radius_m: f64,
    /// Variance of a pair along an axis \[m²\].
    variance: f64,
}

impl Hypothesis {
    /// Variance that the error of the motion adds at a point of the older frame \[m²\]: that of its
    /// middle, and more the farther out it is. No point counts as farther out than twice what was
    /// seen.
    pub(super) fn spread(&self, at: &Point3<f64>) -> f64 {
        let lever = ((at - self.middle).norm() / self.radius_m).min(2.0);
        0.5 * self.variance * (1.0 + lever * lever)
    }
}

/// Two landmarks of one frame.
#[derive(Clone, Copy, Debug)]
struct Span {
    ends: [usize; 2],
    length_m: f64,
    /// Variance of the length \[m²\].
    variance: f64,
}

/// All motions; none if there are too many.
pub(super) fn hypotheses(
    older: &[UncertainPoint],
    newer: &[UncertainPoint],
    is_planar: bool,
) -> Option<Vec<Hypothesis>> {
    let seeds = if is_planar { SEEDS_MAX.0 } else { SEEDS_MAX.1 };
    let seeds = &newer[..newer.len().min(seeds)];
    let mut there = spans(older);
    there.sort_by(|a, b| a.length_m.total_cmp(&b.length_m));
    let variance_max = there.iter().map(|span| span.variance).fold(0.0, f64::max);
    let mut found = Vec::new();
    for span in spans(seeds) {
        let reach = GATE * (span.variance + variance_max).sqrt();
        let first = there.partition_point(|other| other.length_m < span.length_m - reach);
        let near = there[first..].iter();
        for other in near.take_while(|other| other.length_m <= span.length_m + reach) {
            let apart = (other.length_m - span.length_m).powi(2);
            if apart > GATE * GATE * (span.variance + other.variance) {
                continue;
            }
            for ends in [other.ends, [other.ends[1], other.ends[0]]] {
                if is_planar {
                    found.extend(by_two(older, seeds, ends, span));
                } else {
                    by_three(older, seeds, ends, span, &mut found);
                }
                if found.len() > HYPOTHESES_MAX {
                    return None;
                }
            }
        }
    }
    Some(found)
}

/// The pairs of landmarks that lie far enough from one another.
fn spans(points: &[UncertainPoint]) -> Vec<Span> {
    let mut spans = Vec::new();
    for (second, b) in points.iter().enumerate() {
        for (first, a) in points[..second].iter().enumerate() {
            let length_m = (b.position - a.position).norm();
            let variance = a.variance + b.variance;
            if length_m >= DISTANCE_MIN * variance.sqrt() && length_m > 0.0 {
                spans.push(Span {
                    ends: [first, second],
                    length_m,
                    variance,
                });
            }
        }
    }
    spans
}

/// The motion in the plane that takes a pair of landmarks to another one.
fn by_two(
    older: &[UncertainPoint],
    newer: &[UncertainPoint],
    [p, q]: [usize; 2],
    span: Span,
) -> Option<Hypothesis> {
    let [i, j] = span.ends;
    let (from, to) = (newer[i].position, newer[j].position);
    let (at, toward) = (older[p].position, older[q].position);
    let (here, there) = (to - from, toward - at);
    let turn = there.y.atan2(there.x) - here.y.atan2(here.x);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
    let middle = nalgebra::center(&at, &toward);
    let mut shift = middle.coords - turn * nalgebra::center(&from, &to).coords;
    shift.z = 0.0;
    let variance = span.variance + older[p].variance + older[q].variance;
    shift
        .iter()
        .all(|entry| entry.is_finite())
        .then(|| Hypothesis {
            pose: Isometry3::from_parts(shift.into(), turn),
            pairs: [(p, i), (q, j), (q, j)],
            middle,
            radius_m: 0.5 * span.length_m,
            variance: 0.5 * variance,
        })
}

/// The motions in space that lay a pair over another one, and a third landmark over one that lies
/// alike.
fn by_three(
    older: &[UncertainPoint],
    newer: &[UncertainPoint],
    [p, q]: [usize; 2],
    span: Span,
    found: &mut Vec<Hypothesis>,
) {
    let [i, j] = span.ends;
    for (k, third) in newer.iter().enumerate().skip(j + 1) {
        let sides = [i, j].map(|end| (third.position - newer[end].position).norm());
        // Three in a line leave open how the frame is turned about it.
        let along = (third.position - newer[i].position)
            .dot(&(newer[j].position - newer[i].position))
            / span.length_m;
        let height = (sides[0] * sides[0] - along * along).max(0.0).sqrt();
        if height < DISTANCE_MIN * (span.variance + third.variance).sqrt() {
            continue;
        }
        for (r, other) in older.iter().enumerate() {
            if r == p || r == q {
                continue;
            }
            let is_alike = [(i, p), (j, q)]
                .iter()
                .zip(sides)
                .all(|(&(end, there), side)| {
                    let distance = (other.position - older[there].position).norm();
                    let variance = newer[end].variance
                        + third.variance
                        + older[there].variance
                        + other.variance;
                    (distance - side).powi(2) <= GATE * GATE * variance
                });
            if !is_alike {
                continue;
            }
            let pairs = [(p, i), (q, j), (r, k)].map(|(older_one, newer_one)| {
                (older[older_one].position, newer[newer_one].position)
            });
            let Some(pose) = align(&pairs, &[1.0; 3], false) else {
                continue;
            };
            let middle = (pairs[0].0.coords + pairs[1].0.coords + pairs[2].0.coords) / 3.0;
            let variance = span.variance
                + third.variance
                + older[p].variance
                + older[q].variance
                + other.variance;
            found.push(Hypothesis {
                pose,
                pairs: [(p, i), (q, j), (r, k)],
                middle: middle.into(),
                radius_m: 0.5 * height.min(span.length_m),
                variance: variance / 3.0,
            });
            if found.len() > HYPOTHESES_MAX {
                return;
            }
        }
    }
}
