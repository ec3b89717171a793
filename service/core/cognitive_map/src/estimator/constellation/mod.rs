//! Constellations: two frames that know the same landmarks by other names, told by how these lie to one another.
//!
//! ```text
//! hypotheses   rigid motions that lay two landmarks of one frame (three in space) over two of the other which are as
//!              far from one another, within the deviations of both distances
//! twins        landmarks that a motion lays within their deviations of one another, one to one; the motion is fitted to
//!              those in which no other landmark may be meant, and they are sought again
//! chance       H · m · P(at least k − 2 of m − 2 are so near by chance), the least over k; in space k − 3 of m − 3
//! ```
//!
//! H is the number of hypotheses, m that of the landmarks that are sought, and how near something lies by chance
//! follows from the density of the other frame's landmarks. Landmarks close together agree together: a group of them counts
//! once, among the hypotheses, too. That is the expected number of motions which are as good
//! where nothing is the same (the number of false alarms of Desolneux, Moisan & Morel 2000; Moisan & Stival 2004 for
//! such hypotheses). Landmarks in a regular order are no matter of chance: so no other motion may explain nearly as much.
//! A mirrored constellation is another one, and nothing is believed that it would explain better.

mod ambiguity;
mod candidates;
mod chance;
mod groups;
mod hypotheses;
mod sky;

use nalgebra::{Isometry3, Point3};

use ambiguity::Laid;
use candidates::candidates;
use chance::{Tried, log10_by_chance};
use geometry::align;
use groups::{groups, n_different, n_hypotheses, one_by_group};
use hypotheses::hypotheses;
use sky::{Twin, one_to_one};

pub(super) use chance::log10_at_least;
pub(super) use sky::Sky;

/// Landmarks of the newer frame that are sought in the older one.
pub(super) const SOUGHT_MAX: usize = 24;
/// Deviations within which two landmarks, or two distances, may be the same.
pub(super) const GATE: f64 = 3.0;
/// Difference of squared distances over the variance from which it is sure which of two landmarks
/// is meant: 400 to 1.
pub(super) const SURE_MARGIN: f64 = 12.0;
/// Fewest twins between planar frames, and between frames in space.
const TWINS_MIN: (usize, usize) = (5, 6);
/// Log₁₀ of the expected number of motions that are as good by chance, for one to be believed.
const LOG10_CHANCE_MAX: f64 = -4.0;
/// Part of its logarithm that another motion may have.
const RIVAL_MAX: f64 = 0.5;
/// By how much the logarithm of the mirror image may be better.
const MIRRORED_MAX: f64 = 1.0;
/// Distance up to which landmarks hang together, in their mean distance.
const TOGETHER: f64 = 0.5;
/// Part of the landmarks among the twins, of the frame that has fewer there, that must be twins.
const AGREEING_MIN: f64 = 0.7;
/// Distance from a twin up to which others are among the twins, in the landmarks' mean distance.
const AMONG: f64 = 1.5;
/// Rounds of fitting a motion and seeking the twins again.
const ROUNDS: usize = 4;

/// Where a landmark is in its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Star {
    /// \[m\].
    pub(super) position: Point3<f64>,
    /// Along an axis, of those along which it has any \[m²\].
    pub(super) variance: f64,
}

/// How the landmarks of one frame lie among those of an older one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Likeness {
    /// Pose of the newer frame in the older one.
    pub(super) pose: Isometry3<f64>,
    /// Numbers of the landmarks that lie over one another, in the older and in the newer frame. Of
    /// two pairs close together it is open which is which; a pair in which a landmark of no pair
    /// may be meant is left out.
    pub(super) twins: Vec<(usize, usize)>,
    /// Log₁₀ of the expected number of motions as good as this one by chance.
    pub(super) log10_chance: f64,
}

/// Finds how the landmarks of a newer frame lie among those of an older one, if that is beyond chance and no other way
/// explains nearly as much.
///
/// Of the newer ones the first [`SOUGHT_MAX`] count, so they come with the most telling first. Landmarks that are known less
/// well than they are dense say nothing and are left out. Work is bounded: where too many pairs are equally far from one
/// another, there is no answer.
pub(super) fn likeness(older: &[Star], newer: &[Star], is_planar: bool) -> Option<Likeness> {
    let newer = &newer[..newer.len().min(SOUGHT_MAX)];
    let sparsest = Sky::new(older, is_planar);
    let is_telling = |star: &&Star| sparsest.chance_within(2.0 * star.variance.sqrt()) < 1.0;
    let (older_at, newer_at) = (places(older, is_telling), places(newer, is_telling));
    let only = |stars: &[Star], at: &[usize]| at.iter().map(|&at| stars[at]).collect();
    let (older, newer): (Vec<Star>, Vec<Star>) = (only(older, &older_at), only(newer, &newer_at));
    let found = motions(&older, &newer, is_planar);
    let mut best = found.first()?.clone();
    // Other twins of landmarks that lie close together are no other motion.
    let near_m = Sky::new(&older, is_planar).spacing_m() * TOGETHER;
    let is_another = |other: &&Likeness| {
        let near = other.twins.iter().filter(|&&(one, other)| {
            (best.pose * newer[other].position - older[one].position).norm() <= near_m
        });
        2 * near.count() <= other.twins.len()
    };
    let rival = found.iter().find(is_another);
    let is_rivalled = rival.is_some_and(|rival| rival.log10_chance < RIVAL_MAX * best.log10_chance);
    if best.log10_chance > LOG10_CHANCE_MAX || is_rivalled {
        return None;
    }
    // What the mirror image explains better is a part of it that happens to look like its mirror image.
    let mirrored: Vec<Star> = newer.iter().map(mirrored).collect();
    let rival = motions(&older, &mirrored, is_planar).into_iter().next();
    if rival.is_some_and(|rival| rival.log10_chance < best.log10_chance - MIRRORED_MAX) {
        return None;
    }
    let twins = Laid::new(&best.pose, &older, &newer).unrivalled(&best.twins);
    best.twins = twins
        .iter()
        .map(|&(one, other)| (older_at[one], newer_at[other]))
        .collect();
    Some(best)
}

