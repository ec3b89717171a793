//! Sparse symmetric equations by elimination, clique by clique.

mod amalgamation;
mod clique;
mod dense;
mod marginal;
mod ordering;
mod tree;

pub(crate) use clique::Front;
pub(crate) use dense::dot;
pub(crate) use marginal::HalfSolution;
pub(crate) use tree::{CliqueTree, Equations, slot};

/// The number of what has this index: variables, nodes and links stay far below 2³².
pub(crate) fn number(index: usize) -> u32 {
    u32::try_from(index).expect("fewer than 2³² variables, nodes and links")
}

#[cfg(test)]
mod tests;
