//! Registration of two frames that know the same landmarks by other names, by how these lie.
//!
//! ```text
//! hypotheses        rigid motions that take two landmarks of one frame (three in space) to two of
//!                   the other that are as far apart, within the deviations of both distances
//! correspondences   landmarks that coincide under a motion within their deviations, one to one;
//!                   the motion is fitted to the unambiguous ones, and they are sought again
//! false alarms      H · m · P(at least k − 2 of m − 2 are so near by chance), the least over k;
//!                   in space k − 3 of m − 3
//! ```
//!
//! H is the number of hypotheses, m that of the landmarks that are sought; how near something lies
//! by chance follows from the density of the other frame's landmarks. A group of landmarks close
//! together counts once. The result is the expected number of motions that are as good where
//! nothing is the same (number of false alarms: Desolneux, Moisan & Morel 2000; Moisan & Stival
//! 2004). Landmarks in a regular order do not lie by chance, so no other motion may explain nearly
//! as much, nor the mirror image more.

mod ambiguity;
mod candidates;
mod chance;
mod groups;
mod hypotheses;
mod point_index;
mod tuning;

use nalgebra::{Isometry3, Point3};

use ambiguity::Laid;
use candidates::candidates;
use chance::{Tried, log10_by_chance};
use geometry::align;
use groups::{groups, n_different, n_hypotheses, one_by_group};
use hypotheses::hypotheses;
use point_index::{Correspondence, one_to_one};
use tuning::{
    AGREEING_MIN, AMONG, CORRESPONDENCES_MIN, LOG10_FALSE_ALARMS_MAX, MIRRORED_MAX, RIVAL_MAX,
    ROUNDS, TOGETHER,
};

pub(super) use chance::log10_at_least;
pub(super) use point_index::PointIndex;
pub(super) use tuning::{GATE, SOUGHT_MAX, SURE_MARGIN};

/// Where a landmark is in its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UncertainPoint {
    /// \[m\].
    pub(super) position: Point3<f64>,
    /// Along an axis, of those along which it has any \[m²\].
    pub(super) variance: f64,
}

/// How the landmarks of one frame lie among those of an older one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Registration {
    /// Pose of the newer frame in the older one.
    pub(super) pose: Isometry3<f64>,
    /// Numbers of the landmarks that lie over one another, in the older and in the newer frame. Of
    /// two pairs close together it is open which is which; a pair in which a landmark of no pair
    /// may be meant is left out.
    pub(super) correspondences: Vec<(usize, usize)>,
    /// Log₁₀ of the expected number of motions as good as this one by chance.
    pub(super) log10_false_alarms: f64,
}

/// Finds how the landmarks of a newer frame lie among those of an older one, if that is beyond
/// chance and no other way explains nearly as much.
///
/// Of the newer ones the first [`SOUGHT_MAX`] count, so they come with the most telling first.
/// Landmarks that are known less well than they are dense say nothing and are left out. Work is
/// bounded: where too many pairs are equally far from one another, there is no answer.
pub(super) fn register(
    older: &[UncertainPoint],
    newer: &[UncertainPoint],
    is_planar: bool,
) -> Option<Registration> {
    let newer = &newer[..newer.len().min(SOUGHT_MAX)];
    let sparsest = PointIndex::new(older, is_planar);
    let is_telling =
        |point: &&UncertainPoint| sparsest.chance_within(2.0 * point.variance.sqrt()) < 1.0;
    let (older_at, newer_at) = (places(older, is_telling), places(newer, is_telling));
    let only = |points: &[UncertainPoint], at: &[usize]| at.iter().map(|&at| points[at]).collect();
    let (older, newer): (Vec<UncertainPoint>, Vec<UncertainPoint>) =
        (only(older, &older_at), only(newer, &newer_at));
    let found = motions(&older, &newer, is_planar);
    let mut best = found.first()?.clone();
    // Other correspondences of landmarks that lie close together are no other motion.
    let near_m = PointIndex::new(&older, is_planar).spacing_m() * TOGETHER;
    let is_another = |other: &&Registration| {
        let near = other.correspondences.iter().filter(|&&(one, other)| {
            (best.pose * newer[other].position - older[one].position).norm() <= near_m
        });
        2 * near.count() <= other.correspondences.len()
    };
    let rival = found.iter().find(is_another);
    let is_rivalled =
        rival.is_some_and(|rival| rival.log10_false_alarms < RIVAL_MAX * best.log10_false_alarms);
    if best.log10_false_alarms > LOG10_FALSE_ALARMS_MAX || is_rivalled {
        return None;
    }
    // What the mirror image explains better is a part of it that happens to look like its mirror
    // image.
    let mirrored: Vec<UncertainPoint> = newer.iter().map(mirrored).collect();
    let rival = motions(&older, &mirrored, is_planar).into_iter().next();
    if rival.is_some_and(|rival| rival.log10_false_alarms < best.log10_false_alarms - MIRRORED_MAX)
    {
        return None;
    }
    let correspondences = Laid::new(&best.pose, &older, &newer).unrivalled(&best.correspondences);
    best.correspondences = correspondences
        .iter()
        .map(|&(one, other)| (older_at[one], newer_at[other]))
        .collect();
    Some(best)
}

