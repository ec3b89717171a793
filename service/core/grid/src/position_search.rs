//! All positions in a box that match a grid code, by enumeration of lattice points in a ball.
//!
//! A module with phase φ says that the position is one of the points p(k) = basis · (k + φ), k
//! whole. A position y matches the codes of several modules when it is near a point of each:
//!
//! ```text
//! Σ |y − pₘ(kₘ)|² / sₘ² ≤ tolerance          sₘ spacing, kₘ ∈ Z³, m known
//! ```
//!
//! Within a box of half edges Dᵢ around c, Σ wᵢ (yᵢ − cᵢ)² ≤ η as well, with wᵢ = η / (3 Dᵢ²). The
//! sum of both has its minimum at a y that follows linearly from the points. Its value there is the
//! squared distance, in R³ᴹ, of a fixed point from a point of a fixed lattice, the joint lattice of
//! all k. The matches are therefore the lattice points in a ball, a closest-vector problem. Its
//! cost depends on how ambiguous the code is in the box, and not on the size of the box.

#[cfg(test)]
mod tests;

use std::sync::OnceLock;

use crate::joint_lattice::{Ball, JointLattice, Search, ZEROS};
use crate::{Extent, GridModules, PartialCode};

/// Modules that may take part: there is a reduced lattice for each subset of them that is asked
/// for.
const CANDIDATES_MAX: usize = 8;

/// A search for boxes of about one size.
///
/// The lattices are made at first use. They follow from the modules and the size of the box alone,
/// so that it does not matter whose use is first.
#[derive(Debug)]
pub struct PositionSearch {
    levels: [i32; 3],
    lattices: Box<[OnceLock<Option<Box<JointLattice>>>]>,
}

impl PositionSearch {
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

    /// Whether it was made for boxes of the size of `extent`.
    pub fn fits(&self, extent: &Extent, finest_spacing_m: f64) -> bool {
        self.levels == extent.levels(finest_spacing_m)
    }

    /// Calls `visit` with balls that hold every position y in `extent` whose squared distance from
    /// the code is within tolerance:
    ///
    /// ```text
    /// Σ over known m of dₘ(y)² ≤ tolerance        dₘ torus distance in spacings
    /// ```
    ///
    /// `visit` returns the tolerance for what is left to visit, which must not grow. The best
    /// matches tend to come first. Gives up after `steps_max` steps of some 20 ns.
    ///
    /// Nothing within tolerance is missed: dₘ(y) is the distance to some point pₘ(kₘ), so (k, y)
    /// has a squared distance of at most tolerance + η, and that of k, which is the least over y,
    /// is no larger: k is enumerated. From k follows the position that matches the modules alone
    /// best, without the box, and around it the ball that holds y. With more modules than take
    /// part, those that do have a sum that is smaller still.
    pub fn run(
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
                return Search::GivenUp; // unreachable: the subset is that of the known modules
            };
            let at = modules.lattices()[module].basis() * phase.turns() - centre.coords;
            point.copy_from_slice(at.as_slice());
        }
        lattice.enumerate(&points, &centre, tolerance, steps_max, visit)
    }
}
