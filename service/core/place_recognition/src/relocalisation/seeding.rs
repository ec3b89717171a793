//! Pose seeding: poses where the ranges of several queries meet.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{
    Isometry3, Matrix6, Point3, SymmetricEigen, Translation3, Unit, UnitQuaternion, Vector3,
    Vector6,
};

use super::problem::{Problem, QueryPoint, RangeCue};
use crate::sequences::{Range, equations};
use crate::twist::moved;
use geometry::align;

/// Most nodes of a query.
const NODES_PER_SPOT_MAX: usize = 4;
/// Most nodes from which poses are seeded.
const SEEDS_MAX: usize = 16;
/// Fewest queries whose nodes must be as far from one another as the queries are.
const SPOTS_MIN: usize = 4;
/// Deviations between two distances up to which they agree.
const AGREE: f64 = 2.5;
/// Rounds of reweighting.
const ROUNDS: usize = 5;
/// Turns about the way that are tried: a straight way leaves the turn about it open.
const TURNS: u32 = 6;
/// Most steps of an eigendecomposition, which needs some ten.
const EIGEN_STEPS_MAX: usize = 200;
/// Steps of a first descent, and of a final one.
const STEPS: (usize, usize) = (6, 20);
/// Most poses of the final descent.
const POSES_MAX: usize = 12;
/// Poses closer than this are the same, in reaches of the channel and \[rad\].
const SAME: (f64, f64) = (0.15, 0.25);
/// Gate: largest residual of a range that counts, in reaches.
const GATE: f64 = 1.0;
/// Most ranges of a query that count.
const CUES_PER_SPOT: usize = 8;

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
            if let Some(found) = descend(problem, &turned, STEPS.0) {
                keep(problem, &mut rough, &found);
            }
        }
    }
    rough.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    rough.truncate(POSES_MAX);
    let mut minima = Vec::new();
    for each in rough {
        if let Some(found) = descend(problem, &each.pose, STEPS.1) {
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
        for _ in 0..NODES_PER_SPOT_MAX {
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
        if seeds.len() >= SEEDS_MAX {
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
        if squared <= AGREE * AGREE && known.is_none_or(|(least, _)| squared < least) {
            *known = Some((squared, *node));
        }
    }
    let chosen: Vec<Node> = std::iter::once(*seed)
        .chain(best.into_iter().flatten().map(|(_, node)| node))
        .collect();
    if chosen.len() < SPOTS_MIN {
        return None;
    }
    let pairs: Vec<(Point3<f64>, Point3<f64>)> = chosen
        .iter()
        .map(|node| (node.at, problem.points[node.point].at))
        .collect();
    let mut weights: Vec<f64> = chosen.iter().map(|node| 1.0 / node.variance).collect();
    let mut pose = align(&pairs, &weights, problem.is_planar)?;
    for _ in 0..ROUNDS {
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
    let Some(eigen) = SymmetricEigen::try_new(spread, f64::EPSILON, EIGEN_STEPS_MAX) else {
        return vec![*pose];
    };
    let axis = Unit::new_normalize(
        eigen
            .eigenvectors
            .column(eigen.eigenvalues.imax())
            .into_owned(),
    );
    let turn = |k: u32| {
        let angle_rad = TAU * f64::from(k) / f64::from(TURNS);
        let turn = UnitQuaternion::from_axis_angle(&axis, angle_rad);
        let about = Translation3::from(middle) * turn * Translation3::from(-middle);
        about * pose
    };
    (0..TURNS).map(turn).collect()
}

/// Descends to the next minimum of the ranges within the gate (Levenberg–Marquardt).
fn descend(problem: &Problem, start: &Isometry3<f64>, steps: usize) -> Option<Minimum> {
    // The start is the origin: far from the map's origin a turn about it would be a shift as well.
    let origin = start.translation;
    let ranges = ranges(problem, start);
    if ranges.len() < SPOTS_MIN {
        return None;
    }
    let free = |gradient: &mut Vector6<f64>, hessian: &mut Matrix6<f64>| {
        if problem.is_planar {
            geometry::hold_in_plane(gradient, hessian, |_| 1.0);
        }
    };
    // Ranges are from points of the map, which are at rest while the body moves.
    let mut inverse = Isometry3::from_parts(Translation3::identity(), start.rotation.inverse());
    let mut here = equations(&ranges, &inverse);
    let mut damping = 1e-3;
    for _ in 0..steps {
        let (mut gradient, mut hessian) = (here.gradient, here.hessian);
        // Perturbation along the axes of the body: T⁻¹ exp(ξ). Out of the plane nothing moves.
        free(&mut gradient, &mut hessian);
        for k in 0..6 {
            hessian[(k, k)] = hessian[(k, k)] * (1.0 + damping) + 1e-9;
        }
        let Some(factor) = hessian.cholesky() else {
            break;
        };
        let next = moved(&inverse, &-factor.solve(&gradient));
        let there = equations(&ranges, &next);
        if there.cost < here.cost {
            let is_done = here.cost - there.cost < 1e-5 * here.cost;
            (inverse, here) = (next, there);
            damping *= 0.2;
            if is_done {
                break;
            }
        } else {
            damping *= 10.0;
        }
    }
    let pose = origin * inverse.inverse();
    let is_sound = pose.translation.vector.iter().all(|x| x.is_finite());
    is_sound.then_some(Minimum {
        pose,
        // Of two poses the one that explains more ranges costs less.
        cost: here.cost - ranges.len() as f64,
    })
}

/// The ranges within the gate at a pose.
fn ranges(problem: &Problem, pose: &Isometry3<f64>) -> Vec<Range> {
    let gate_m = GATE * problem.reach_m;
    let mut ranges = Vec::new();
    for point in &problem.points {
        let at = pose * point.at;
        let meant = point.cues.iter().filter(|cue| {
            let off = (cue.target - at).norm() - cue.mean_m;
            off.abs() <= gate_m + 2.0 * point.drift_m
        });
        ranges.extend(meant.take(CUES_PER_SPOT).map(|cue| Range {
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
    apart.translation.vector.norm() < SAME.0 * problem.reach_m
        && apart.rotation.angle() < SAME.1.min(FRAC_PI_2)
}
