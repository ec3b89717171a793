//! Groups of landmarks so close together that their agreements are not independent.

use super::UncertainPoint;
use super::hypotheses::Hypothesis;
use super::point_index::Correspondence;

/// Groups of landmarks: each is in that of the first one that is so near \[m\].
pub(super) fn groups(points: &[UncertainPoint], near_m: f64) -> Vec<usize> {
    let mut groups: Vec<usize> = Vec::with_capacity(points.len());
    for (at, point) in points.iter().enumerate() {
        let is_near = |&first: &usize| (points[first].position - point.position).norm() <= near_m;
        let founders = (0..at).filter(|&first| groups[first] == first);
        groups.push(founders.into_iter().find(is_near).unwrap_or(at));
    }
    groups
}

/// How many groups there are.
pub(super) fn n_different(groups: &[usize]) -> usize {
    groups
        .iter()
        .enumerate()
        .filter(|(at, group)| at == *group)
        .count()
}

/// How many of the hypotheses are of different groups.
pub(super) fn n_hypotheses(hypotheses: &[Hypothesis], groups: &[Vec<usize>; 2]) -> usize {
    let of_groups = |hypothesis: &Hypothesis| {
        let mut pairs = hypothesis
            .pairs
            .map(|(one, other)| (groups[0][one], groups[1][other]));
        pairs.sort_unstable();
        pairs
    };
    let mut different: Vec<_> = hypotheses.iter().map(of_groups).collect();
    different.sort_unstable();
    different.dedup();
    different.len()
}

/// The nearest correspondence of each group.
pub(super) fn one_by_group(
    correspondences: &[Correspondence],
    groups: &[Vec<usize>; 2],
) -> Vec<Correspondence> {
    let mut alone: Vec<Correspondence> = Vec::new();
    for correspondence in correspondences {
        let shares = |other: &Correspondence| {
            groups[0][other.older] == groups[0][correspondence.older]
                || groups[1][other.newer] == groups[1][correspondence.newer]
        };
        if !alone.iter().any(shares) {
            alone.push(*correspondence);
        }
    }
    alone
}
