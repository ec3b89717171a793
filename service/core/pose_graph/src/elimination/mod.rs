//! Sparse symmetric equations by elimination, clique by clique.

mod amalgamation;
mod clique;
mod dense;
mod marginal;
mod ordering;
mod tree;

pub(crate) use clique::Front;
pub(crate) use marginal::HalfSolution;
pub(crate) use tree::{CliqueTree, Equations, Part, slot};

#[cfg(test)]
mod tests;