fn mirrored(star: &Star) -> Star {
    let mut star = *star;
    star.position.x = -star.position.x;
    star
}

/// The motions that are nearest to being believed, the best first.
fn motions(older: &[Star], newer: &[Star], is_planar: bool) -> Vec<Likeness> {
    let twins_min = if is_planar { TWINS_MIN.0 } else { TWINS_MIN.1 };
    let sky = Sky::new(older, is_planar);
    let near_m = TOGETHER * sky.spacing_m();
    let groups = [groups(older, near_m), groups(newer, near_m)];
    if groups.iter().any(|groups| n_different(groups) < twins_min) {
        return Vec::new();
    }
    let Some(hypotheses) = hypotheses(older, newer, is_planar) else {
        return Vec::new();
    };
    let tried = Tried {
        n_hypotheses: n_hypotheses(&hypotheses, &groups),
        n_sought: n_different(&groups[1]),
        is_planar,
    };
    let mut found: Vec<Likeness> = Vec::new();
    for pose in candidates(&hypotheses, &sky, newer, twins_min) {
        let Some((pose, twins)) = settle(pose, &sky, older, newer, is_planar) else {
            continue;
        };
        let alone = one_by_group(&twins, &groups);
        if alone.len() >= twins_min && is_agreed(&pose, &twins, &sky, older, newer) {
            found.push(Likeness {
                pose,
                log10_chance: log10_by_chance(&alone, &sky, &tried),
                twins: twins.iter().map(|twin| (twin.older, twin.newer)).collect(),
            });
        }
    }
    found.sort_by(|a, b| a.log10_chance.total_cmp(&b.log10_chance));
    found
}

/// Where those are that fulfil a condition.
fn places(stars: &[Star], condition: impl Fn(&&Star) -> bool) -> Vec<usize> {
    let found = stars.iter().enumerate();
    found
        .filter(|(_, star)| condition(star))
        .map(|(at, _)| at)
        .collect()
}

/// Mean of the variances \[m²\].
pub(super) fn mean_variance(stars: &[Star]) -> f64 {
    stars.iter().map(|star| star.variance).sum::<f64>() / stars.len().max(1) as f64
}

/// Whether most landmarks that lie among the twins are twins: where one frame knows many that the other does not, the rest is alike
/// by chance.
fn is_agreed(
    pose: &Isometry3<f64>,
    twins: &[Twin],
    sky: &Sky<'_>,
    older: &[Star],
    newer: &[Star],
) -> bool {
    let near_m = AMONG * sky.spacing_m();
    let is_among = |at: &Point3<f64>| {
        let mut twins = twins.iter().map(|twin| &older[twin.older].position);
        twins.any(|twin| (twin - at).norm() <= near_m)
    };
    let of_older = older.iter().filter(|star| is_among(&star.position)).count();
    let of_newer = newer
        .iter()
        .filter(|star| is_among(&(pose * star.position)))
        .count();
    twins.len() as f64 >= AGREEING_MIN * of_older.min(of_newer) as f64
}

/// How far a motion lays landmarks from where another one lays them, at most \[m\].
pub(super) fn apart_m(one: &Isometry3<f64>, other: &Isometry3<f64>, stars: &[Star]) -> f64 {
    let apart = |star: &Star| (one * star.position - other * star.position).norm();
    stars.iter().map(apart).fold(0.0, f64::max)
}

/// Fits a motion to its twins and seeks them again, until nothing changes. Twins in which another
/// landmark may be meant are left out of the fit as long as the others alone are enough for a
/// motion to be believed.
fn settle(
    mut pose: Isometry3<f64>,
    sky: &Sky<'_>,
    older: &[Star],
    newer: &[Star],
    is_planar: bool,
) -> Option<(Isometry3<f64>, Vec<Twin>)> {
    let twins_min = if is_planar { TWINS_MIN.0 } else { TWINS_MIN.1 };
    let mut twins = Vec::new();
    for round in 0..ROUNDS {
        // At first the motion is only that of two or three landmarks.
        let spread = if round == 0 {
            mean_variance(newer)
        } else {
            0.0
        };
        sky.pairs(&pose, newer, &|_| spread, &mut twins);
        one_to_one(&mut twins);
        let all: Vec<_> = twins.iter().map(|twin| (twin.older, twin.newer)).collect();
        let unambiguous = Laid::new(&pose, older, newer).unambiguous(&all);
        let fitted = if unambiguous.len() >= twins_min {
            unambiguous
        } else {
            all
        };
        let pairs: Vec<_> = fitted
            .iter()
            .map(|&(one, other)| (older[one].position, newer[other].position))
            .collect();
        let weights: Vec<f64> = fitted
            .iter()
            .map(|&(one, other)| 1.0 / (older[one].variance + newer[other].variance))
            .collect();
        pose = align(&pairs, &weights, is_planar)?;
    }
    sky.pairs(&pose, newer, &|_| 0.0, &mut twins);
    one_to_one(&mut twins);
    Some((pose, twins))
}

#[cfg(test)]
mod tests;
