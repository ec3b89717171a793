//! What is true of all items of a sparse vector, kept up to date as they come and go.

use crate::SparseVec;

/// Groups that are summarised together: as many as a page of the tree holds.
const FAN: usize = 64;

/// A summary of some items.
pub trait Summary: Clone + PartialEq {
    /// Makes it that of the other's items too.
    fn merge(&mut self, other: &Self);
}

/// A tree of summaries over groups of items that are numbered from 0.
///
/// A change of a group touches one node of each level, and only as far up as something changes: the
/// number of levels grows by one when that of the groups grows 64-fold. A clone shares all nodes.
#[derive(Clone, Debug)]
pub struct SummaryTree<S> {
    /// Summaries of the groups; then of each [`FAN`] of those, and so on up to a single page.
    levels: Vec<SparseVec<S, FAN>>,
}

impl<S> Default for SummaryTree<S> {
    fn default() -> Self {
        Self { levels: Vec::new() }
    }
}

impl<S: Summary> SummaryTree<S> {
    /// The summary of a group; none where it has no items.
    pub fn of_group(&self, group: usize) -> Option<&S> {
        self.levels.first()?.get(group)
    }

    /// The summary of everything.
    pub fn of_all(&self) -> Option<S> {
        merged(self.levels.last()?.iter().map(|(_, summary)| summary))
    }

    /// The items of a group have changed.
    pub fn set(&mut self, mut group: usize, mut summary: Option<S>) {
        for level in 0.. {
            if level == self.levels.len() {
                self.grow();
            }
            let tree = &mut self.levels[level];
            if tree.get(group) == summary.as_ref() {
                return;
            }
            match summary {
                Some(summary) => tree.insert(group, summary, 0),
                None => drop(tree.remove(group, 0)),
            }
            if tree.next_index() <= FAN {
                return;
            }
            group /= FAN;
            summary = merged(tree.iter_page(group).map(|(_, summary)| summary));
        }
    }

    /// Adds a level. The one below had a single page until now, and so far holds what was in that.
    fn grow(&mut self) {
        let mut level = SparseVec::default();
        if let Some(below) = self.levels.last()
            && let Some(summary) = merged(below.iter_page(0).map(|(_, summary)| summary))
        {
            level.insert(0, summary, 0);
        }
        self.levels.push(level);
    }

    /// Bytes of memory that it takes, reserved ones included.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(SparseVec::bytes).sum()
    }
}

/// The summary of all; none of none.
pub fn merged<'a, S: Summary + 'a>(summaries: impl Iterator<Item = &'a S>) -> Option<S> {
    let mut summaries = summaries;
    let mut all = summaries.next()?.clone();
    for summary in summaries {
        all.merge(summary);
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// The least number.
    #[derive(Clone, Debug, PartialEq)]
    struct Least(u32);

    impl Summary for Least {
        fn merge(&mut self, other: &Self) {
            self.0 = self.0.min(other.0);
        }
    }

    proptest! {
        /// Groups come in any order, near and far, as those of a restored map may.
        #[test]
        fn equals_a_scan(
            changes in prop::collection::vec(
                (
                    prop_oneof![0usize..70, 0usize..6000, 0usize..70_000_000],
                    prop::option::weighted(0.7, 0u32..1000),
                ),
                0..80,
            ),
        ) {
            let mut plain = BTreeMap::new();
            let mut tree = SummaryTree::default();
            for (group, least) in changes {
                tree.set(group, least.map(Least));
                match least {
                    Some(least) => plain.insert(group, least),
                    None => plain.remove(&group),
                };
                prop_assert_eq!(tree.of_all(), plain.values().min().map(|least| Least(*least)));
                prop_assert_eq!(tree.of_group(group).cloned(), least.map(Least));
            }
        }
    }
}
