//! Pose seeding: poses where the ranges of several queries meet.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Isometry3, Point3, SymmetricEigen, Translation3, Unit, UnitQuaternion, Vector3};

use super::problem::{Problem, QueryPoint, RangeCue};
use crate::levenberg_marquardt::Descent;
use crate::sequences::{Range, equations};
use crate::tuning::seeding as tuning;
use geometry::align;

/// A cluster of remembered views that are similar to one query.
#[derive(Clone, Copy, Debug)]
struct Node {
    point: usize,
    at: Point3<f64>,
    variance: f64,
}

/// A minimum of the cost of the ranges.
#[derive(Clone, Copy, Debug)]
struct Minimum {
    /// Pose of the body in the map.
    pose: Isometry3<f64>,
    cost: f64,
}

/// Poses that the ranges of several queries agree on, in no particular order.
pub(super) fn minima(problem: &Problem) -> Vec<Isometry3<f64>> {
    let nodes = nodes(problem);
    let mut starts: Vec<Isometry3<f64>> = Vec::new();
    for seed in seeds(&nodes, problem) {
        let Some(pose) = begin(problem, &nodes, &seed) else {
            continue;
        };
        if !starts.iter().any(|other| is_same(problem, other, &pose)) {
            starts.push(pose);
        }
    }
    let mut rough: Vec<Minimum> = Vec::new();
    for start in &starts {
        for turned in turns(problem, start) {
            if let Some(found) = descend(problem, &turned, tuning::STEPS.0) {
                keep(problem, &mut rough, &found);
            }
        }
    }
    rough.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    rough.truncate(tuning::POSES_MAX);
    let mut minima = Vec::new();
    for each in rough {
        if let Some(found) = descend(problem, &each.pose, tuning::STEPS.1) {
            keep(problem, &mut minima, &found);
        }
    }
    minima.into_iter().map(|minimum| minimum.pose).collect()
}

/// The nodes of all queries: similar views near one another form one.
fn nodes(problem: &Problem) -> Vec<Node> {
    let mut nodes = Vec::new();
    for (point, each) in problem.points.iter().enumerate() {
        let mut left: Vec<&RangeCue> = each.cues.iter().collect();
        for _ in 0..tuning::NODES_PER_SPOT_MAX {
            // The most similar come first.
            let Some(seed) = left.first().map(|cue| cue.target) else {
                break;
            };
            let is_near = |cue: &&RangeCue| (cue.target - seed).norm() <= problem.reach_m;
            let (near, others): (Vec<&RangeCue>, Vec<&RangeCue>) =
                left.into_iter().partition(is_near);
            let (mut weights, mut at, mut variance) = (0.0, Vector3::zeros(), 0.0);
            for cue in &near {
                let square = cue.mean_m.powi(2) + cue.sd_m.powi(2);
                weights += 1.0 / square;
                at += cue.target.coords / square;
                variance += 1.0;
            }
            nodes.push(Node {
                point,
                at: (at / weights).into(),
                // Variance along an axis of the mean of points at these distances.
                variance: variance / weights / 3.0,
            });
            left = others;
        }
    }
    nodes
}

/// Nodes to seed from: the most certain ones, of different queries or places.
fn seeds(nodes: &[Node], problem: &Problem) -> Vec<Node> {
    let mut sorted: Vec<Node> = nodes.to_vec();
    sorted.sort_by(|a, b| a.variance.total_cmp(&b.variance));
    let mut seeds: Vec<Node> = Vec::new();
    for node in sorted {
        if seeds.len() >= tuning::SEEDS_MAX {
            break;
        }
        let is_beside = |seed: &Node| {
            (seed.at - node.at).norm() < problem.reach_m
                && (problem.points[seed.point].at - problem.points[node.point].at).norm()
                    < problem.reach_m
        };
        if !seeds.iter().any(is_beside) {
            seeds.push(node);
        }
    }
    seeds
}

/// The pose that puts the queries onto nodes which are as far from a node as the queries are from
/// its query.
fn begin(problem: &Problem, nodes: &[Node], seed: &Node) -> Option<Isometry3<f64>> {
    let origin = &problem.points[seed.point];
    let mut best: Vec<Option<(f64, Node)>> = vec![None; problem.points.len()];
    for node in nodes.iter().filter(|node| node.point != seed.point) {
        let point: &QueryPoint = &problem.points[node.point];
        let drift = point.drift_m - origin.drift_m;
        let variance = node.variance + seed.variance + drift * drift;
        let off = (node.at - seed.at).norm() - (point.at - origin.at).norm();
        let squared = off * off / variance;
        let known = &mut best[node.point];
        if squared <= tuning::AGREE * tuning::AGREE
            && known.is_none_or(|(least, _)| squared < least)
        {
            *known = Some((squared, *node));
        }
    }
    let chosen: Vec<Node> = std::iter::once(*seed)
        .chain(best.into_iter().flatten().map(|(_, node)| node))
        .collect();
    if chosen.len() < tuning::SPOTS_MIN {
        return None;
    }
    let pairs: Vec<(Point3<f64>, Point3<f64>)> = chosen
        .iter()
        .map(|node| (node.at, problem.points[node.point].at))
        .collect();
    let mut weights: Vec<f64> = chosen.iter().map(|node| 1.0 / node.variance).collect();
    let mut pose = align(&pairs, &weights, problem.is_planar)?;
    for _ in 0..tuning::ROUNDS {
        for ((weight, node), (to, from)) in weights.iter_mut().zip(&chosen).zip(&pairs) {
            let squared = (pose * from - to).norm_squared() / node.variance;
            *weight = 1.0 / (node.variance * (1.0 + squared / 4.0));
        }
        pose = align(&pairs, &weights, problem.is_planar)?;
    }
    Some(pose)
}

