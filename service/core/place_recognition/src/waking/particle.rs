//! A particle: where an agent may be that does not know where it is.

use std::f64::consts::TAU;

use nalgebra::Point3;
use random::Seeded;
use state::state_of_struct;

use super::cells::{Cells, key_of};
use super::index::Key;
use super::model::Scores;
use crate::particle_numbers::{floats, pair};
use crate::tuning::particles as tuning;
use crate::view::SensedTurn;

/// Where the agent may be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Particle {
    /// Position in the map \[m\].
    pub(super) at: [f32; 3],
    /// Turn of the frame of odometry in the map \[rad\].
    pub(super) turn_rad: f32,
    /// Factor of odometry's lengths.
    pub(super) scale: f32,
    pub(super) weight: f32,
}

state_of_struct!(Particle {
    at,
    turn_rad,
    scale,
    weight
});

impl Particle {
    /// Its weight if it is near a point, or else none.
    #[expect(
        clippy::inline_always,
        reason = "compiled for the vectors of a dispatch"
    )]
    #[inline(always)]
    pub(super) fn weight_near(&self, middle: &[f64; 3]) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|axis| f64::from(self.at[axis]) - middle[axis]);
        let is_near = x * x + y * y < tuning::NEAR_M * tuning::NEAR_M && z.abs() < tuning::NEAR_Z_M;
        if is_near { f64::from(self.weight) } else { 0.0 }
    }

    #[expect(
        clippy::inline_always,
        reason = "compiled for the vectors of a dispatch"
    )]
    #[inline(always)]
    pub(super) fn position(&self) -> Point3<f64> {
        Point3::from(self.at.map(f64::from))
    }
}

/// Exponentials of the scores of a view, tempered: how likely it is in each cell.
pub(super) fn gains(temper: f64, scores: &Scores) -> Vec<f32> {
    #[expect(clippy::cast_possible_truncation, reason = "a share")]
    let temper = temper as f32;
    let mut gains: Vec<f32> = { scores.cells.iter() }
        .map(|(_, score)| temper * score)
        .collect();
    simd::exp(&mut gains);
    gains
}

/// Draws particles by these gains of the cells. Their weights make up for a tempering that is not
/// the filter's.
pub(super) fn draw(
    count: usize,
    (temper, gains): (f64, &[f32]),
    turn: Option<SensedTurn>,
    scores: &Scores,
    cells: &Cells,
    draws: &mut Seeded,
) -> Vec<Particle> {
    let mut sum = 0.0;
    let sums: Vec<f64> = { gains.iter() }
        .map(|gain| {
            sum += f64::from(*gain);
            sum
        })
        .collect();
    let side_m = crate::tuning::cells::SIDE_M;
    let drawn = (0..count).filter_map(|_| {
        let at = draws.uniform() * sum;
        let index = sums
            .partition_point(|sum| *sum < at)
            .min(sums.len().checked_sub(1)?);
        let (number, score) = scores.cells[index];
        let middle = cells.get(number)?.middle();
        let [x, y] = [middle.x, middle.y].map(|x| x + (draws.uniform() - 0.5) * side_m);
        let [scale, off] = pair(draws);
        let turn_rad = match turn {
            Some(turn) if draws.uniform() >= tuning::MISLED => turn.rad + turn.sd_rad * off,
            _ => draws.uniform() * TAU,
        };
        let [x, y, z, turn_rad, scale, weight] = floats([
            x,
            y,
            middle.z,
            turn_rad,
            1.0 + tuning::SCALE_SD * scale,
            ((tuning::TEMPER - temper) * f64::from(score)).exp(),
        ]);
        Some(Particle {
            at: [x, y, z],
            turn_rad,
            scale,
            weight,
        })
    });
    drawn.collect()
}

/// The cells that particles are in.
pub(super) fn keys(particles: &[Particle]) -> Vec<Key> {
    let mut keys = vec![[0; 3]; particles.len()];
    simd::dispatch(
        #[inline(always)]
        || {
            for (key, particle) in keys.iter_mut().zip(particles) {
                *key = key_of(&particle.position());
            }
        },
    );
    keys
}

/// Scales the weights of particles so that they sum to one.
pub(super) fn normalise(particles: &mut [Particle]) {
    let whole: f64 = particles.iter().map(|each| f64::from(each.weight)).sum();
    for particle in particles {
        #[expect(clippy::cast_possible_truncation, reason = "a share")]
        let share = (f64::from(particle.weight) / whole) as f32;
        particle.weight = share;
    }
}
