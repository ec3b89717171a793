//! Joining stages of an elimination into larger cliques.

use super::ordering::Stage;

/// What a clique costs beside its arithmetic, in multiplications: about a microsecond of
/// bookkeeping.
const CLIQUE_COST: f64 = 2000.0;

/// What it costs to hand one entry on to the parent, in multiplications.
const ENTRY_COST: f64 = 4.0;

/// Joins each stage with its parent where the zeros that are then computed cost less than a clique
/// of its own, and puts separators in the order of elimination. `dimension` is the number of
/// unknowns of a variable.
pub(super) fn amalgamate(stages: Vec<Stage>, dimension: impl Fn(u32) -> usize) -> Vec<Stage> {
    let rows = |variables: &[u32]| variables.iter().map(|&v| dimension(v)).sum::<usize>() as f64;
    let mut n_pivots: Vec<f64> = stages.iter().map(|stage| rows(&stage.frontal)).collect();
    let n_left: Vec<f64> = stages.iter().map(|stage| rows(&stage.separator)).collect();
    let mut joined: Vec<Vec<usize>> = vec![Vec::new(); stages.len()];
    let mut is_joined = vec![false; stages.len()];
    for (own, stage) in stages.iter().enumerate() {
        let Some(parent) = stage.parent else { continue };
        let apart = cost(n_pivots[own], n_left[own]) + cost(n_pivots[parent], n_left[parent]);
        let together = cost(n_pivots[own] + n_pivots[parent], n_left[parent]);
        if together <= apart {
            n_pivots[parent] += n_pivots[own];
            is_joined[own] = true;
            joined[parent].push(own);
        }
    }
    collect(stages, &joined, &is_joined)
}

/// Cost of a clique in multiplications.
fn cost(n_pivots: f64, n_left: f64) -> f64 {
    // Σ (k + n_left)² for k = 1 … n_pivots, without its lower terms.
    let n_rows = n_pivots + n_left;
    let factor = (n_rows.powi(3) - n_left.powi(3)) / 3.0;
    0.5 * factor + 0.5 * ENTRY_COST * n_left * n_left + CLIQUE_COST
}

/// The stages that are left, with all that joined them.
fn collect(mut stages: Vec<Stage>, joined: &[Vec<usize>], is_joined: &[bool]) -> Vec<Stage> {
    let mut new_index = vec![0; stages.len()];
    let mut n_kept = 0;
    for (own, is_joined) in is_joined.iter().enumerate() {
        new_index[own] = n_kept;
        n_kept += usize::from(!is_joined);
    }
    let mut kept = Vec::with_capacity(n_kept);
    for own in 0..stages.len() {
        // Children stand before their parents, so what joined this one is whole already.
        for &child in &joined[own] {
            let mut child = std::mem::take(&mut stages[child]);
            let stage = &mut stages[own];
            child.frontal.append(&mut stage.frontal);
            stage.frontal = child.frontal;
        }
        if !is_joined[own] {
            let mut stage = std::mem::take(&mut stages[own]);
            stage.parent = stage.parent.map(|mut parent| {
                while is_joined[parent] {
                    parent = stages[parent].parent.expect("only a child joins");
                }
                new_index[parent]
            });
            kept.push(stage);
        }
    }
    put_in_order(&mut kept);
    kept
}

/// Sorts the separators by the order of elimination.
fn put_in_order(stages: &mut [Stage]) {
    let n = stages.iter().map(|stage| stage.frontal.len()).sum();
    let mut position = vec![0_usize; n];
    let frontal = stages.iter().flat_map(|stage| &stage.frontal);
    for (place, &variable) in frontal.enumerate() {
        position[variable as usize] = place;
    }
    for stage in stages {
        stage
            .separator
            .sort_unstable_by_key(|&variable| position[variable as usize]);
    }
}
