//! The lattice of one grid module.

use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

use super::Phase;

/// A face-centred cubic lattice: hexagonal layers with 60° between the axes, each layer staggered
/// over the one below. It is the densest lattice in three dimensions and the best 3-D population
/// code (Mathis, Stemmler & Herz 2015, eLife 4:e05979).
///
/// ```text
/// basis = spacing · R · | 1  1/2   1/2  |
///                       | 0  √3/2  √3/6 |
///                       | 0  0     √6/3 |
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    spacing_m: f64,
    basis: Matrix3<f64>,
    inverse: Matrix3<f64>,
}

impl Lattice {
    /// The lattice with `spacing_m` \[m\] between neighbouring points (positive), rotated by
    /// `orientation` from the standard axes into `map`.
    pub fn new(spacing_m: f64, orientation: UnitQuaternion<f64>) -> Self {
        let root_3 = 3.0_f64.sqrt();
        let root_6 = 6.0_f64.sqrt();
        let standard = Matrix3::new(
            1.0,
            0.5,
            0.5,
            0.0,
            root_3 / 2.0,
            root_3 / 6.0,
            0.0,
            0.0,
            root_6 / 3.0,
        );
        let (a, b) = (-root_3 / 3.0, -root_6 / 6.0);
        let standard_inverse = Matrix3::new(1.0, a, b, 0.0, -2.0 * a, b, 0.0, 0.0, root_6 / 2.0);
        let rotation = orientation.to_rotation_matrix().into_inner();
        Self {
            spacing_m,
            basis: rotation * standard * spacing_m,
            inverse: standard_inverse * rotation.transpose() / spacing_m,
        }
    }

    /// Distance between neighbouring lattice points \[m\].
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m
    }

    /// The lattice axes as columns \[m per turn\], in `map`.
    pub fn basis(&self) -> &Matrix3<f64> {
        &self.basis
    }

    /// Inverse of the basis \[turns per m\].
    pub fn inverse(&self) -> &Matrix3<f64> {
        &self.inverse
    }

    /// By how many turns a displacement \[m\] in `map` moves the phase.
    pub fn phase_displacement(&self, displacement: &Vector3<f64>) -> Vector3<f64> {
        self.inverse * displacement
    }

    /// The position \[m\] in `map` of a phase in the cell at lattice index `reference`.
    pub fn position(&self, reference: [i64; 3], phase: &Phase) -> Point3<f64> {
        let cell = Vector3::from(reference.map(|index| index as f64));
        Point3::from(self.basis * (cell + phase.turns()))
    }

    /// Lattice index and phase of a position \[m\] in `map`.
    pub fn locate(&self, position: &Point3<f64>) -> ([i64; 3], Phase) {
        Phase::split(&self.phase_displacement(&position.coords))
    }

    /// Shortest distance \[m\] between any two points of space that have these phases; at most
    /// spacing/√2, the lattice's covering radius.
    pub fn torus_distance_m(&self, a: &Phase, b: &Phase) -> f64 {
        self.spacing_m * turns_norm_squared(&shortest_turns(&(a.turns() - b.turns()))).sqrt()
    }
}

/// Of all turns that differ from `turns` by whole turns, those of the shortest way through space.
///
/// The lattice is A₃: with u₄ = −(u₁ + u₂ + u₃) a displacement's squared length is ½ Σ uᵢ²
/// spacings², and the lattice points are the integer u with sum zero. The nearest one is exact by
/// rounding: round every uᵢ; if the sum is not zero, undo the roundings that went farthest the
/// wrong way (Conway & Sloane 1982, "Fast quantizing and decoding algorithms", section on Aₙ). No
/// images are tried.
pub(super) fn shortest_turns(turns: &Vector3<f64>) -> Vector3<f64> {
    let fourth = -(turns.x + turns.y + turns.z);
    let four = [turns.x, turns.y, turns.z, fourth];
    let mut rest = four.map(|u| u - nearest(u));
    // The rests' sum is a whole number, minus two to two; one step of ±1 per unit brings it to
    // zero.
    let excess = nearest(rest[0] + rest[1] + rest[2] + rest[3]);
    let step = if excess > 0.0 { 1.0 } else { -1.0 };
    let mut left = excess.abs();
    while left > 0.5 {
        let mut farthest = 0;
        for k in 1..4 {
            if rest[k] * step > rest[farthest] * step {
                farthest = k;
            }
        }
        rest[farthest] -= step;
        left -= 1.0;
    }
    Vector3::new(rest[0], rest[1], rest[2])
}

/// Squared length of a displacement in turns, in spacings².
pub(super) fn turns_norm_squared(turns: &Vector3<f64>) -> f64 {
    let sum = turns.x + turns.y + turns.z;
    0.5 * (turns.norm_squared() + sum * sum)
}

/// Nearest whole number. Phases differ by less than four turns, so adding and taking away 1.5·2⁵²
/// rounds exactly, at the cost of two additions instead of a call.
fn nearest(u: f64) -> f64 {
    const ROUNDER: f64 = 6_755_399_441_055_744.0;
    (u + ROUNDER) - ROUNDER
}
