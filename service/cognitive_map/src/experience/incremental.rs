//! Keeping a growing map relaxed, link by link.

use nalgebra::Isometry3;

use super::elimination::{CliqueTree, slot};
use super::equations::NormalEquations;
use super::map::ExperienceMap;

/// How closely a growing map is kept relaxed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IncrementalSettings {
    /// A node is linearised anew once it has turned by more than this since \[rad\].
    pub turn_max_rad: f64,
    /// … or moved by more than this \[m\].
    pub shift_max_m: f64,
    /// Changes of a node by less than this are not passed on to the nodes that depend on it \[m\].
    pub neglected_m: f64,
    /// … and turns by less than this \[rad\].
    pub neglected_rad: f64,
    /// Steps of an update at most: further ones follow only while nodes are to be linearised anew.
    pub steps_max: usize,
}

impl Default for IncrementalSettings {
    fn default() -> Self {
        Self {
            turn_max_rad: 0.05,
            shift_max_m: 0.5,
            neglected_m: 1e-3,
            neglected_rad: 1e-3,
            steps_max: 1,
        }
    }
}

/// What an update did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Updated {
    /// Nodes that were linearised anew.
    pub n_relinearised: usize,
    /// Nodes whose part of the factor was computed anew.
    pub n_eliminated: usize,
    /// Nodes that were solved for.
    pub n_solved: usize,
}

/// Keeps the nodes of a growing map where the links cost least (iSAM2: Kaess et al. 2012).
///
/// The factor of the normal equations is a tree of cliques; new links change the cliques of their nodes and the
/// ancestors of these, and only those are ordered, linearised and factored anew. Nodes are linearised anew when they
/// have moved too far from where they last were.
#[derive(Clone, Debug)]
pub struct IncrementalRelaxation {
    settings: IncrementalSettings,
    tree: CliqueTree,
    /// Where each node was when its links were linearised.
    linearised_at: Vec<Isometry3<f64>>,
    /// The motion of each node since.
    solution: Vec<f64>,
    /// The motion that the nodes depending on a node know of.
    passed_on: Vec<f64>,
    /// Nodes that have moved too far, ascending.
    drifted: Vec<u32>,
}

impl IncrementalRelaxation {
    /// For a map of which the first [`update`](Self::update) takes all in.
    pub fn new(settings: IncrementalSettings) -> Self {
        Self {
            settings,
            tree: CliqueTree::new(1),
            linearised_at: Vec::new(),
            solution: Vec::new(),
            passed_on: Vec::new(),
            drifted: Vec::new(),
        }
    }

    /// Takes in what has been added to the map or switched since the last update, and moves the nodes.
    pub fn update(&mut self, map: &mut ExperienceMap) -> Updated {
        let mut updated = Updated::default();
        let mut touched = map.take_touched();
        for step in 0..self.settings.steps_max {
            if step > 0 && self.drifted.is_empty() {
                break;
            }
            self.step(map, &touched, &mut updated);
            touched.clear();
        }
        updated
    }

    /// One Gauss–Newton step of what is concerned.
    fn step(&mut self, map: &mut ExperienceMap, touched: &[u32], updated: &mut Updated) {
        let known = self.linearised_at.len();
        let n = map.nodes.len();
        self.linearised_at
            .extend(map.nodes[known..].iter().map(|node| node.pose));
        self.solution.resize(slot(n, 0, 1), 0.0);
        self.passed_on.resize(slot(n, 0, 1), 0.0);

        let mut concerned: Vec<u32> = touched.to_vec();
        for node in std::mem::take(&mut self.drifted) {
            updated.n_relinearised += 1;
            self.linearised_at[node as usize] = map.nodes[node as usize].pose;
            let own = slot(node as usize, 0, 1)..slot(node as usize + 1, 0, 1);
            self.solution[own.clone()].fill(0.0);
            self.passed_on[own].fill(0.0);
            concerned.push(node);
            concerned.extend(map.links_of[node as usize].iter().map(|&(_, other)| other));
        }
        let mut gap = self.tree.remove(
            concerned
                .into_iter()
                .filter(|&node| (node as usize) < known),
        );
        self.tree.enter(n, &mut gap);
        updated.n_eliminated += gap.variables.len();
        let equations = NormalEquations {
            map,
            poses: &self.linearised_at,
            widening: 1.0,
        };
        let rebuilt = self.tree.restructure(&equations, gap, |node| {
            node as usize >= known || touched.contains(&node)
        });
        self.tree.refactor(&equations, &rebuilt);
        updated.n_solved += self.solve(map, &rebuilt);
    }

    /// Solves for the nodes of these cliques and for all that depend on nodes which have moved. Returns the number
    /// of nodes that were solved for.
    fn solve(&mut self, map: &mut ExperienceMap, rebuilt: &[u32]) -> usize {
        let Self {
            settings,
            tree,
            linearised_at,
            solution,
            passed_on,
            drifted,
        } = self;
        let mut is_rebuilt = vec![false; tree.n_ids()];
        for &clique in rebuilt {
            is_rebuilt[clique as usize] = true;
        }
        let has_moved = std::cell::RefCell::new(vec![false; map.nodes.len()]);
        let mut n_solved = 0;
        tree.solve_where(
            solution,
            |clique, separator| {
                is_rebuilt[clique as usize]
                    || separator
                        .iter()
                        .any(|&node| has_moved.borrow()[node as usize])
            },
            |node, _, unknowns| {
                let place = &mut map.nodes[node as usize];
                let (shift, turn) = place.motion(unknowns);
                if shift.norm() > settings.shift_max_m || turn.norm() > settings.turn_max_rad {
                    drifted.push(node);
                }
                let known = &mut passed_on[slot(node as usize, 0, 1)..][..unknowns.len()];
                let (known_shift, known_turn) = place.motion(known);
                let is_news = (shift - known_shift).norm() > settings.neglected_m
                    || (turn - known_turn).norm() > settings.neglected_rad;
                if is_news {
                    known.copy_from_slice(unknowns);
                    has_moved.borrow_mut()[node as usize] = true;
                }
                place.pose = place.moved(&linearised_at[node as usize], unknowns);
                n_solved += 1;
            },
        );
        drifted.sort_unstable();
        n_solved
    }
}
