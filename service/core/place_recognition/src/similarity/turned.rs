//! How alike views of one place are for two bodies that look different ways.

use std::f64::consts::PI;

use nalgebra::{SMatrix, SVector};
use state::state_of_struct;

use super::neighbours::NeighbourPair;
use crate::tuning::similarity as tuning;

/// Turns of the body at which it is learned: from none to half a turn.
const TURNS: usize = 5;

/// How alike views of one place are after a turn of the body, as a part of how alike they are
/// without one: at none, 45°, 90°, 135° and 180°, and between them what lies between.
///
/// Those of a camera have nothing in common once it looks elsewhere; those of a laser that sees
/// all round are alike again in a corridor that looks the same from both ends; radio is the same
/// all the time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turned {
    parts: [f64; TURNS],
}

state_of_struct!(Turned { parts });

impl Default for Turned {
    fn default() -> Self {
        Self::NOTHING
    }
}

impl Turned {
    /// A turn changes nothing.
    pub const NOTHING: Self = Self {
        parts: [1.0; TURNS],
    };

    /// From neighbours, by least squares, where views are alike over a distance \[m\] and far ones
    /// have a mean score. Of turns that were seldom made little is known: what is known of the
    /// next smaller one holds.
    pub(super) fn of(neighbours: &[NeighbourPair], range_m: f64, far: f64) -> Self {
        let mut whole = SMatrix::<f64, TURNS, TURNS>::zeros();
        let mut known = SVector::<f64, TURNS>::zeros();
        for pair in neighbours.iter().filter(|pair| pair.distance_m < range_m) {
            let ranges = pair.distance_m / range_m;
            let by_distance = (-0.5 * ranges * ranges).exp();
            for (turn, part) in about(pair.turn_rad) {
                known[turn] += by_distance * part * (pair.score - far);
                for (other, beside) in about(pair.turn_rad) {
                    whole[(turn, other)] += by_distance * by_distance * part * beside;
                }
            }
        }
        for turn in 1..TURNS {
            let stiff = tuning::TURN_PAIRS;
            whole[(turn, turn)] += stiff;
            whole[(turn - 1, turn - 1)] += stiff;
            whole[(turn, turn - 1)] -= stiff;
            whole[(turn - 1, turn)] -= stiff;
        }
        let Some(alike) = whole.cholesky().map(|root| root.solve(&known)) else {
            return Self::NOTHING;
        };
        if !(alike[0].is_normal() && alike[0] > 0.0) {
            return Self::NOTHING;
        }
        Self {
            parts: std::array::from_fn(|turn| (alike[turn] / alike[0]).clamp(0.0, 1.0)),
        }
    }

    /// With these parts after turns of 0°, 45°, 90°, 135° and 180°.
    #[cfg(test)]
    pub(crate) fn of_parts(parts: [f64; TURNS]) -> Self {
        Self { parts }
    }

    /// The part after a turn by an angle of at most π \[rad\].
    pub fn part(&self, angle_rad: f64) -> f64 {
        about(angle_rad)
            .into_iter()
            .map(|(turn, part)| part * self.parts[turn])
            .sum()
    }

    /// The parts after turns of 0°, 45°, 90°, 135° and 180°.
    pub fn parts(&self) -> &[f64; TURNS] {
        &self.parts
    }

    /// Whether one that was read from a checkpoint is one.
    pub(crate) fn is_sound(&self) -> bool {
        let are_parts = self.parts.iter().all(|part| (0.0..=1.0).contains(part));
        are_parts && self.parts[0] > 0.0
    }
}

/// The two turns that an angle lies between, with their parts of it.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "at most four"
)]
fn about(angle_rad: f64) -> [(usize, f64); 2] {
    let last = TURNS - 1;
    let turns = (angle_rad.abs() / PI).clamp(0.0, 1.0) * last as f64;
    let below = (turns.floor() as usize).min(last - 1);
    let part = turns - below as f64;
    [(below, 1.0 - part), (below + 1, part)]
}

#[cfg(test)]
mod tests;
