//! The joint lattice of several modules, and its points in a ball.
//!
//! The lattice is reduced once; a handful of steps then enumerates the ball (Schnorr & Euchner
//! 1994, "Lattice basis reduction: improved practical algorithms", section 6).

use nalgebra::{Matrix3, Point3, Vector3};

use crate::GridModules;
use crate::inner_product::dot;
use crate::reduction::reduce;
use crate::residuals::{BOX_SHARE, Residuals};

/// Most modules that take part: further ones would narrow the search less than they cost.
const MODULES_MAX: usize = 6;
/// Fewest known modules: fewer match a code at so many positions that a scan is faster.
pub(crate) const MODULES_MIN: usize = 2;
/// Dimensions of the lattice: three for each module.
const DIMENSIONS_MAX: usize = 3 * MODULES_MAX;
/// Partial sums of a product, which do not wait for one another.
const LANES: usize = 4;
/// Bound of the rounding of phases, lattices and distances \[spacings²\].
const SLACK: f64 = 1e-6;

/// A number for each dimension, filled up with zeros to whole lanes.
pub(crate) type Row = [f64; DIMENSIONS_MAX.next_multiple_of(LANES)];
/// A [`Row`] of zeros.
pub(crate) const ZEROS: Row = [0.0; DIMENSIONS_MAX.next_multiple_of(LANES)];

/// The lattice of all known modules' points together.
#[derive(Debug)]
pub(crate) struct JointLattice {
    /// The modules that take part.
    pub(crate) modules: Vec<usize>,
    /// Σ 1/sₘ² \[1/m²\].
    stiffness: f64,
    /// The weights w of the box \[1/m²\].
    box_weight: Vector3<f64>,
    /// Row i: what the modules' points \[m\], one after the other, add to coordinate i, in units of
    /// the i-th diagonal.
    coordinates: Vec<Row>,
    /// Row i, column j > i: coordinate i of basis vector j, in units of the i-th diagonal; the
    /// other columns are zero.
    triangle: Vec<Row>,
    /// Squares of the diagonal: coordinate i of basis vector i.
    diagonal_squared: Row,
    /// What each module's point adds to the position.
    weights: Vec<Matrix3<f64>>,
    /// By how much each basis vector moves the position along x, y and z \[m\].
    moves: [Row; 3],
}

/// The positions that match one choice of the modules' points.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// The position that matches best.
    pub centre: Point3<f64>,
    /// The tolerance that the ball was found with.
    pub tolerance: f64,
    /// Σ |y − pₘ|²/sₘ² at the centre.
    misfit: f64,
    /// Σ 1/sₘ² \[1/m²\].
    stiffness: f64,
}

/// Whether all matching positions were visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// All were visited.
    Complete,
    /// The work exceeded its bound, or the code or the box is not one for this search.
    GivenUp,
}

impl Ball {
    /// Squared radius \[m²\] of the ball that holds what is within a tolerance; negative when
    /// nothing is. The sum of squares rises from the centre by `|y − centre|²` Σ 1/sₘ².
    pub fn squared_radius_m2(&self, tolerance: f64) -> f64 {
        (tolerance + SLACK - self.misfit) / self.stiffness
    }
}

