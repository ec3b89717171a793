//! Poses at which a refinement begins.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::{Seeker, same};
use crate::field::Field;
use crate::kernel::{Kernel, log_density};
use crate::prediction::Support;
use crate::tuning::search as tuning;
use crate::window::{Felt, Node};

/// A pose of the frame of motion, and how well it explains a few nodes.
struct Seed {
    log_odds: f64,
    pose: Isometry3<f64>,
}

/// Poses that put the latest node beside a place that remembers such levels, and a few others near
/// places that do so.
pub(super) fn seeds(
    used: &[&Node],
    seeker: &Seeker<'_>,
    length_m: f64,
    field: &dyn Field,
) -> Vec<Isometry3<f64>> {
    let Some((anchor, others)) = used.split_last() else {
        return Vec::new();
    };
    let Some(first) = anchor.felt.first() else {
        return Vec::new();
    };
    let checks = checks(others);
    let mut seeds: Vec<Seed> = Vec::new();
    for (likely, place) in anchors(anchor, length_m, field) {
        let Some(at) = anchor
            .felt
            .iter()
            .find_map(|felt| field.support(place, felt.channel))
        else {
            continue;
        };
        for upright in seeker.upright {
            for turn in 0..tuning::HEADINGS {
                let angle = TAU * f64::from(turn) / f64::from(tuning::HEADINGS);
                let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
                let rotation = heading * upright;
                let shift = at.at.coords - rotation * first.at.coords;
                let pose = Isometry3::from_parts(Translation3::from(shift), rotation);
                let checked = check(&pose, &checks, field);
                seeds.extend(checked.map(|odds| Seed {
                    log_odds: likely + odds,
                    pose,
                }));
            }
        }
    }
    seeds.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    let body = |pose: &Isometry3<f64>| pose * seeker.in_odom;
    let mut best: Vec<Isometry3<f64>> = Vec::new();
    for seed in seeds {
        if best.len() == tuning::SEEDS {
            break;
        }
        let is_same = |other: &Isometry3<f64>| same(&body(other), &body(&seed.pose), length_m);
        if !best.iter().any(is_same) {
            best.push(seed.pose);
        }
    }
    best
}

/// The nodes by which a seed is judged, the farthest first: they tell most about its heading.
fn checks<'a>(others: &[&'a Node]) -> Vec<&'a Node> {
    let count = others.len().min(tuning::CHECKS);
    (0..count)
        .map(|k| others[k * others.len() / count])
        .collect()
}

/// The places that best explain the levels of a node, with their log odds against any other, in the
/// order of places.
fn anchors(anchor: &Node, length_m: f64, field: &dyn Field) -> Vec<(f64, u32)> {
    let beside = (tuning::BESIDE * length_m).powi(2);
    let mut scored: Vec<(f64, u32)> = Vec::new();
    for place in field.places() {
        let odds = anchor.felt.iter().filter_map(|felt| {
            let support = field.support(place, felt.channel)?;
            Some(log_odds(
                felt,
                field.kernel(felt.channel)?,
                &support,
                beside,
            ))
        });
        let (count, sum) = odds.fold((0, 0.0), |(n, sum), odds| (n + 1, sum + odds));
        if count > 0 && sum > 0.0 {
            scored.push((sum, place));
        }
    }
    if scored.len() > tuning::ANCHORS {
        let best_first = |a: &(f64, u32), b: &(f64, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        scored.select_nth_unstable_by(tuning::ANCHORS, best_first);
        scored.truncate(tuning::ANCHORS);
        scored.sort_by_key(|(_, place)| *place);
    }
    scored
}

/// Log odds of a level at a squared distance from a place \[m²\], against anywhere, by what that
/// place alone remembers.
fn log_odds(felt: &Felt, kernel: &Kernel, support: &Support, squared_m2: f64) -> f64 {
    let alike = kernel.covariance(squared_m2) / kernel.sill;
    let mean = kernel.mean + alike * (support.value - kernel.mean);
    let variance = kernel.sill * (1.0 - alike * alike) + 2.0 * kernel.nugget;
    let here = log_density(felt.value - mean, variance);
    let odds = here - kernel.anywhere(felt.value);
    (0.95 * odds.exp() + 0.05).ln()
}

/// Log odds of a pose by a few nodes; `None` where they speak against it.
fn check(pose: &Isometry3<f64>, checks: &[&Node], field: &dyn Field) -> Option<f64> {
    let mut sum = 0.0;
    for node in checks {
        let Some(first) = node.felt.first() else {
            continue;
        };
        let at: Point3<f64> = pose * first.at;
        let Some(place) = field.nearest(&at) else {
            continue;
        };
        for felt in &node.felt {
            if let Some(support) = field.support(place, felt.channel)
                && let Some(kernel) = field.kernel(felt.channel)
            {
                let squared = (support.at - pose * felt.at).norm_squared();
                sum += log_odds(felt, kernel, &support, squared);
            }
        }
        if sum < -2.0 {
            return None;
        }
    }
    Some(sum)
}
