//! In which order variables are eliminated, and the cliques that this gives.
//!
//! Approximate minimum degree on a quotient graph (Amestoy, Davis & Duff 1996): an eliminated
//! variable lives on as an *element*, the set of variables that its elimination has coupled, so the
//! graph never grows. What the elimination of a pivot couples is exactly its column of
//! the factor; the cliques therefore come out of the ordering itself, without a symbolic
//! factorisation behind it.

use super::number;

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
    /// Empty once it is eliminated, or has become part of another group.
    members: Vec<u32>,
    /// Other groups coupled with it by a link, ascending; those gone are removed now and then.
    variables: Vec<u32>,
    /// Elements that it belongs to, ascending.
    elements: Vec<usize>,
    /// An upper bound of the number of variables coupled with it.
    degree: usize,
}

/// The state of the elimination.
struct Quotient {
    groups: Vec<Group>,
    /// Groups of each element, of which each pivot leaves one; empty once used up.
    elements: Vec<Vec<u32>>,
    /// Number of variables of each element.
    sizes: Vec<usize>,
    /// How many of an element's variables lie outside the newest element, and when that was
    /// counted.
    outside: Vec<(usize, usize)>,
    /// The step at which a group was last seen.
    seen: Vec<usize>,
    step: usize,
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
            groups.push(Group {
                members,
                variables,
                degree,
                elements: Vec::new(),
            });
        }
        let mut quotient = Self {
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
                let Group {
                    members, degree, ..
                } = &self.groups[group as usize];
                if !members.is_empty() && *degree == self.least_degree {
                    return Some(group as usize);
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
        used_up.retain(|&element| !self.elements[element].is_empty());
        let mut coupled = Vec::new();
        let parts = used_up
            .iter()
            .map(|&element| std::mem::take(&mut self.elements[element]));
        for group in parts.chain([variables]).flatten() {
            let is_alive = !self.groups[group as usize].members.is_empty();
            if is_alive && self.seen[group as usize] != step {
                self.seen[group as usize] = step;
                coupled.push(group);
            }
        }
        used_up.extend(self.count_outside(&coupled));
        let size = coupled
            .iter()
            .map(|&group| self.groups[group as usize].members.len())
            .sum();
        for &group in &coupled {
            self.update(group as usize, size);
        }
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
        for group in newest.iter().map(|&group| &self.groups[group as usize]) {
            for &element in group
                .elements
                .iter()
                .filter(|&&e| !self.elements[e].is_empty())
            {
                let (outside, counted_at) = &mut self.outside[element];
                if *counted_at != self.step {
                    (*outside, *counted_at) = (self.sizes[element], self.step);
                    met.push(element);
                }
                *outside -= group.members.len();
            }
        }
        met.retain(|&element| self.outside[element].0 == 0);
        for &element in &met {
            self.elements[element].clear();
        }
        met
    }

    /// Brings a group of the newest element up to date; `size` is that element's number of
    /// variables.
    fn update(&mut self, group: usize, size: usize) {
        let mut own = std::mem::take(&mut self.groups[group]);
        own.elements
            .retain(|&element| !self.elements[element].is_empty());
        own.variables.retain(|&other| {
            let is_alive = !self.groups[other as usize].members.is_empty();
            is_alive && self.seen[other as usize] != self.step
        });
        let others = size - own.members.len();
        let by_links: usize = own
            .variables
            .iter()
            .map(|&other| self.groups[other as usize].members.len())
            .sum();
        let by_elements: usize = own
            .elements
            .iter()
            .map(|&element| self.outside[element].0)
            .sum();
        own.elements.push(self.elements.len());
        own.degree = (own.degree + others).min(others + by_links + by_elements);
        own.degree = own.degree.min(self.groups.len() - 1);
        self.groups[group] = own;
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
            let Group {
                variables,
                elements,
                ..
            } = &self.groups[group as usize];
            let sum = variables
                .iter()
                .map(|&v| v as usize)
                .chain(elements.iter().copied())
                .sum();
            by_sum.push((sum, group));
        }
        by_sum.sort_unstable();
        for i in 0..by_sum.len() {
            let (sum, kept) = by_sum[i];
            if self.groups[kept as usize].members.is_empty() {
                continue;
            }
            for &(_, other) in by_sum[i + 1..]
                .iter()
                .take_while(|(other, _)| *other == sum)
            {
                let (a, b) = (&self.groups[kept as usize], &self.groups[other as usize]);
                let is_same =
                    !b.members.is_empty() && a.elements == b.elements && a.variables == b.variables;
                if is_same {
                    let members = std::mem::take(&mut self.groups[other as usize].members);
                    let kept = &mut self.groups[kept as usize];
                    kept.degree -= members.len().min(kept.degree);
                    kept.members.extend(members);
                }
            }
        }
        for &group in &newest {
            if !self.groups[group as usize].members.is_empty() {
                self.offer(group as usize);
            }
        }
    }
}
