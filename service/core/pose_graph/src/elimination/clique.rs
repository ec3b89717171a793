//! One clique of the elimination: a dense piece of the factor, and what it leaves to its parent.

use nalgebra::Matrix6;

use super::dense;

/// Unknowns that a variable has at most.
pub(crate) const DIMENSION_MAX: usize = 6;

/// Variables that are eliminated together, the later ones that are coupled with them, and the dense
/// matrix over both.
///
/// With the frontal variables first, the rows and columns of the front are
///
/// ```text
/// | L₁₁            |   frontal
/// | L₂₁  S         |   separator
/// | y₁ᵀ  s₂ᵀ       |   right-hand sides, one row each
/// ```
///
/// L₁₁, L₂₁ and y₁ are the clique's part of the factor and of L⁻¹b; S and s₂ are what its subtree
/// says about the separator, and stay: when only the clique's ancestors change, its whole subtree
/// is taken from here.
#[derive(Clone, Debug)]
pub(super) struct Clique {
    pub(super) parent: Option<u32>,
    pub(super) children: Vec<u32>,
    /// Frontal variables, then the separator, both in the order of elimination.
    pub(super) variables: Vec<u32>,
    pub(super) n_frontal: usize,
    /// First row of each variable, and behind the last one the number of rows without right-hand
    /// sides.
    pub(super) starts: Vec<usize>,
    /// Column-major, see [`dense`]; empty while there are no numbers.
    pub(super) entries: Vec<f64>,
    pub(super) ld: usize,
}

impl Clique {
    /// A clique without numbers.
    pub(super) fn new(
        variables: Vec<u32>,
        n_frontal: usize,
        n_right: usize,
        dimension: impl Fn(u32) -> usize,
    ) -> Self {
        let mut starts = Vec::with_capacity(variables.len() + 1);
        let mut n_rows = 0;
        for &variable in &variables {
            starts.push(n_rows);
            n_rows += dimension(variable);
        }
        starts.push(n_rows);
        let ld = dense::leading_dimension(n_rows + n_right);
        Self {
            parent: None,
            children: Vec::new(),
            variables,
            n_frontal,
            starts,
            entries: Vec::new(),
            ld,
        }
    }

    pub(super) fn frontal(&self) -> &[u32] {
        &self.variables[..self.n_frontal]
    }

    pub(super) fn separator(&self) -> &[u32] {
        &self.variables[self.n_frontal..]
    }

    /// Number of rows of the frontal variables.
    pub(super) fn n_pivots(&self) -> usize {
        self.starts[self.n_frontal]
    }

    /// Number of rows without right-hand sides.
    pub(super) fn n_rows(&self) -> usize {
        self.starts[self.variables.len()]
    }

    /// A diagonal entry of L₁₁.
    pub(super) fn pivot(&self, k: usize) -> f64 {
        self.entries[k * self.ld + k]
    }

    /// Makes all numbers zero.
    pub(super) fn clear(&mut self) {
        self.entries.clear();
        self.entries.resize(self.ld * self.n_rows(), 0.0);
    }

    /// Factors the assembled front. Returns the number of directions about which it says nothing.
    pub(super) fn factor(&mut self) -> usize {
        let (n_pivots, n_rows) = (self.n_pivots(), self.n_rows());
        dense::factor(&mut self.entries, self.ld, n_pivots, n_rows)
    }

    /// Adds what a child leaves.
    pub(super) fn take_over(&mut self, child: &Self, n_right: usize, local: &[u32]) {
        let mut runs: Vec<Run> = Vec::with_capacity(child.variables.len() - child.n_frontal + 1);
        let mut push = |from: usize, to: usize, len: usize| match runs.last_mut() {
            Some(run) if run.to + run.len == to => run.len += len,
            _ => runs.push(Run { from, to, len }),
        };
        for (k, &variable) in child.separator().iter().enumerate() {
            let from = child.starts[child.n_frontal + k];
            let len = child.starts[child.n_frontal + k + 1] - from;
            push(from, self.starts[local[variable as usize] as usize], len);
        }
        push(child.n_rows(), self.n_rows(), n_right);
        let is_in_order = runs.is_sorted_by_key(|run| run.to);
        for (k, columns) in runs.iter().enumerate() {
            let n_columns = columns.len.min(child.n_rows().saturating_sub(columns.from));
            for column in 0..n_columns {
                let source = &child.entries[(columns.from + column) * child.ld..][..child.ld];
                if is_in_order {
                    let target = &mut self.entries[(columns.to + column) * self.ld..][..self.ld];
                    for (skipped, rows) in runs[k..].iter().enumerate() {
                        // Above the diagonal there is nothing.
                        let skipped = if skipped == 0 { column } else { 0 };
                        let len = rows.len - skipped;
                        let from = &source[rows.from + skipped..][..len];
                        for (to, from) in target[rows.to + skipped..][..len].iter_mut().zip(from) {
                            *to += from;
                        }
                    }
                } else {
                    self.take_over_column(&runs[k..], column, source);
                }
            }
        }
    }

