//! Incremental relaxation: the optimum is kept up to date as links come.

use std::borrow::Cow;

use nalgebra::Isometry3;

use super::elimination::{CliqueTree, Part, slot};
use super::equations::NormalEquations;
use super::graph::PoseGraph;
use super::marginals::Marginals;

/// How closely a growing graph is kept relaxed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IncrementalSettings {
    /// A node is linearised anew once it has turned by more than this since \[rad\]. What a turn of
    /// φ does to a lever of one metre differs from its linear part by φ²/2 metres.
    pub turn_max_rad: f64,
    /// … or moved by more than this \[m\]. Shifts alone are linear; together with turns they are
    /// not.
    pub shift_max_m: f64,
    /// Changes of a node by less than this are not passed on to the nodes that depend on it \[m\].
    pub neglected_m: f64,
    /// … and turns by less than this \[rad\].
    pub neglected_rad: f64,
    /// Nodes that a step linearises anew at most. When more have moved too far, the newest come
    /// first and the others in later steps: this bounds the work of an update.
    pub relinearised_max: usize,
    /// Steps of an update at most: further ones follow only while nodes are to be linearised anew.
    pub steps_max: usize,
}

impl Default for IncrementalSettings {
    fn default() -> Self {
        Self {
            turn_max_rad: 0.02,
            shift_max_m: 0.5,
            neglected_m: 1e-3,
            neglected_rad: 1e-3,
            relinearised_max: 2000,
            steps_max: 1,
        }
    }
}

/// Work of an update.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Updated {
    /// Nodes that were linearised anew.
    pub n_relinearised: usize,
    /// Nodes whose part of the factor was computed anew.
    pub n_eliminated: usize,
    /// Nodes that were solved for.
    pub n_solved: usize,
}

/// Keeps the nodes of a growing graph where the links cost least (iSAM2: Kaess et al. 2012).
///
/// The factor of the normal equations is a tree of cliques; new links change the cliques of their
/// nodes and the ancestors of these, and only those are ordered, linearised and factored anew.
/// Nodes are linearised anew when they have moved too far from where they last were. The newest
/// nodes are eliminated last, so that the next ones meet few cliques.
///
/// A link's kernel is weighed where the link is linearised, and no kernel is graduated: what is
/// doubtful is better left out until a whole relaxation has judged it. It belongs to one graph;
/// after [`PoseGraph::relax`] a new one is to be begun.
#[derive(Clone, Debug)]
pub struct IncrementalRelaxation {
    settings: IncrementalSettings,
    tree: CliqueTree,
    progress: Progress,
    /// Where each node was when its links were linearised.
    linearised_at: Vec<Isometry3<f64>>,
    /// The motion of each node since.
    solution: Vec<f64>,
}

/// Changes of nodes and cliques since the last update.
#[derive(Clone, Debug, Default)]
struct Progress {
    /// Number of the step, from 1.
    step: u64,
    /// The motion of each node, since it was linearised, that the nodes depending on it know of.
    passed_on: Vec<f64>,
    /// The step in which a node last moved by more than is neglected.
    moved_in: Vec<u64>,
    /// The step that built a clique.
    built_in: Vec<u64>,
    /// Nodes that have moved too far, ascending.
    drifted: Vec<u32>,
}

impl IncrementalRelaxation {
    /// For a graph of which the first [`update`](Self::update) takes all in.
    pub fn new(settings: IncrementalSettings) -> Self {
        Self {
            settings,
            tree: CliqueTree::new(1),
            progress: Progress::default(),
            linearised_at: Vec::new(),
            solution: Vec::new(),
        }
    }

    /// Takes in what has been added to the graph or switched since the last update, and moves the
    /// nodes.
    pub fn update(&mut self, map: &mut PoseGraph) -> Updated {
        let mut updated = Updated::default();
        let mut touched = map.take_touched();
        touched.sort_unstable();
        touched.dedup();
        for step in 0..self.settings.steps_max {
            if step > 0 && self.progress.drifted.is_empty() {
                break;
            }
            self.step(map, &touched, &mut updated);
            touched.clear();
        }
        updated
    }