impl JointLattice {
    /// The lattice of a subset of the modules (bit m for module m) for a box with half edges of
    /// these powers of two in finest spacings. None for subsets that are too small.
    pub(crate) fn new(modules: &GridModules, subset: usize, levels: [i32; 3]) -> Option<Box<Self>> {
        let members: Vec<usize> = (0..usize::BITS as usize)
            .filter(|module| subset & (1 << module) != 0)
            .take(MODULES_MAX)
            .collect();
        if members.len() < MODULES_MIN {
            return None;
        }
        let residuals = Residuals::new(modules, &members, levels);
        let reduced = reduce(&residuals.basis());
        let n = reduced.vectors.len();
        let mut triangle = Vec::with_capacity(n);
        let mut diagonal_squared = ZEROS;
        let mut coordinates = Vec::with_capacity(n);
        for (i, direction) in reduced.directions.iter().enumerate() {
            let diagonal = dot(direction, &reduced.vectors[i]);
            diagonal_squared[i] = diagonal * diagonal;
            let mut row = ZEROS;
            for (entry, vector) in row.iter_mut().zip(&reduced.vectors).skip(i + 1) {
                *entry = dot(direction, vector) / diagonal;
            }
            triangle.push(row);
            let mut row = ZEROS;
            for (entry, (module, axis)) in row.iter_mut().zip(residuals.axes()) {
                let shifted = residuals.shifted(module, &Vector3::ith(axis, 1.0));
                *entry = dot(direction, &shifted) / diagonal;
            }
            coordinates.push(row);
        }
        let mut moves = [ZEROS; 3];
        for (j, coefficients) in reduced.coefficients.iter().enumerate() {
            let by = residuals.moved(coefficients);
            for (row, by) in moves.iter_mut().zip(by.iter()) {
                row[j] = *by;
            }
        }
        let Residuals {
            stiffness,
            box_weight,
            weights,
            ..
        } = residuals;
        Some(Box::new(Self {
            stiffness,
            box_weight,
            coordinates,
            triangle,
            diagonal_squared,
            moves,
            weights,
            modules: members,
        }))
    }

    /// Visits the lattice points in the ball of squared radius tolerance + η, depth first, along
    /// each coordinate from its middle outwards. `points` are relative to `centre`.
    pub(crate) fn enumerate(
        &self,
        points: &Row,
        centre: &Point3<f64>,
        tolerance: f64,
        steps_max: u64,
        mut visit: impl FnMut(&Ball) -> f64,
    ) -> Search {
        let n = self.triangle.len();
        let mut target = ZEROS;
        for (target, row) in target.iter_mut().zip(&self.coordinates) {
            *target = row_dot(row, points);
        }
        // The position relative to the centre, if all whole coordinates are zero.
        let start = self.weights.iter().zip(points.chunks_exact(3));
        let start = start.map(|(weight, point)| weight * Vector3::from_column_slice(point));
        let start: Vector3<f64> = start.sum();

        // Whole coordinate, middle, next step and cost of what comes after, for each depth.
        let mut whole = ZEROS;
        let mut middle = ZEROS;
        let mut step = ZEROS;
        let mut after = ZEROS;
        let mut tolerance = tolerance;
        let mut depth = n - 1;
        middle[depth] = -target[depth];
        (whole[depth], step[depth]) = outwards(middle[depth]);
        for _ in 0..steps_max {
            let off = whole[depth] - middle[depth];
            let cost = after[depth] + self.diagonal_squared[depth] * off * off;
            if cost <= tolerance + BOX_SHARE + SLACK {
                if depth > 0 {
                    depth -= 1;
                    after[depth] = cost;
                    let shift = row_dot(&self.triangle[depth], &whole);
                    middle[depth] = -(target[depth] + shift);
                    (whole[depth], step[depth]) = outwards(middle[depth]);
                    continue;
                }
                let moved = Vector3::from_fn(|axis, _| row_dot(&self.moves[axis], &whole));
                let within_box = start + moved;
                // Without the box's pull the modules' best position lies a little farther out.
                let pull = self.box_weight.component_mul(&within_box);
                let ball = Ball {
                    centre: centre + within_box + pull / self.stiffness,
                    tolerance,
                    misfit: cost - within_box.dot(&pull) - pull.norm_squared() / self.stiffness,
                    stiffness: self.stiffness,
                };
                tolerance = visit(&ball).min(tolerance);
            } else {
                depth += 1;
                if depth == n {
                    return Search::Complete;
                }
            }
            whole[depth] += step[depth];
            step[depth] = -step[depth] - step[depth].signum();
        }
        Search::GivenUp
    }
}

/// Σ aᵢ bᵢ.
fn row_dot(a: &Row, b: &Row) -> f64 {
    let mut parts = [0.0; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for lane in 0..LANES {
            parts[lane] += a[lane] * b[lane];
        }
    }
    (parts[0] + parts[1]) + (parts[2] + parts[3])
}

/// The whole number nearest to a middle, and the step to the next nearest one.
fn outwards(middle: f64) -> (f64, f64) {
    let whole = middle.round();
    (whole, if middle < whole { -1.0 } else { 1.0 })
}
