//! In which order variables are eliminated, and the cliques that this gives.
//!
//! Approximate minimum degree on a quotient graph (Amestoy, Davis & Duff 1996): an eliminated
//! variable lives on as an *element*, the set of variables that its elimination has coupled, so the
//! graph never grows. What the elimination of a pivot couples is exactly its column of
//! the factor; the cliques therefore come out of the ordering itself, without a symbolic
//! factorisation behind it.

use super::number;

/// Entries of a list for each one that goes, from which on those are searched for; in a shorter
/// list all entries are looked at. Source: a search among a thousand takes ten steps, and each
/// removal moves a part of the list.
const SEARCHED_MIN: usize = 16;

/// Variables that are eliminated together.
#[derive(Debug, Default)]
pub(super) struct Stage {
    /// The variables, in the order of their elimination.
    pub(super) frontal: Vec<u32>,
    /// Later variables that are coupled with them.
    pub(super) separator: Vec<u32>,
    /// The stage that takes what this one leaves, by index; `None` at a root.
    pub(super) parent: Option<usize>,
}

/// Orders variables 0, 1, …, given for each those that share a link with it; repetitions and the
/// variable itself do no harm. Stages come children before parents.
pub(super) fn order(adjacent: Vec<Vec<u32>>) -> Vec<Stage> {
    let mut quotient = Quotient::new(adjacent);
    let mut stages: Vec<Stage> = Vec::new();
    while let Some(pivot) = quotient.next_pivot() {
        let mut stage = Stage::default();
        for child in quotient.eliminate(pivot) {
            stages[child].parent = Some(stages.len());
        }
        let element = quotient
            .elements
            .last()
            .expect("the pivot has just left one");
        for &group in element {
            stage
                .separator
                .extend_from_slice(&quotient.groups[group as usize].members);
        }
        stage.frontal = std::mem::take(&mut quotient.groups[pivot].members);
        stages.push(stage);
        quotient.merge_indistinguishable();
    }
    stages
}

/// A variable of the quotient graph, standing for all variables that became indistinguishable from
/// it.
#[derive(Debug, Default)]
struct Group {
    members: Vec<u32>,
    /// Other groups coupled with it by a link and by no element, ascending.
    variables: Vec<u32>,
    /// Number of members of these, and sum of their numbers.
    linked: Linked,
    /// Elements that it belongs to, ascending.
    elements: Vec<usize>,
    /// An upper bound of the number of variables coupled with it.
    degree: usize,
}

impl Group {
    /// Removes a group of so many members from those that this one has links with.
    fn forget(&mut self, other: u32, members: u32) {
        if let Ok(at) = self.variables.binary_search(&other) {
            self.variables.remove(at);
            self.linked.members -= members;
            self.linked.numbers -= other as usize;
        }
    }
}

/// What is counted of the groups that a group has links with.
#[derive(Clone, Copy, Debug, Default)]
struct Linked {
    members: u32,
    numbers: usize,
}

/// The state of the elimination.
struct Quotient {
    groups: Vec<Group>,
    /// Number of members of each group; 0 once it is eliminated, or has become part of another one.
    /// Apart from the groups, since this is asked of many that lie far apart in memory.
    weights: Vec<u32>,
    /// Groups of each element, of which each pivot leaves one; empty once used up.
    elements: Vec<Vec<u32>>,
    /// Number of variables of each element; 0 once it is used up.
    sizes: Vec<u32>,
    /// How many of an element's variables lie outside the newest element, and when that was
    /// counted.
    outside: Vec<(u32, u32)>,
    /// The step at which a group was last seen.
    seen: Vec<u32>,
    step: u32,
    /// Groups by degree; an entry whose group has another degree by now, or is gone, is stale.
    buckets: Vec<Vec<u32>>,
    least_degree: usize,
}

impl Quotient {
    fn new(adjacent: Vec<Vec<u32>>) -> Self {
        let n = adjacent.len();
        let mut groups: Vec<Group> = Vec::with_capacity(n);
        for (mut variables, own) in adjacent.into_iter().zip(0..) {
            variables.sort_unstable();
            variables.dedup();
            variables.retain(|&other| other != own);
            let (members, degree) = (vec![own], variables.len());
            let linked = Linked {
                members: number(degree),
                numbers: variables.iter().map(|&other| other as usize).sum(),
            };
            groups.push(Group {
                members,
                variables,
                linked,
                degree,
                elements: Vec::new(),
            });
        }
        let mut quotient = Self {
            weights: vec![1; n],
            outside: Vec::new(),
            sizes: Vec::new(),
            elements: Vec::new(),
            seen: vec![0; n],
            step: 0,
            buckets: vec![Vec::new(); n],
            least_degree: n,
            groups,
        };
        for group in (0..n).rev() {
            quotient.offer(group);
        }
        quotient
    }