/// A pose, turned about the way if the way may leave that turn open.
pub(super) fn turns(problem: &Problem, pose: &Isometry3<f64>) -> Vec<Isometry3<f64>> {
    if problem.is_planar {
        return vec![*pose];
    }
    let way = problem.way(pose);
    let count = way.len() as f64;
    let middle = way.iter().map(|point| point.coords).sum::<Vector3<f64>>() / count;
    let spread = way
        .iter()
        .map(|point| (point.coords - middle) * (point.coords - middle).transpose())
        .sum::<nalgebra::Matrix3<f64>>();
    let Some(eigen) = SymmetricEigen::try_new(spread, f64::EPSILON, tuning::EIGEN_STEPS_MAX) else {
        return vec![*pose];
    };
    let axis = Unit::new_normalize(
        eigen
            .eigenvectors
            .column(eigen.eigenvalues.imax())
            .into_owned(),
    );
    let turn = |k: u32| {
        let angle_rad = TAU * f64::from(k) / f64::from(tuning::TURNS);
        let turn = UnitQuaternion::from_axis_angle(&axis, angle_rad);
        let about = Translation3::from(middle) * turn * Translation3::from(-middle);
        about * pose
    };
    (0..tuning::TURNS).map(turn).collect()
}

/// Descends to the next minimum of the ranges within the gate (Levenberg–Marquardt).
fn descend(problem: &Problem, start: &Isometry3<f64>, steps: usize) -> Option<Minimum> {
    // The start is the origin: far from the map's origin a turn about it would be a shift as well.
    let origin = start.translation;
    let ranges = ranges(problem, start);
    if ranges.len() < tuning::SPOTS_MIN {
        return None;
    }
    // Ranges are from points of the map, which are at rest while the body moves: T⁻¹ exp(ξ), along
    // the axes of the body.
    let inverse = Isometry3::from_parts(Translation3::identity(), start.rotation.inverse());
    let descent = Descent {
        steps,
        ..tuning::DESCENT
    };
    let (inverse, cost) = descent.run(&inverse, |inverse| {
        let mut sum = equations(&ranges, inverse);
        if problem.is_planar {
            geometry::hold_in_plane(&mut sum.gradient, &mut sum.hessian, |_| 1.0);
        }
        sum
    });
    let pose = origin * inverse.inverse();
    let is_sound = pose.translation.vector.iter().all(|x| x.is_finite());
    is_sound.then_some(Minimum {
        pose,
        // Of two poses the one that explains more ranges costs less.
        cost: cost - ranges.len() as f64,
    })
}

/// The ranges within the gate at a pose.
fn ranges(problem: &Problem, pose: &Isometry3<f64>) -> Vec<Range> {
    let gate_m = tuning::GATE * problem.reach_m;
    let mut ranges = Vec::new();
    for point in &problem.points {
        let at = pose * point.at;
        let meant = point.cues.iter().filter(|cue| {
            let off = (cue.target - at).norm() - cue.mean_m;
            off.abs() <= gate_m + 2.0 * point.drift_m
        });
        ranges.extend(meant.take(tuning::CUES_PER_SPOT).map(|cue| Range {
            now: point.at.coords,
            then: cue.target - pose.translation.vector,
            mean_m: cue.mean_m,
            sd_m: cue.sd_m.hypot(point.drift_m),
        }));
    }
    ranges
}

/// Keeps a minimum, or the better of two that are the same.
fn keep(problem: &Problem, known: &mut Vec<Minimum>, found: &Minimum) {
    let same = known
        .iter_mut()
        .find(|other| is_same(problem, &other.pose, &found.pose));
    match same {
        Some(other) if found.cost < other.cost => *other = *found,
        Some(_) => {}
        None => known.push(*found),
    }
}

pub(super) fn is_same(problem: &Problem, one: &Isometry3<f64>, other: &Isometry3<f64>) -> bool {
    let apart = one.inv_mul(other);
    apart.translation.vector.norm() < tuning::SAME.0 * problem.reach_m
        && apart.rotation.angle() < tuning::SAME.1.min(FRAC_PI_2)
}
