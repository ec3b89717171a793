//! Sparse symmetric equations by elimination, clique by clique.

mod amalgamation;
mod clique;
mod dense;
mod ordering;
mod tree;

pub(crate) use clique::Front;
pub(crate) use tree::{CliqueTree, Equations, Gap, slot};
