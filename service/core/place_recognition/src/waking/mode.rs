//! Where most particles of a filter are.

use std::f64::consts::TAU;

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Matrix4, Matrix6x4, UnitQuaternion, Vector3};

use super::cells::Cells;
use super::particle::{Particle, keys};
use super::particles::Filter;
use crate::tuning::particles as tuning;

/// Steps from the heaviest cell to the mode, each to the mean of what is near.
const MODE_STEPS: u8 = 3;

/// Where most particles are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mode {
    pub(super) pose: Isometry3<f64>,
    pub(super) covariance: PoseCovariance,
    /// Probability that the agent is near.
    pub(super) probability: f64,
}

impl Filter {
    /// Where most particles are; `None` if none is in a cell.
    pub(super) fn mode(&self, cells: &Cells) -> Option<Mode> {
        let mut weights = vec![[0.0]; cells.all.len()];
        // Those that were drawn from one before are mostly in one cell still.
        let mut last = None;
        for (particle, key) in self.particles.iter().zip(keys(&self.particles)) {
            let known = last.filter(|(known, _)| *known == key);
            let (_, number) =
                *last.insert(known.unwrap_or_else(|| (key, cells.find(self.channel, key))));
            if let Some([sum]) = number.and_then(|number| weights.get_mut(number as usize)) {
                *sum += particle.weight;
            }
        }
        let mut middle = cells.heaviest(self.channel, &weights)?.middle();
        // Each step leads to a mean of particles that are near: no others come into it.
        let reach_m = f64::from(MODE_STEPS + 1) * tuning::NEAR_M;
        let is_in_reach = |own: &&Particle| {
            let off = own.position().coords - middle;
            off.x * off.x + off.y * off.y < reach_m * reach_m
        };
        let about: Vec<Particle> = self.particles.iter().filter(is_in_reach).copied().collect();
        for _ in 0..MODE_STEPS {
            middle = mean_near(&about, &middle)?;
        }
        self.gaussian(&about, &middle)
    }

    /// The particles near a point, of those about it, as a Gaussian; `None` without any.
    fn gaussian(&self, about: &[Particle], middle: &Vector3<f64>) -> Option<Mode> {
        let at = <[f64; 3]>::from(*middle);
        let (sines, cosines) = simd::sin_cos(about.iter().map(|own| own.turn_rad));
        let (mut sin, mut cos, mut whole) = (0.0, 0.0, 0.0);
        for (particle, (s, c)) in about.iter().zip(sines.iter().zip(cosines)) {
            let weight = particle.weight_near(&at);
            let [s, c] = [*s, c].map(f64::from);
            (sin, cos, whole) = (sin + s * weight, cos + c * weight, whole + weight);
        }
        if whole <= 0.0 {
            return None;
        }
        let turn_rad = sin.atan2(cos);
        // Of positions and turns in the map.
        let squares = simd::dispatch(
            #[inline(always)]
            || {
                let mut squares = [[0.0; 4]; 4];
                for particle in about {
                    let weight = particle.weight_near(&at) / whole;
                    let turned = (f64::from(particle.turn_rad) - turn_rad) / TAU;
                    let mut error = [0.0; 4];
                    for axis in 0..3 {
                        error[axis] = f64::from(particle.at[axis]) - at[axis];
                    }
                    error[3] = (turned - turned.round()) * TAU;
                    for (column, one) in squares.iter_mut().zip(&error) {
                        for (square, other) in column.iter_mut().zip(&error) {
                            *square += one * weight * other;
                        }
                    }
                }
                squares
            },
        );
        let squares = Matrix4::from(squares);
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, turn_rad);
        let rotation = turn * self.in_odom.rotation;
        let to_body = rotation.inverse().to_rotation_matrix().into_inner();
        let mut jacobian = Matrix6x4::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&to_body);
        jacobian
            .fixed_view_mut::<3, 1>(3, 3)
            .copy_from(&to_body.column(2));
        let covariance = jacobian * squares * jacobian.transpose();
        let all: f64 = self
            .particles
            .iter()
            .map(|each| f64::from(each.weight))
            .sum();
        Some(Mode {
            pose: Isometry3::from_parts((*middle).into(), rotation),
            covariance: PoseCovariance::from_upper_part(&covariance),
            probability: whole / all * (1.0 - self.without),
        })
    }
}

/// Mean position of the particles near a point; `None` without any.
fn mean_near(about: &[Particle], middle: &Vector3<f64>) -> Option<Vector3<f64>> {
    let middle = <[f64; 3]>::from(*middle);
    let (sum, whole) = simd::dispatch(
        #[inline(always)]
        || {
            let (mut sum, mut whole) = ([0.0; 3], 0.0);
            for particle in about {
                let weight = particle.weight_near(&middle);
                for (sum, at) in sum.iter_mut().zip(particle.at) {
                    *sum += f64::from(at) * weight;
                }
                whole += weight;
            }
            (sum, whole)
        },
    );
    (whole > 0.0).then(|| Vector3::from(sum) / whole)
}