    /// Puts a group where its degree says.
    fn offer(&mut self, group: usize) {
        let degree = self.groups[group].degree;
        self.buckets[degree].push(number(group));
        self.least_degree = self.least_degree.min(degree);
    }

    /// A group of least degree.
    fn next_pivot(&mut self) -> Option<usize> {
        while self.least_degree < self.buckets.len() {
            while let Some(group) = self.buckets[self.least_degree].pop() {
                let group = group as usize;
                if self.weights[group] > 0 && self.groups[group].degree == self.least_degree {
                    return Some(group);
                }
            }
            self.least_degree += 1;
        }
        None
    }

    /// Replaces a pivot by the element of all that is coupled with it. Returns the elements used up
    /// by that.
    fn eliminate(&mut self, pivot: usize) -> Vec<usize> {
        self.step += 1;
        let step = self.step;
        self.seen[pivot] = step;
        let variables = std::mem::take(&mut self.groups[pivot].variables);
        let mut used_up = std::mem::take(&mut self.groups[pivot].elements);
        used_up.retain(|&element| self.sizes[element] > 0);
        let mut coupled = Vec::new();
        let parts = used_up.iter().map(|&element| {
            self.sizes[element] = 0;
            std::mem::take(&mut self.elements[element])
        });
        for group in parts.chain([variables]).flatten() {
            let seen = &mut self.seen[group as usize];
            if self.weights[group as usize] > 0 && *seen != step {
                *seen = step;
                coupled.push(group);
            }
        }
        used_up.extend(self.count_outside(&coupled));
        let size = coupled.iter().map(|&group| self.weights[group as usize]);
        let size: u32 = size.sum();
        for &group in &coupled {
            self.update(group as usize, pivot, &coupled, size);
        }
        self.weights[pivot] = 0;
        self.elements.push(coupled);
        self.sizes.push(size);
        self.outside.push((0, 0));
        used_up
    }

    /// Counts for each element that the newest one meets how many of its variables lie outside that
    /// one. Those without any say nothing that the newest does not say: they are used up too, and
    /// returned.
    fn count_outside(&mut self, newest: &[u32]) -> Vec<usize> {
        let mut met = Vec::new();
        for &group in newest {
            let weight = self.weights[group as usize];
            for &element in &self.groups[group as usize].elements {
                let size = self.sizes[element];
                if size == 0 {
                    continue;
                }
                let (outside, counted_at) = &mut self.outside[element];
                if *counted_at != self.step {
                    (*outside, *counted_at) = (size, self.step);
                    met.push(element);
                }
                *outside -= weight;
            }
        }
        met.retain(|&element| self.outside[element].0 == 0);
        for &element in &met {
            self.elements[element].clear();
            self.sizes[element] = 0;
        }
        met
    }

    /// Brings a group of the newest element, which a pivot leaves, up to date; `size` is that
    /// element's number of variables.
    fn update(&mut self, group: usize, pivot: usize, newest: &[u32], size: u32) {
        let most = self.groups.len() - 1;
        let own = &mut self.groups[group];
        let mut by_elements = 0_usize;
        own.elements.retain(|&element| {
            let is_there = self.sizes[element] > 0;
            if is_there {
                by_elements += self.outside[element].0 as usize;
            }
            is_there
        });
        // The newest element takes the place of links. Of the thousand links of a landmark these
        // are few, and looking at all of them each time would take as long as all else.
        if SEARCHED_MIN * newest.len() < own.variables.len() {
            for &other in newest.iter().chain([&number(pivot)]) {
                own.forget(other, self.weights[other as usize]);
            }
        } else {
            let linked = &mut own.linked;
            own.variables.retain(|&other| {
                let is_apart = self.seen[other as usize] != self.step;
                if !is_apart {
                    linked.members -= self.weights[other as usize];
                    linked.numbers -= other as usize;
                }
                is_apart
            });
        }
        let others = size - self.weights[group];
        own.elements.push(self.elements.len());
        let (others, by_links) = (others as usize, own.linked.members as usize);
        let bound = others + by_links + by_elements;
        own.degree = (own.degree + others).min(bound).min(most);
    }

    /// Makes a group part of another one that is coupled with the same others.
    fn merge(&mut self, kept: usize, other: u32) {
        let Group {
            members, variables, ..
        } = std::mem::take(&mut self.groups[other as usize]);
        for variable in variables {
            // The other one has all of its members from now on.
            self.groups[variable as usize].forget(other, 0);
        }
        self.weights[kept] += std::mem::take(&mut self.weights[other as usize]);
        let kept = &mut self.groups[kept];
        kept.degree -= members.len().min(kept.degree);
        kept.members.extend(members);
    }

