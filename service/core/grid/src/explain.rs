//! Every position in a box that explains a grid code, found without looking at the box.
//!
//! A module with phase φ says that the position is one of the points p(k) = basis · (k + φ), k whole.
//! A position y explains the codes of several modules when it is near a point of each:
//!
//! ```text
//! Σ |y − pₘ(kₘ)|² / sₘ² ≤ tolerance          sₘ spacing, kₘ ∈ Z³, m known
//! ```
//!
//! Within a box of half edges Dᵢ around c, Σ wᵢ (yᵢ − cᵢ)² ≤ η as well, with wᵢ = η / (3 Dᵢ²). The sum of
//! both is least at a y that follows linearly from the points, and what it is there is the squared
//! distance, in R³ᴹ, of a fixed point from a point of a fixed lattice, that of all k together. So the
//! explanations are the lattice points in a ball. The lattice is reduced once for each set of known
//! modules and each size of the box; then a handful of steps enumerates the ball (Schnorr & Euchner
//! 1994, "Lattice basis reduction: improved practical algorithms", section 6). How many depends on how
//! ambiguous the code is in the box, and not on the box itself.

#[cfg(test)]
mod tests;

use std::sync::OnceLock;

use nalgebra::{Matrix3, Point3, Vector3};

use super::reduction::{dot, reduce};
use super::{Extent, GridModules, PartialCode};

/// Most modules that take part: further ones would tell more, but cost more than they save.
const MODULES_MAX: usize = 6;
/// Modules that may take part: there is a reduced lattice for each subset of them that is asked for.
const CANDIDATES_MAX: usize = 8;
/// Fewer known modules explain a code by so many positions that a scan is better.
const MODULES_MIN: usize = 2;
/// Numbers that an enumeration is over: three of each module.
const DIMENSIONS_MAX: usize = 3 * MODULES_MAX;
/// Sums are taken in so many parts at once: each waits for nothing but its own last addition.
const LANES: usize = 4;
/// The share η of the box in the squared distance. As much as a quarter to a half of a typical tolerance
/// makes the ball that has to be searched smallest.
const BOX_SHARE: f64 = 0.006;
/// Rounding of phases, lattices and distances is far below this \[spacings²\].
const SLACK: f64 = 1e-6;
/// The box that all places lie in, and what explains codes in it.
///
/// The lattices are made when they are first asked for; they follow from the modules and the size of
/// the box alone, so it does not matter who asks.
#[derive(Debug)]
pub struct Explainer {
    levels: [i32; 3],
    lattices: Box<[OnceLock<Option<Box<JointLattice>>>]>,
}

/// A number for each dimension, filled up with zeros to whole lanes.
type Row = [f64; DIMENSIONS_MAX.next_multiple_of(LANES)];
/// A [`Row`] of zeros.
const ZEROS: Row = [0.0; DIMENSIONS_MAX.next_multiple_of(LANES)];

/// The lattice of all known modules' points together.
#[derive(Debug)]
struct JointLattice {
    /// The modules that take part.
    modules: Vec<usize>,
    /// Σ 1/sₘ² \[1/m²\].
    stiffness: f64,
    /// The weights w of the box \[1/m²\].
    box_weight: Vector3<f64>,
    /// Row i: what the modules' points \[m\], one after the other, add to coordinate i, in units of the
    /// i-th diagonal.
    coordinates: Vec<Row>,
    /// Row i, column j > i: coordinate i of basis vector j, in units of the i-th diagonal; the other
    /// columns are zero.
    triangle: Vec<Row>,
    /// Squares of the diagonal: coordinate i of basis vector i.
    diagonal_squared: Row,
    /// What each module's point adds to the position.
    weights: Vec<Matrix3<f64>>,
    /// By how much each basis vector moves the position along x, y and z \[m\].
    moves: [Row; 3],
}

/// The positions which one choice of the modules' points explains.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// The position that is explained best.
    pub centre: Point3<f64>,
    /// The tolerance that the ball was found with.
    pub tolerance: f64,
    /// Σ |y − pₘ|²/sₘ² at the centre.
    misfit: f64,
    /// Σ 1/sₘ² \[1/m²\].
    stiffness: f64,
}

/// Whether all explanations were visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// All of them were.
    Complete,
    /// The work would have been more than allowed, or the code or the box is not one to be explained.
    GivenUp,
}

impl Ball {
    /// Squared radius \[m²\] of the ball that holds what is within a tolerance; negative when nothing is.
    /// The sum of squares rises from the centre by `|y − centre|²` Σ 1/sₘ².
    pub fn squared_radius_m2(&self, tolerance: f64) -> f64 {
        (tolerance + SLACK - self.misfit) / self.stiffness
    }
}

impl Explainer {
    /// For boxes of about the size of `extent`.
    pub fn new(extent: &Extent, finest_spacing_m: f64, modules: usize) -> Self {
        let subsets = 1 << modules.min(CANDIDATES_MAX);
        Self {
            levels: extent.levels(finest_spacing_m),
            lattices: std::iter::repeat_with(OnceLock::new)
                .take(subsets)
                .collect(),
        }
    }

    /// Whether it serves boxes of the size of `extent`.
    pub fn serves(&self, extent: &Extent, finest_spacing_m: f64) -> bool {
        self.levels == extent.levels(finest_spacing_m)
    }

