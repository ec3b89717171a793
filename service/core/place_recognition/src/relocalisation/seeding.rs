//! Poses that are begun where several looks point to.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{
    Isometry3, Matrix6, Point3, SymmetricEigen, Translation3, Unit, UnitQuaternion, Vector3,
    Vector6,
};

use super::problem::{Problem, QueryPoint, RangeCue};
use crate::sequences::{Range, equations};
use crate::twist::moved;
use geometry::align;

/// Places that one look may point to.
const NODES_PER_SPOT_MAX: usize = 4;
/// Places from which poses are begun.
const SEEDS_MAX: usize = 16;
/// Looks that must point to places as far from one another as the looks are.
const SPOTS_MIN: usize = 4;
/// Deviations between two distances up to which they agree.
const AGREE: f64 = 2.5;
/// Rounds of weighing places anew.
const ROUNDS: usize = 5;
/// Turns about the way that are tried: a straight way does not say.
const TURNS: u32 = 6;
/// Steps of a decomposition, which needs some ten.
const EIGEN_STEPS_MAX: usize = 200;
/// Steps from a start, and to the end.
const STEPS: (usize, usize) = (6, 20);
/// Poses that go on to the end.
const POSES_MAX: usize = 12;
/// Poses closer than this are one, in reaches and \[rad\].
const SAME: (f64, f64) = (0.15, 0.25);
/// A distance counts that is off by no more than this, in reaches.
const GATE: f64 = 1.0;
/// Distances per look that count.
const CUES_PER_SPOT: usize = 8;

/// A place that a look points to.
#[derive(Clone, Copy, Debug)]
struct Node {
    point: usize,
    at: Point3<f64>,
    variance: f64,
}

/// A pose that explains distances.
#[derive(Clone, Copy, Debug)]
struct Minimum {
    /// Of the body in the map.
    pose: Isometry3<f64>,
    cost: f64,
}

/// The poses that several looks point to, in no particular order.
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

/// The places that the looks point to: views near one another are one place.
fn nodes(problem: &Problem) -> Vec<Node> {
    let mut nodes = Vec::new();
    for (point, each) in problem.points.iter().enumerate() {
        let mut left: Vec<&RangeCue> = each.cues.iter().collect();
        for _ in 0..NODES_PER_SPOT_MAX {
            // The most alike come first.
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
                // Of a mean of points that lie about it at these distances, along each axis.
                variance: variance / weights / 3.0,
            });
            left = others;
        }
    }
    nodes
}

/// Nodes to begin from: the surest ones, of different looks or places.
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

/// A pose that lays the looks over places as far from a node as the looks are from its look.
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

/// A pose, turned about the way where the way may leave that open.
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

/// Goes down to the next minimum (Levenberg–Marquardt) of the distances that may be meant there.
fn descend(problem: &Problem, start: &Isometry3<f64>, steps: usize) -> Option<Minimum> {
    // Far from the map's origin a turn about it is a shift as well: the start is the origin.
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
    // Distances are from the map's points: a point of the map is at rest, the body moves.
    let mut inverse = Isometry3::from_parts(Translation3::identity(), start.rotation.inverse());
    let mut here = equations(&ranges, &inverse);
    let mut damping = 1e-3;
    for _ in 0..steps {
        let (mut gradient, mut hessian) = (here.gradient, here.hessian);
        // Along the body's axes: T⁻¹ exp(ξ) moves the map; out of the plane nothing moves.
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
        // Of two poses the one that explains more distances comes first.
        cost: here.cost - ranges.len() as f64,
    })
}

/// The distances that may be meant where a pose has the looks.
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

/// Takes a pose in, unless there is one like it; then the better one stays.
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