fn mirrored(point: &UncertainPoint) -> UncertainPoint {
    let mut point = *point;
    point.position.x = -point.position.x;
    point
}

/// The motions that are nearest to being accepted, the best first.
fn motions(
    older: &[UncertainPoint],
    newer: &[UncertainPoint],
    is_planar: bool,
) -> Vec<Registration> {
    let correspondences_min = if is_planar {
        CORRESPONDENCES_MIN.0
    } else {
        CORRESPONDENCES_MIN.1
    };
    let index = PointIndex::new(older, is_planar);
    let near_m = TOGETHER * index.spacing_m();
    let groups = [groups(older, near_m), groups(newer, near_m)];
    if groups
        .iter()
        .any(|groups| n_different(groups) < correspondences_min)
    {
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
    let mut found: Vec<Registration> = Vec::new();
    for pose in candidates(&hypotheses, &index, newer, correspondences_min) {
        let Some((pose, correspondences)) = refine(pose, &index, older, newer, is_planar) else {
            continue;
        };
        let alone = one_by_group(&correspondences, &groups);
        if alone.len() >= correspondences_min
            && is_agreed(&pose, &correspondences, &index, older, newer)
        {
            found.push(Registration {
                pose,
                log10_false_alarms: log10_by_chance(&alone, &index, &tried),
                correspondences: correspondences
                    .iter()
                    .map(|correspondence| (correspondence.older, correspondence.newer))
                    .collect(),
            });
        }
    }
    found.sort_by(|a, b| a.log10_false_alarms.total_cmp(&b.log10_false_alarms));
    found
}

/// Where those are that fulfil a condition.
fn places(points: &[UncertainPoint], condition: impl Fn(&&UncertainPoint) -> bool) -> Vec<usize> {
    let found = points.iter().enumerate();
    found
        .filter(|(_, point)| condition(point))
        .map(|(at, _)| at)
        .collect()
}

/// Mean of the variances \[m²\].
pub(super) fn mean_variance(points: &[UncertainPoint]) -> f64 {
    points.iter().map(|point| point.variance).sum::<f64>() / points.len().max(1) as f64
}

/// Whether most landmarks that lie among the correspondences are correspondences: where one frame
/// knows many that the other does not, the rest agrees by chance.
fn is_agreed(
    pose: &Isometry3<f64>,
    correspondences: &[Correspondence],
    index: &PointIndex<'_>,
    older: &[UncertainPoint],
    newer: &[UncertainPoint],
) -> bool {
    let near_m = AMONG * index.spacing_m();
    let is_among = |at: &Point3<f64>| {
        let mut correspondences = correspondences
            .iter()
            .map(|correspondence| &older[correspondence.older].position);
        correspondences.any(|correspondence| (correspondence - at).norm() <= near_m)
    };
    let of_older = older
        .iter()
        .filter(|point| is_among(&point.position))
        .count();
    let of_newer = newer
        .iter()
        .filter(|point| is_among(&(pose * point.position)))
        .count();
    correspondences.len() as f64 >= AGREEING_MIN * of_older.min(of_newer) as f64
}

/// How far a motion lays landmarks from where another one lays them, at most \[m\].
pub(super) fn apart_m(
    one: &Isometry3<f64>,
    other: &Isometry3<f64>,
    points: &[UncertainPoint],
) -> f64 {
    let apart = |point: &UncertainPoint| (one * point.position - other * point.position).norm();
    points.iter().map(apart).fold(0.0, f64::max)
}

/// Fits a motion to its correspondences and seeks them again, until nothing changes. Those in which
/// another landmark may be meant are left out of the fit as long as the others alone are enough for
/// a motion to be accepted.
fn refine(
    mut pose: Isometry3<f64>,
    index: &PointIndex<'_>,
    older: &[UncertainPoint],
    newer: &[UncertainPoint],
    is_planar: bool,
) -> Option<(Isometry3<f64>, Vec<Correspondence>)> {
    let correspondences_min = if is_planar {
        CORRESPONDENCES_MIN.0
    } else {
        CORRESPONDENCES_MIN.1
    };
    let mut correspondences = Vec::new();
    for round in 0..ROUNDS {
        // At first the motion is only that of two or three landmarks.
        let spread = if round == 0 {
            mean_variance(newer)
        } else {
            0.0
        };
        index.pairs(&pose, newer, &|_| spread, &mut correspondences);
        one_to_one(&mut correspondences);
        let all: Vec<_> = correspondences
            .iter()
            .map(|correspondence| (correspondence.older, correspondence.newer))
            .collect();
        let unambiguous = Laid::new(&pose, older, newer).unambiguous(&all);
        let fitted = if unambiguous.len() >= correspondences_min {
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
    index.pairs(&pose, newer, &|_| 0.0, &mut correspondences);
    one_to_one(&mut correspondences);
    Some((pose, correspondences))
}

#[cfg(test)]
mod tests;