    /// Adds one column of a child whose separator has another order here. `column` is the number of
    /// the column within the first run.
    fn take_over_column(&mut self, runs: &[Run], column: usize, source: &[f64]) {
        let own = runs[0].to + column;
        for (skipped, rows) in runs.iter().enumerate() {
            let skipped = if skipped == 0 { column } else { 0 };
            for k in skipped..rows.len {
                let (low, high) = (own.min(rows.to + k), own.max(rows.to + k));
                self.entries[low * self.ld + high] += source[rows.from + k];
            }
        }
    }

    /// Solves for the frontal unknowns of one right-hand side, with those of the separator in place
    /// behind them: `x` holds the unknowns row by row.
    ///
    /// ```text
    /// L₁₁ᵀ x₁ = y₁ − L₂₁ᵀ x₂
    /// ```
    pub(super) fn substitute_back(&self, right: usize, x: &mut [f64]) {
        let n_rows = self.n_rows();
        for k in (0..self.n_pivots()).rev() {
            let column = &self.entries[k * self.ld..][..self.ld];
            let known = interleaved_dot(&column[k + 1..n_rows], &x[k + 1..n_rows]);
            x[k] = (column[n_rows + right] - known) / column[k];
        }
    }

    /// ‖y₁‖² of the first right-hand side.
    pub(super) fn explained(&self) -> f64 {
        let row = self.n_rows();
        (0..self.n_pivots())
            .map(|k| self.entries[k * self.ld + row].powi(2))
            .sum()
    }

    /// Solves L x = b for the frontal unknowns and takes their share from the separator's, in
    /// place.
    pub(super) fn substitute_forward(&self, x: &mut [f64]) {
        let n_rows = self.n_rows();
        for k in 0..self.n_pivots() {
            let column = &self.entries[k * self.ld..][..n_rows];
            let value = x[k] / column[k];
            x[k] = value;
            if value != 0.0 {
                for (x, entry) in x[k + 1..n_rows].iter_mut().zip(&column[k + 1..]) {
                    *x -= value * entry;
                }
            }
        }
    }
}

/// Rows that lie one behind the other both in a child's front and in its parent's.
struct Run {
    from: usize,
    to: usize,
    len: usize,
}

/// The inner product, in four interleaved sums: one would wait for itself.
fn interleaved_dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a_chunks, b_chunks) = (a.chunks_exact(4), b.chunks_exact(4));
    let (a_rest, b_rest) = (a_chunks.remainder(), b_chunks.remainder());
    for (a, b) in a_chunks.zip(b_chunks) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// A front while links are added to it.
#[derive(Debug)]
pub(crate) struct Front<'a> {
    pub(super) clique: &'a mut Clique,
    /// Where in the clique a variable stands.
    pub(super) local: &'a [u32],
}

impl Front<'_> {
    /// Adds to the block of the variables `row` and `column` those rows and columns of `block` that
    /// are named; one for each unknown of the variable. For one variable twice, the lower triangle
    /// of `block` counts.
    pub(crate) fn add(
        &mut self,
        (row, row_axes): (u32, &[usize]),
        (column, column_axes): (u32, &[usize]),
        block: &Matrix6<f64>,
    ) {
        let start = |variable: u32| self.clique.starts[self.local[variable as usize] as usize];
        let (row, column) = (start(row), start(column));
        let ld = self.clique.ld;
        let entries = &mut self.clique.entries;
        for (c, &column_axis) in column_axes.iter().enumerate() {
            for (r, &row_axis) in row_axes.iter().enumerate() {
                let (low, high) = ((row + r).min(column + c), (row + r).max(column + c));
                if row != column || r >= c {
                    entries[low * ld + high] += block[(row_axis, column_axis)];
                }
            }
        }
    }

    /// Adds the named entries of `values` to a right-hand side of a variable.
    pub(crate) fn add_right(
        &mut self,
        variable: u32,
        axes: &[usize],
        right: usize,
        values: &[f64],
    ) {
        let start = self.clique.starts[self.local[variable as usize] as usize];
        let row = self.clique.n_rows() + right;
        for (k, &axis) in axes.iter().enumerate() {
            self.clique.entries[(start + k) * self.clique.ld + row] += values[axis];
        }
    }
}
