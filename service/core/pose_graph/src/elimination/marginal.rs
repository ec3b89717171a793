//! Parts of the inverse, from the factor.

use std::collections::BTreeMap;

use nalgebra::Matrix6;

use super::clique::DIMENSION_MAX;
use super::dense::{FIXED, dot};
use super::tree::CliqueTree;

/// L⁻¹ E for the unit columns E of one variable: it is zero outside the way from the variable's
/// clique to the root.
///
/// H⁻¹ = L⁻ᵀ L⁻¹, so the block of the inverse for two variables is the product of theirs.
#[derive(Debug)]
pub(crate) struct HalfSolution {
    /// For each clique on the way, and each column, the values of its frontal unknowns.
    parts: BTreeMap<u32, Vec<Vec<f64>>>,
}

impl CliqueTree {
    /// The half solution of a variable with `dimension` unknowns; `None` if the equations leave it
    /// free, or the tree has no such variable.
    ///
    /// Its cost is that of one column of each clique on the way to the root.
    pub(crate) fn half_solution(&self, variable: u32, dimension: usize) -> Option<HalfSolution> {
        let mut parts: BTreeMap<u32, Vec<Vec<f64>>> = BTreeMap::new();
        for column in 0..dimension {
            let mut open = BTreeMap::from([(variable, unit(column))]);
            let mut next = Some(self.home_of(variable)?);
            while let Some(id) = next {
                let clique = self.clique(id);
                let mut x = vec![0.0; clique.n_rows()];
                for (variable, rows) in clique.variables.iter().zip(clique.starts.windows(2)) {
                    if let Some(values) = open.remove(variable) {
                        x[rows[0]..rows[1]].copy_from_slice(&values[..rows[1] - rows[0]]);
                    }
                }
                clique.substitute_forward(&mut x);
                let separator = clique.separator().iter();
                for (&variable, rows) in separator.zip(clique.starts[clique.n_frontal..].windows(2))
                {
                    let mut values = [0.0; DIMENSION_MAX];
                    values[..rows[1] - rows[0]].copy_from_slice(&x[rows[0]..rows[1]]);
                    open.insert(variable, values);
                }
                x.truncate(clique.n_pivots());
                let is_free = x
                    .iter()
                    .enumerate()
                    .any(|(k, x)| *x != 0.0 && clique.pivot(k) >= FIXED);
                if is_free {
                    return None;
                }
                parts.entry(id).or_default().push(x);
                next = clique.parent;
            }
        }
        Some(HalfSolution { parts })
    }
}

impl HalfSolution {
    /// The block of the inverse with the rows of this variable and the columns of another.
    pub(crate) fn product(&self, other: &Self) -> Matrix6<f64> {
        let mut product = Matrix6::zeros();
        for (clique, columns) in &self.parts {
            let Some(other_columns) = other.parts.get(clique) else {
                continue;
            };
            for (r, a) in columns.iter().enumerate() {
                for (c, b) in other_columns.iter().enumerate() {
                    product[(r, c)] += dot(a, b);
                }
            }
        }
        product
    }
}

fn unit(row: usize) -> [f64; DIMENSION_MAX] {
    let mut unit = [0.0; DIMENSION_MAX];
    unit[row] = 1.0;
    unit
}
