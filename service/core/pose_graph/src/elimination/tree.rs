//! The tree of cliques: factorisation, refactorisation of a part, solutions.

use pulp::Arch;

use super::amalgamation::amalgamate;
use super::clique::{Clique, DIMENSION_MAX, Front};
use super::dense::FIXED;
use super::number;
use super::ordering::{self, Problem};

/// No place in a clique.
const NOWHERE: u32 = u32::MAX;

/// Symmetric positive linear equations over variables that share links.
pub(crate) trait Equations {
    /// Right-hand sides.
    const N_RIGHT: usize;

    /// Number of unknowns of a variable, at most [`DIMENSION_MAX`].
    fn dimension(&self, variable: u32) -> usize;

    /// The links of a variable: number of the link and its other variables, one of them twice where
    /// there is no second, and the variable itself for a link that has only one.
    fn links(&self, variable: u32) -> &[(u32, [u32; 2])];

    /// Whether a link couples its variables. A link without weight would only make the factor
    /// denser.
    fn couples(&self, _link: u32) -> bool {
        true
    }

    /// Adds the terms of a variable alone.
    fn add_own(&self, _variable: u32, _front: &mut Front<'_>) {}

    /// Adds the terms of a link.
    fn add(&self, link: u32, front: &mut Front<'_>);
}

/// Which part of the unknowns to solve for.
pub(crate) trait Part {
    /// Whether a clique with this separator belongs to it.
    fn wants(&mut self, clique: u32, separator: &[u32]) -> bool;

    /// Takes the unknowns of a variable that was solved for.
    fn solved(&mut self, variable: u32, unknowns: &[f64]);
}

/// All of them.
struct Everything;

impl Part for Everything {
    fn wants(&mut self, _clique: u32, _separator: &[u32]) -> bool {
        true
    }

    fn solved(&mut self, _variable: u32, _unknowns: &[f64]) {}
}

/// A Cholesky factor as a tree of dense cliques (multifrontal: Duff & Reid 1983; as the Bayes tree
/// of a graph: Kaess et al. 2012).
///
/// A clique's separator lies within its parent's variables, so whatever changes in a clique changes
/// its ancestors and nothing else.
#[derive(Clone, Debug)]
pub(crate) struct CliqueTree {
    /// Cliques by number; numbers of removed ones are used again.
    cliques: Vec<Option<Clique>>,
    free: Vec<u32>,
    /// The clique in which a variable is frontal.
    home: Vec<u32>,
    roots: Vec<u32>,
    /// Scratch: index of a variable in the current clique.
    local: Vec<u32>,
    arch: Arch,
    n_right: usize,
}

/// The variables and subtrees that a removal leaves.
#[derive(Debug, Default)]
pub(crate) struct Gap {
    /// Variables without a clique, in the order in which they were eliminated.
    pub(crate) variables: Vec<u32>,
    /// Cliques without a parent.
    orphans: Vec<u32>,
}

impl CliqueTree {
    /// An empty tree for equations with this many right-hand sides.
    pub(crate) fn new(n_right: usize) -> Self {
        Self {
            cliques: Vec::new(),
            free: Vec::new(),
            home: Vec::new(),
            roots: Vec::new(),
            local: Vec::new(),
            arch: Arch::new(),
            n_right,
        }
    }

    /// The tree over all of the variables 0 … `n` − 1, without numbers.
    pub(crate) fn structured<E: Equations>(equations: &E, n: usize) -> Self {
        let mut tree = Self::new(E::N_RIGHT);
        let mut gap = Gap::default();
        tree.enter(n, &mut gap);
        tree.restructure(equations, &gap, |_| false);
        tree
    }

    /// The same structure, without numbers, for equations with other dimensions.
    pub(crate) fn restructured<E: Equations>(&self, equations: &E) -> Self {
        let mut tree = self.clone_structure(E::N_RIGHT);
        for (own, other) in tree.cliques.iter_mut().zip(&self.cliques) {
            *own = other.as_ref().map(|clique| Clique {
                parent: clique.parent,
                children: clique.children.clone(),
                ..Clique::new(
                    clique.variables.clone(),
                    clique.n_frontal,
                    E::N_RIGHT,
                    |variable| equations.dimension(variable),
                )
            });
        }
        tree
    }

    fn clone_structure(&self, n_right: usize) -> Self {
        Self {
            cliques: vec![None; self.cliques.len()],
            free: self.free.clone(),
            home: self.home.clone(),
            roots: self.roots.clone(),
            local: self.local.clone(),
            arch: self.arch,
            n_right,
        }
    }

    /// Makes room for variables up to `n` − 1; the new ones belong to the gap.
    pub(crate) fn enter(&mut self, n: usize, gap: &mut Gap) {
        let known = self.home.len();
        gap.variables.extend((known..n).map(number));
        self.home.resize(n, NOWHERE);
        self.local.resize(n, NOWHERE);
    }

    /// Numbers of cliques are below this.
    pub(crate) fn n_ids(&self) -> usize {
        self.cliques.len()
    }

    /// All cliques, children before parents.
    pub(crate) fn all(&self) -> Vec<u32> {
        let mut found = Vec::with_capacity(self.cliques.len());
        let mut open = self.roots.clone();
        while let Some(clique) = open.pop() {
            found.push(clique);
            open.extend_from_slice(&self.clique(clique).children);
        }
        found.reverse();
        found
    }

    /// Removes the cliques of these variables and all their ancestors.
    pub(crate) fn remove(&mut self, variables: impl IntoIterator<Item = u32>) -> Gap {
        let mut gap = Gap::default();
        let mut removed: Vec<(u32, Clique)> = Vec::new();
        for variable in variables {
            let mut next = Some(self.home[variable as usize]).filter(|&home| home != NOWHERE);
            while let Some(id) = next {
                let Some(clique) = self.cliques[id as usize].take() else {
                    break;
                };
                next = clique.parent;
                removed.push((id, clique));
            }
        }
        for (id, clique) in &removed {
            self.free.push(*id);
            for &variable in clique.frontal() {
                self.home[variable as usize] = NOWHERE;
                gap.variables.push(variable);
            }
        }
        for (_, clique) in &removed {
            for &child in &clique.children {
                if let Some(child_clique) = &mut self.cliques[child as usize] {
                    child_clique.parent = None;
                    gap.orphans.push(child);
                }
            }
        }
        self.roots
            .retain(|&root| self.cliques[root as usize].is_some());
        gap
    }

    /// Orders the variables of a gap anew and builds their cliques over the orphans. Returns the
    /// new cliques, children before parents; they have no numbers yet.
    pub(crate) fn restructure<E: Equations>(
        &mut self,
        equations: &E,
        gap: &Gap,
        is_last: impl Fn(u32) -> bool,
    ) -> Vec<u32> {
        let problem = self.ordering_problem(equations, gap, is_last);
        let stages = amalgamate(ordering::order(problem), |variable| {
            equations.dimension(gap.variables[variable as usize])
        });
        let ids: Vec<u32> = stages.iter().map(|_| self.new_id()).collect();
        for (stage, &id) in stages.into_iter().zip(&ids) {
            self.place_stage(equations, gap, stage, id, &ids);
        }
        for &id in &ids {
            if let Some(parent) = self.clique(id).parent {
                self.cliques[parent as usize]
                    .as_mut()
                    .expect("parents live")
                    .children
                    .push(id);
            }
        }
        ids
    }

    /// The elimination graph of a gap: its variables by their index in the gap, coupled by links
    /// and by the separators of orphans.
    fn ordering_problem<E: Equations>(
        &mut self,
        equations: &E,
        gap: &Gap,
        is_last: impl Fn(u32) -> bool,
    ) -> Problem {
        for (place, &variable) in gap.variables.iter().enumerate() {
            self.local[variable as usize] = number(place);
        }
        let adjacent = |&variable: &u32| {
            let links = equations.links(variable).iter();
            let couplings = links.filter(|&&(link, _)| equations.couples(link));
            couplings
                .flat_map(|&(_, others)| others)
                .map(|other| self.local[other as usize])
                .filter(|&place| place != NOWHERE)
                .collect()
        };
        let elements = |&orphan: &u32| {
            let separator = self.clique(orphan).separator();
            separator
                .iter()
                .map(|&variable| self.local[variable as usize])
                .collect()
        };
        let problem = Problem {
            adjacent: gap.variables.iter().map(adjacent).collect(),
            elements: gap.orphans.iter().map(elements).collect(),
            last: gap
                .variables
                .iter()
                .map(|&variable| is_last(variable))
                .collect(),
        };
        for &variable in &gap.variables {
            self.local[variable as usize] = NOWHERE;
        }
        problem
    }

    /// Makes the clique of one stage of an ordering, with the orphans below it.
    fn place_stage<E: Equations>(
        &mut self,
        equations: &E,
        gap: &Gap,
        stage: ordering::Stage,
        id: u32,
        ids: &[u32],
    ) {
        let variables = stage.frontal.iter().chain(&stage.separator);
        let variables: Vec<u32> = variables
            .map(|&variable| gap.variables[variable as usize])
            .collect();
        for &variable in &variables[..stage.frontal.len()] {
            self.home[variable as usize] = id;
        }
        let dimension = |variable| equations.dimension(variable);
        let mut clique = Clique::new(variables, stage.frontal.len(), self.n_right, dimension);
        clique.parent = stage.parent.map(|parent| ids[parent]);
        for element in stage.elements {
            let orphan = gap.orphans[element as usize];
            clique.children.push(orphan);
            self.cliques[orphan as usize]
                .as_mut()
                .expect("orphans live")
                .parent = Some(id);
        }
        if clique.parent.is_none() {
            self.roots.push(id);
        }
        self.cliques[id as usize] = Some(clique);
    }

    /// Factors these cliques, given children before parents. Returns the number of directions that
    /// the equations leave free.
    pub(crate) fn refactor<E: Equations>(&mut self, equations: &E, cliques: &[u32]) -> usize {
        let mut n_fixed = 0;
        for &id in cliques {
            let mut clique = self.cliques[id as usize].take().expect("cliques live");
            clique.clear();
            for (place, &variable) in clique.variables.iter().enumerate() {
                self.local[variable as usize] = number(place);
            }
            for place in 0..clique.n_frontal {
                let variable = clique.variables[place];
                let local = &self.local;
                equations.add_own(
                    variable,
                    &mut Front {
                        clique: &mut clique,
                        local,
                    },
                );
                for &(link, others) in equations.links(variable) {
                    // A link belongs to the clique of the first of its variables, and to the first
                    // of them there.
                    let is_first = |other: u32| {
                        let other_place = self.local[other as usize];
                        other_place != NOWHERE && other_place as usize >= place
                    };
                    if others.into_iter().all(is_first) {
                        equations.add(
                            link,
                            &mut Front {
                                clique: &mut clique,
                                local,
                            },
                        );
                    }
                }
            }
            for &child in &clique.children.clone() {
                clique.take_over(self.clique(child), self.n_right, &self.local);
            }
            for &variable in &clique.variables {
                self.local[variable as usize] = NOWHERE;
            }
            n_fixed += clique.factor(self.arch);
            self.cliques[id as usize] = Some(clique);
        }
        n_fixed
    }

    /// Log of the determinant of the equations, without the directions that they leave free.
    pub(crate) fn log_determinant(&self) -> f64 {
        let cliques = self.all().into_iter().map(|id| self.clique(id));
        let sums = cliques.map(|clique| {
            let pivots = (0..clique.n_pivots()).map(|k| clique.pivot(k));
            pivots
                .filter(|pivot| *pivot < FIXED.sqrt())
                .map(f64::ln)
                .sum::<f64>()
        });
        2.0 * sums.sum::<f64>()
    }

    /// Solves for all unknowns: those of a variable stand at [`slot`] of it.
    pub(crate) fn solve(&self) -> Vec<f64> {
        let mut solution = vec![0.0; slot(self.home.len(), 0, self.n_right)];
        self.solve_where(&mut solution, &mut Everything);
        solution
    }

    /// Solves from the roots downwards for the cliques that `part` wants, and skips the subtrees of
    /// others.
    pub(crate) fn solve_where(&self, solution: &mut [f64], part: &mut impl Part) {
        let mut x = Vec::new();
        let mut open = self.roots.clone();
        while let Some(id) = open.pop() {
            let clique = self.clique(id);
            if !part.wants(id, clique.separator()) {
                continue;
            }
            for right in 0..self.n_right {
                x.clear();
                x.resize(clique.n_rows(), 0.0);
                for (&variable, rows) in clique.variables.iter().zip(clique.starts.windows(2)) {
                    let from = slot(variable as usize, right, self.n_right);
                    x[rows[0]..rows[1]].copy_from_slice(&solution[from..from + rows[1] - rows[0]]);
                }
                clique.substitute_back(right, &mut x);
                for (&variable, rows) in clique.frontal().iter().zip(clique.starts.windows(2)) {
                    let to = slot(variable as usize, right, self.n_right);
                    let slots = &mut solution[to..to + rows[1] - rows[0]];
                    slots.copy_from_slice(&x[rows[0]..rows[1]]);
                    part.solved(variable, slots);
                }
            }
            open.extend_from_slice(&clique.children);
        }
    }

    /// bᵀ H⁻¹ b of the first right-hand side: the decrease of χ² at the solution.
    pub(crate) fn explained(&self) -> f64 {
        self.all()
            .into_iter()
            .map(|id| self.clique(id).explained())
            .sum()
    }

    /// The clique in which a variable is frontal, if the tree has the variable.
    pub(super) fn home_of(&self, variable: u32) -> Option<u32> {
        self.home
            .get(variable as usize)
            .copied()
            .filter(|&home| home != NOWHERE)
    }

    pub(super) fn clique(&self, id: u32) -> &Clique {
        self.cliques[id as usize]
            .as_ref()
            .expect("the tree names living cliques only")
    }

    fn new_id(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.cliques.push(None);
            number(self.cliques.len() - 1)
        })
    }
}

/// Where in a solution the unknowns of a variable stand for one of `n_right` right-hand sides.
pub(crate) fn slot(variable: usize, right: usize, n_right: usize) -> usize {
    (variable * n_right + right) * DIMENSION_MAX
}