    /// Merges groups of the newest element that are coupled with the same others, and offers what
    /// remains.
    fn merge_indistinguishable(&mut self) {
        let newest = self
            .elements
            .last()
            .expect("called after an elimination")
            .clone();
        let mut by_sum: Vec<(usize, u32)> = Vec::with_capacity(newest.len());
        for &group in &newest {
            let own = &self.groups[group as usize];
            let sum = own.linked.numbers + own.elements.iter().sum::<usize>();
            by_sum.push((sum, group));
        }
        by_sum.sort_unstable();
        for i in 0..by_sum.len() {
            let (sum, kept) = by_sum[i];
            if self.weights[kept as usize] == 0 {
                continue;
            }
            for &(_, other) in by_sum[i + 1..]
                .iter()
                .take_while(|(other, _)| *other == sum)
            {
                let (a, b) = (&self.groups[kept as usize], &self.groups[other as usize]);
                let is_same = self.weights[other as usize] > 0
                    && a.elements == b.elements
                    && a.variables == b.variables;
                if is_same {
                    self.merge(kept as usize, other);
                }
            }
        }
        for &group in &newest {
            if self.weights[group as usize] > 0 {
                self.offer(group as usize);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    /// A chain of poses with landmarks that many of them have seen, and links across.
    fn sighted(poses: u32, seen: &[(u32, u32)], across: &[(u32, u32)]) -> Vec<BTreeSet<u32>> {
        let landmark = |number: u32| poses + number % 3;
        let chain = (1..poses).map(|pose| (pose - 1, pose));
        let seen = seen
            .iter()
            .map(|(pose, number)| (pose % poses, landmark(*number)));
        let across = across.iter().map(|(a, b)| (a % poses, b % poses));
        let mut adjacent = vec![BTreeSet::new(); poses as usize + 3];
        for (a, b) in chain.chain(seen).chain(across).filter(|(a, b)| a != b) {
            adjacent[a as usize].insert(b);
            adjacent[b as usize].insert(a);
        }
        adjacent
    }

    /// Eliminates a variable in a plain graph; answers what it was coupled with.
    fn eliminate(graph: &mut [BTreeSet<u32>], pivot: u32) -> BTreeSet<u32> {
        let coupled = std::mem::take(&mut graph[pivot as usize]);
        for &own in &coupled {
            let others = coupled.iter().filter(|other| **other != own);
            graph[own as usize].extend(others);
            graph[own as usize].remove(&pivot);
        }
        coupled
    }

    fn lists(graph: &[BTreeSet<u32>]) -> Vec<Vec<u32>> {
        graph
            .iter()
            .map(|own| own.iter().copied().collect())
            .collect()
    }

    proptest! {
        #[test]
        fn stages_are_those_of_plain_elimination(
            poses in 100..200_u32,
            seen in prop::collection::vec(any::<(u32, u32)>(), 0..400),
            across in prop::collection::vec(any::<(u32, u32)>(), 0..20),
        ) {
            let mut plain = sighted(poses, &seen, &across);
            let mut eliminated = 0;
            for stage in order(lists(&plain)) {
                let mut rest: BTreeSet<u32> = stage.frontal.iter().copied().collect();
                for pivot in stage.frontal {
                    rest.remove(&pivot);
                    let expected: BTreeSet<u32> = { stage.separator.iter() }
                        .chain(&rest)
                        .copied()
                        .collect();
                    prop_assert_eq!(eliminate(&mut plain, pivot), expected);
                    eliminated += 1;
                }
            }
            prop_assert_eq!(eliminated, plain.len());
        }

        #[test]
        fn what_is_counted_of_links_is_what_there_is(
            poses in 100..200_u32,
            seen in prop::collection::vec(any::<(u32, u32)>(), 0..400),
            across in prop::collection::vec(any::<(u32, u32)>(), 0..20),
        ) {
            let mut quotient = Quotient::new(lists(&sighted(poses, &seen, &across)));
            while let Some(pivot) = quotient.next_pivot() {
                quotient.eliminate(pivot);
                quotient.groups[pivot].members.clear();
                quotient.merge_indistinguishable();
                for (group, weight) in quotient.groups.iter().zip(&quotient.weights) {
                    prop_assert_eq!(group.members.len(), *weight as usize);
                    if *weight == 0 {
                        continue;
                    }
                    let weights = { group.variables.iter() }
                        .map(|other| quotient.weights[*other as usize]);
                    prop_assert!(weights.clone().all(|weight| weight > 0), "none is gone");
                    prop_assert_eq!(group.linked.members, weights.sum::<u32>());
                    let numbers = group.variables.iter().map(|other| *other as usize);
                    prop_assert_eq!(group.linked.numbers, numbers.sum::<usize>());
                }
            }
        }
    }
}
