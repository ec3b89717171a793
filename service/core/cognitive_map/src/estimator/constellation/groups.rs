//! Landmarks that lie so close together that they agree together.

use super::Star;
use super::hypotheses::Hypothesis;
use super::sky::Twin;

/// Groups of landmarks: each is in that of the first one that is so near \[m\].
pub(super) fn groups(stars: &[Star], near_m: f64) -> Vec<usize> {
    let mut groups: Vec<usize> = Vec::with_capacity(stars.len());
    for (at, star) in stars.iter().enumerate() {
        let is_near = |&first: &usize| (stars[first].position - star.position).norm() <= near_m;
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

/// The nearest twin of each group.
pub(super) fn one_by_group(twins: &[Twin], groups: &[Vec<usize>; 2]) -> Vec<Twin> {
    let mut alone: Vec<Twin> = Vec::new();
    for twin in twins {
        let shares = |other: &Twin| {
            groups[0][other.older] == groups[0][twin.older]
                || groups[1][other.newer] == groups[1][twin.newer]
        };
        if !alone.iter().any(shares) {
            alone.push(*twin);
        }
    }
    alone
}
