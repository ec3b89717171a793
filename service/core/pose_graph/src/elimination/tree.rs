//! The tree of cliques: factorisation, refactorisation of a part, solutions.

use super::amalgamation::amalgamate;
use super::clique::{Clique, DIMENSION_MAX, Front};
use super::dense::FIXED;
use super::number;
use super::ordering;

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

/// A Cholesky factor as a tree of dense cliques (multifrontal: Duff & Reid 1983; as the Bayes tree
/// of a graph: Kaess et al. 2012).
///
/// A clique's separator lies within its parent's variables, so whatever changes in a clique changes
/// its ancestors and nothing else.
#[derive(Clone, Debug)]
pub(crate) struct CliqueTree {
    /// Cliques by number; absent while one is worked on.
    cliques: Vec<Option<Clique>>,
    /// The clique in which a variable is frontal.
    home: Vec<u32>,
    roots: Vec<u32>,
    /// Scratch: index of a variable in the current clique.
    local: Vec<u32>,
    n_right: usize,
}

impl CliqueTree {
    /// The tree over all of the variables 0 … `n` − 1, without numbers.
    pub(crate) fn structured<E: Equations>(equations: &E, n: usize) -> Self {
        let adjacent = |variable| {
            let links = equations.links(variable).iter();
            let couplings = links.filter(|&&(link, _)| equations.couples(link));
            couplings.flat_map(|&(_, others)| others).collect()
        };
        let stages = ordering::order((0..number(n)).map(adjacent).collect());
        let stages = amalgamate(stages, |variable| equations.dimension(variable));
        let mut tree = Self {
            cliques: Vec::with_capacity(stages.len()),
            home: vec![NOWHERE; n],
            roots: Vec::new(),
            local: vec![NOWHERE; n],
            n_right: E::N_RIGHT,
        };
        for stage in stages {
            tree.place_stage(equations, stage);
        }
        tree.know_children();
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
            home: self.home.clone(),
            roots: self.roots.clone(),
            local: self.local.clone(),
            n_right,
        }
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

    /// Makes the clique of the next stage of an ordering.
    fn place_stage<E: Equations>(&mut self, equations: &E, stage: ordering::Stage) {
        let id = number(self.cliques.len());
        let mut variables = stage.frontal;
        let n_frontal = variables.len();
        for &variable in &variables {
            self.home[variable as usize] = id;
        }
        variables.extend(stage.separator);
        let dimension = |variable| equations.dimension(variable);
        let mut clique = Clique::new(variables, n_frontal, self.n_right, dimension);
        clique.parent = stage.parent.map(number);
        if clique.parent.is_none() {
            self.roots.push(id);
        }
        self.cliques.push(Some(clique));
    }

    /// Tells each clique which have it as their parent.
    fn know_children(&mut self) {
        for child in 0..self.cliques.len() {
            if let Some(parent) = self.clique(number(child)).parent {
                let parent = self.cliques[parent as usize].as_mut();
                parent
                    .expect("no clique is worked on")
                    .children
                    .push(number(child));
            }
        }
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
            n_fixed += clique.factor();
            self.cliques[id as usize] = Some(clique);
        }
        n_fixed
    }

    /// Log of the determinant of the equations, without the directions that they leave free.
    pub(crate) fn log_determinant(&self) -> f64 {
        let cliques = self.cliques.iter().flatten();
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
        let mut x = Vec::new();
        let mut open = self.roots.clone();
        while let Some(id) = open.pop() {
            let clique = self.clique(id);
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
                }
            }
            open.extend_from_slice(&clique.children);
        }
        solution
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
}

/// Where in a solution the unknowns of a variable stand for one of `n_right` right-hand sides.
pub(crate) fn slot(variable: usize, right: usize, n_right: usize) -> usize {
    (variable * n_right + right) * DIMENSION_MAX
}