    /// Covariances of the graph's nodes as of the last update. The graph must be the one that was
    /// updated.
    pub fn marginals<'a>(&'a self, map: &'a PoseGraph) -> Marginals<'a> {
        Marginals {
            map,
            tree: Cow::Borrowed(&self.tree),
        }
    }

    /// One Gauss–Newton step of what is concerned.
    fn step(&mut self, map: &mut PoseGraph, touched: &[u32], updated: &mut Updated) {
        let known = self.linearised_at.len();
        let n = map.nodes.len();
        self.linearised_at
            .extend(map.nodes[known..].iter().map(|node| node.pose));
        self.solution.resize(slot(n, 0, 1), 0.0);
        let progress = &mut self.progress;
        progress.step += 1;
        progress.passed_on.resize(slot(n, 0, 1), 0.0);
        progress.moved_in.resize(n, 0);

        let mut concerned: Vec<u32> = touched.to_vec();
        let n_later = progress
            .drifted
            .len()
            .saturating_sub(self.settings.relinearised_max);
        for node in progress.drifted.split_off(n_later) {
            updated.n_relinearised += 1;
            self.linearised_at[node as usize] = map.nodes[node as usize].pose;
            let own = slot(node as usize, 0, 1)..slot(node as usize + 1, 0, 1);
            self.solution[own.clone()].fill(0.0);
            progress.passed_on[own].fill(0.0);
            concerned.push(node);
            let links = map.links_of[node as usize].iter();
            concerned.extend(links.flat_map(|&(_, others)| others));
        }
        concerned.retain(|&node| (node as usize) < known);
        let mut gap = self.tree.remove(concerned);
        self.tree.enter(n, &mut gap);
        updated.n_eliminated += gap.variables.len();
        let equations = NormalEquations {
            map,
            poses: &self.linearised_at,
            widening: 1.0,
        };
        let built = self.tree.restructure(&equations, &gap, |node| {
            node as usize >= known || touched.binary_search(&node).is_ok()
        });
        self.tree.refactor(&equations, &built);
        progress.built_in.resize(self.tree.n_ids(), 0);
        for clique in built {
            progress.built_in[clique as usize] = progress.step;
        }
        let (settings, linearised_at) = (&self.settings, &self.linearised_at);
        let mut affected = Affected {
            settings,
            map,
            linearised_at,
            progress,
            n_solved: 0,
        };
        self.tree.solve_where(&mut self.solution, &mut affected);
        updated.n_solved += affected.n_solved;
        progress.drifted.sort_unstable();
        progress.drifted.dedup();
    }
}

/// The cliques that are new, and all that depend on nodes which have moved.
struct Affected<'a> {
    settings: &'a IncrementalSettings,
    map: &'a mut PoseGraph,
    linearised_at: &'a [Isometry3<f64>],
    progress: &'a mut Progress,
    n_solved: usize,
}

impl Part for Affected<'_> {
    fn wants(&mut self, clique: u32, separator: &[u32]) -> bool {
        let Progress {
            step,
            moved_in,
            built_in,
            ..
        } = &*self.progress;
        built_in[clique as usize] == *step
            || separator
                .iter()
                .any(|&node| moved_in[node as usize] == *step)
    }

    fn solved(&mut self, node: u32, unknowns: &[f64]) {
        let (settings, progress) = (self.settings, &mut *self.progress);
        let place = &mut self.map.nodes[node as usize];
        let (shift, turn) = place.motion(unknowns);
        if shift.norm() > settings.shift_max_m || turn.norm() > settings.turn_max_rad {
            progress.drifted.push(node);
        }
        let known = &mut progress.passed_on[slot(node as usize, 0, 1)..][..unknowns.len()];
        let (known_shift, known_turn) = place.motion(known);
        let is_passed_on = (shift - known_shift).norm() > settings.neglected_m
            || (turn - known_turn).norm() > settings.neglected_rad;
        if is_passed_on {
            known.copy_from_slice(unknowns);
            progress.moved_in[node as usize] = progress.step;
        }
        place.pose = place.moved(&self.linearised_at[node as usize], unknowns);
        self.n_solved += 1;
    }
}