    /// Calls `visit` with balls that hold every position y in `extent` whose squared distance from the
    /// code is within tolerance:
    ///
    /// ```text
    /// Σ over known m of dₘ(y)² ≤ tolerance        dₘ torus distance in spacings
    /// ```
    ///
    /// `visit` returns the tolerance for what is left to visit, which must not grow. The best
    /// explanations tend to come first. Gives up after `steps_max` steps of some 20 ns.
    ///
    /// Nothing within tolerance is missed: dₘ(y) is the distance to some point pₘ(kₘ), so (k, y) has a
    /// squared distance of at most tolerance + η, and that of k, which is the least over y, is no larger:
    /// k is enumerated. From k follows the position that the modules alone explain best, without the
    /// box, and around it the ball that holds y. With more modules than take part, those that do have a
    /// sum that is smaller still.
    pub fn explain(
        &self,
        modules: &GridModules,
        code: &PartialCode,
        extent: &Extent,
        tolerance: f64,
        steps_max: u64,
        visit: impl FnMut(&Ball) -> f64,
    ) -> Search {
        let candidates = modules.lattices().len().min(CANDIDATES_MAX);
        let known = code.phases().iter().take(candidates);
        let subset = known
            .enumerate()
            .filter(|(_, phase)| phase.is_some())
            .fold(0, |subset, (module, _)| subset | (1 << module));
        let Some(slot) = self.lattices.get(subset) else {
            return Search::GivenUp;
        };
        let spacing_m = modules.lattices()[0].spacing_m();
        if !extent.is_legal(spacing_m) {
            return Search::GivenUp;
        }
        let lattice = slot.get_or_init(|| JointLattice::new(modules, subset, self.levels));
        let Some(lattice) = lattice else {
            return Search::GivenUp;
        };
        let centre = extent.centre();
        let mut points = ZEROS;
        for (point, &module) in points.chunks_exact_mut(3).zip(&lattice.modules) {
            let Some(phase) = code.phases()[module] else {
                return Search::GivenUp; // cannot be: the subset is that of the known modules
            };
            let at = modules.lattices()[module].basis() * phase.turns() - centre.coords;
            point.copy_from_slice(at.as_slice());
        }
        lattice.enumerate(&points, &centre, tolerance, steps_max, visit)
    }
}

impl JointLattice {
    /// The lattice of a subset of the modules (bit m for module m) for a box with half edges of these
    /// powers of two in finest spacings. None for subsets that are too small.
    fn new(modules: &GridModules, subset: usize, levels: [i32; 3]) -> Option<Box<Self>> {
        let members: Vec<usize> = (0..CANDIDATES_MAX)
            .filter(|module| subset & (1 << module) != 0)
            .take(MODULES_MAX)
            .collect();
        if members.len() < MODULES_MIN {
            return None;
        }
        let lattices: Vec<_> = members.iter().map(|&m| &modules.lattices()[m]).collect();
        let finest_m = modules.lattices()[0].spacing_m();
        let stiffness: f64 = lattices
            .iter()
            .map(|lattice| lattice.spacing_m().powi(-2))
            .sum();
        let box_weight = Vector3::from(levels).map(|level| {
            let half_m = finest_m * f64::from(level).exp2();
            BOX_SHARE / (3.0 * half_m * half_m)
        });
        let weights: Vec<Matrix3<f64>> = lattices
            .iter()
            .map(|lattice| {
                let share = box_weight.map(|w| lattice.spacing_m().powi(-2) / (stiffness + w));
                Matrix3::from_diagonal(&share)
            })
            .collect();
        // What a shift of one module's point by one metre along one axis does to the residuals of all
        // modules and of the box.
        let shifted = |module: usize, by: &Vector3<f64>| -> Vec<f64> {
            let position = weights[module] * by;
            let mut residuals = Vec::with_capacity(3 * lattices.len() + 3);
            for (other, lattice) in lattices.iter().enumerate() {
                let point = if other == module {
                    *by
                } else {
                    Vector3::zeros()
                };
                residuals.extend(((point - position) / lattice.spacing_m()).iter());
            }
            residuals.extend(position.component_mul(&box_weight.map(f64::sqrt)).iter());
            residuals
        };
        let axes = || (0..members.len()).flat_map(|module| (0..3).map(move |axis| (module, axis)));
        let given: Vec<Vec<f64>> = axes()
            .map(|(module, axis)| shifted(module, &lattices[module].basis().column(axis).into()))
            .collect();
        let reduced = reduce(&given);

        let n = given.len();
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
            for (entry, (module, axis)) in row.iter_mut().zip(axes()) {
                *entry = dot(direction, &shifted(module, &Vector3::ith(axis, 1.0))) / diagonal;
            }
            coordinates.push(row);
        }
        let mut moves = [ZEROS; 3];
        for (j, coefficients) in reduced.coefficients.iter().enumerate() {
            let shifts = axes().zip(coefficients);
            let shifts = shifts.map(|((module, axis), times)| {
                weights[module] * lattices[module].basis().column(axis) * *times
            });
            let by: Vector3<f64> = shifts.sum();
            for (row, by) in moves.iter_mut().zip(by.iter()) {
                row[j] = *by;
            }
        }
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

    /// Visits the lattice points in the ball of squared radius tolerance + η, depth first, along each
    /// coordinate from its middle outwards. `points` are relative to `centre`.
    fn enumerate(
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
