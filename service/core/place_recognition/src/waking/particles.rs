//! The particle filter of an agent that does not know where it is.

use std::f64::consts::TAU;

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Matrix4, Matrix6x4, UnitQuaternion, Vector3};
use random::Seeded;
use state::{Counted, state_of_struct};

use super::cells::{Cells, beside};
use super::index::Key;
use super::model::Scores;
use super::particle::{Particle, draw, keys, normalise};
use crate::keyframes::SampleKey;
use crate::particle_numbers::{floats, pair};
use crate::tuning::particles as tuning;
use crate::view::{SensedTurn, View};

/// The filter of an agent in a session.
#[derive(Clone, Debug)]
pub(crate) struct Filter {
    pub(super) agent: u32,
    pub(super) session: u32,
    /// Whether the agent knows where it is, and shows how often a claim would be right.
    pub(super) is_shadow: bool,
    pub(super) channel: u8,
    /// Views so far.
    pub(super) n_views: u32,
    /// Of a shadow: views of the channel, of all agents, at its latest one.
    pub(super) seen_at: u32,
    /// Probability that the agent is where nothing is known.
    pub(super) without: f64,
    /// Pose by motion alone at the latest view.
    pub(super) in_odom: Isometry3<f64>,
    /// Mean lately of how alike the views are where the agent is estimated to be, and anywhere.
    pub(super) alike: [f64; 2],
    /// Views one after the other at which it was sure where the agent is.
    n_sure: u8,
    /// Whether it was claimed that the agent is where the filter has it.
    pub(super) has_claimed: bool,
    particles: Vec<Particle>,
}

state_of_struct!(Filter {
    agent,
    session,
    is_shadow,
    channel,
    n_views,
    seen_at,
    without,
    in_odom,
    alike,
    n_sure,
    has_claimed,
    particles as Counted<u16>
});

/// How an agent has moved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moved {
    /// Its pose by motion alone.
    pub(super) in_odom: Isometry3<f64>,
    /// The turn of that in the map by other senses.
    pub(super) turn: Option<SensedTurn>,
}

impl Moved {
    pub(super) fn of(view: &View<'_>, turn: Option<SensedTurn>) -> Self {
        Self {
            in_odom: view.in_odom,
            turn,
        }
    }
}

/// Where most particles are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mode {
    pub(super) pose: Isometry3<f64>,
    pub(super) covariance: PoseCovariance,
    /// Probability that the agent is near.
    pub(super) probability: f64,
}

impl Filter {
    pub(super) fn new(sample: SampleKey, channel: u8, is_shadow: bool) -> Self {
        Self {
            agent: sample.agent,
            session: sample.session,
            is_shadow,
            channel,
            n_views: 0,
            seen_at: 0,
            without: tuning::WITHOUT,
            in_odom: Isometry3::identity(),
            alike: [0.0; 2],
            n_sure: 0,
            has_claimed: false,
            particles: Vec::new(),
        }
    }

    /// Takes in a view.
    pub(super) fn step(&mut self, moved: &Moved, scores: &Scores, cells: &Cells) {
        let Moved { in_odom, turn } = moved;
        let seed = u64::from(self.agent) << 32 | u64::from(self.n_views);
        let mut draws = Seeded(random::bits(
            seed,
            [self.session.into(), self.channel.into(), 1],
        ));
        let temper = tuning::TEMPER;
        let weigh = |score: f32| (temper * f64::from(score)).exp();
        let gains: Vec<f64> = { scores.cells.iter() }
            .map(|(_, score)| weigh(*score))
            .collect();
        let mean_within = gains.iter().sum::<f64>() / gains.len().max(1) as f64;
        let within = scores.within.clamp(tuning::WITHIN.0, tuning::WITHIN.1);
        let numerator = if self.particles.is_empty() {
            let temper_of_draw = temper.max(tuning::FIRST);
            self.particles = draw(
                tuning::COUNT,
                (temper_of_draw, *turn),
                scores,
                cells,
                &mut draws,
            );
            normalise(&mut self.particles);
            mean_within * (1.0 - self.without)
        } else {
            self.go(in_odom, &mut draws);
            if let Some(turn) = turn {
                self.turn(turn);
            }
            let outside = ((-temper * within).min(0.0) - tuning::HOLE).exp();
            let mut of_cell = vec![outside; cells.all.len()];
            for ((cell, _), gain) in scores.cells.iter().zip(&gains) {
                if !gain.is_nan() {
                    of_cell[*cell as usize] = *gain;
                }
            }
            let mut old = 0.0;
            // Those that were drawn from one before are mostly in one cell still.
            let mut last = None;
            let keys = keys(&self.particles);
            for (particle, key) in self.particles.iter_mut().zip(keys) {
                let known = last.filter(|(known, _)| *known == key);
                let (_, gain) = *last.insert(known.unwrap_or_else(|| {
                    let number = cells.find(self.channel, key);
                    (
                        key,
                        number.map_or(outside, |number| of_cell[number as usize]),
                    )
                }));
                #[expect(clippy::cast_possible_truncation, reason = "a weight")]
                let weight = (f64::from(particle.weight) * gain) as f32;
                particle.weight = weight;
                old += f64::from(weight);
            }
            old *= 1.0 - tuning::ANEW;
            let fresh = tuning::ANEW * mean_within;
            let all = old + fresh;
            let n_fresh = tuning::COUNT / tuning::FRESH;
            self.resample(tuning::COUNT - n_fresh, old / all, &mut draws);
            let mut new = draw(n_fresh, (temper, *turn), scores, cells, &mut draws);
            normalise(&mut new);
            #[expect(clippy::cast_possible_truncation, reason = "a share")]
            let share = (fresh / all) as f32;
            for particle in &mut new {
                particle.weight *= share;
            }
            self.particles.extend(new);
            (1.0 - self.without) * all
        };
        let open = self.without * (-temper * within).exp();
        self.without = open / (open + numerator);
        self.without = tuning::OPEN.0 * self.without + tuning::OPEN.1;
        self.in_odom = *in_odom;
        self.n_views = self.n_views.saturating_add(1);
    }

    /// Moves the particles as odometry says, with its errors.
    fn go(&mut self, in_odom: &Isometry3<f64>, draws: &mut Seeded) {
        let way = in_odom.translation.vector - self.in_odom.translation.vector;
        let length_m = way.norm();
        let turn_sd = tuning::TURN_SD.0 + tuning::TURN_SD.1 * length_m.sqrt();
        let position_sd = tuning::POSITION_SD.0 + tuning::POSITION_SD.1 * length_m.sqrt();
        for particle in &mut self.particles {
            let [a, b] = pair(draws);
            let [c, d] = pair(draws);
            let (sin, cos) = f64::from(particle.turn_rad).sin_cos();
            let scale = f64::from(particle.scale);
            let [x, y, z] = particle.at.map(f64::from);
            particle.at = floats([
                x + scale * (cos * way.x - sin * way.y) + position_sd * a,
                y + scale * (sin * way.x + cos * way.y) + position_sd * b,
                z + scale * way.z,
            ]);
            let [turn, scale] = floats([
                f64::from(particle.turn_rad) + turn_sd * c,
                scale + tuning::SCALE_STEP * d,
            ]);
            (particle.turn_rad, particle.scale) = (turn, scale);
        }
    }

    /// Weighs the particles among themselves by what other senses say of their turn: whose errors
    /// last says the same with each view.
    fn turn(&mut self, turn: &SensedTurn) {
        let sum = |particles: &[Particle]| -> f64 {
            particles.iter().map(|each| f64::from(each.weight)).sum()
        };
        let before = sum(&self.particles);
        for particle in &mut self.particles {
            let off = (f64::from(particle.turn_rad) - turn.rad + TAU / 2.0).rem_euclid(TAU);
            let deviations = (off - TAU / 2.0) / turn.sd_rad;
            let fits = (-0.5 * deviations * deviations).exp();
            let gain = tuning::MISLED + (1.0 - tuning::MISLED) * fits;
            #[expect(clippy::cast_possible_truncation, reason = "a weight")]
            let weight = (f64::from(particle.weight) * gain.powf(tuning::TURN_TEMPER)) as f32;
            particle.weight = weight;
        }
        let after = sum(&self.particles);
        for particle in &mut self.particles {
            #[expect(clippy::cast_possible_truncation, reason = "a weight")]
            let weight = (f64::from(particle.weight) * before / after) as f32;
            particle.weight = weight;
        }
    }

    /// Systematic resampling (Kitagawa 1996).
    fn resample(&mut self, count: usize, share: f64, draws: &mut Seeded) {
        let whole: f64 = self
            .particles
            .iter()
            .map(|each| f64::from(each.weight))
            .sum();
        #[expect(clippy::cast_possible_truncation, reason = "a share")]
        let weight = (share / count as f64) as f32;
        let step = whole / count as f64;
        let mut next = step * draws.uniform();
        let mut sum = 0.0;
        let mut kept = Vec::with_capacity(tuning::COUNT);
        for particle in &self.particles {
            sum += f64::from(particle.weight);
            while next < sum && kept.len() < count {
                kept.push(Particle {
                    weight,
                    ..*particle
                });
                next += step;
            }
        }
        while let (true, Some(last)) = (kept.len() < count, kept.last().copied()) {
            kept.push(last);
        }
        self.particles = kept;
    }

    /// Where most particles are; `None` without any.
    pub(super) fn mode(&self, cells: &Cells) -> Option<Mode> {
        // Those that were drawn from one before are mostly in one cell still.
        let mut by_key: Vec<(Key, f64)> = Vec::new();
        for (particle, key) in self.particles.iter().zip(keys(&self.particles)) {
            let weight = f64::from(particle.weight);
            match by_key.last_mut() {
                Some(last) if last.0 == key => last.1 += weight,
                _ => by_key.push((key, weight)),
            }
        }
        by_key.sort_by_key(|(key, _)| *key);
        by_key.dedup_by(|next, kept| {
            let is_same = next.0 == kept.0;
            if is_same {
                kept.1 += next.1;
            }
            is_same
        });
        let weight_of = |key: Key| {
            let at = by_key.binary_search_by_key(&key, |(key, _)| *key);
            at.map_or(0.0, |at| by_key[at].1)
        };
        let sums = by_key.iter().map(|(key, weight)| {
            let around: f64 = beside(*key).map(weight_of).sum();
            (*key, weight + around)
        });
        let (key, _) = sums.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let height_m = { cells.find(self.channel, key) }
            .and_then(|number| cells.get(number))
            .map_or(f64::from(key[2]) * crate::tuning::cells::SIDE_M, |cell| {
                cell.middle().z
            });
        let side_m = crate::tuning::cells::SIDE_M;
        let mut middle = Vector3::new(
            f64::from(key[0]) * side_m,
            f64::from(key[1]) * side_m,
            height_m,
        );
        for _ in 0..3 {
            middle = self.mean_near(&middle)?;
        }
        self.gaussian(&middle)
    }

    /// Mean position of the particles near a point; `None` without any.
    fn mean_near(&self, middle: &Vector3<f64>) -> Option<Vector3<f64>> {
        let middle = <[f64; 3]>::from(*middle);
        let (sum, whole) = simd::dispatch(
            #[inline(always)]
            || {
                let (mut sum, mut whole) = ([0.0; 3], 0.0);
                for particle in &self.particles {
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

    /// The particles about a point as a Gaussian about a pose; `None` without any.
    fn gaussian(&self, middle: &Vector3<f64>) -> Option<Mode> {
        let at = <[f64; 3]>::from(*middle);
        let (mut sin, mut cos, mut whole) = (0.0, 0.0, 0.0);
        for particle in &self.particles {
            let weight = particle.weight_near(&at);
            if weight > 0.0 {
                let (s, c) = f64::from(particle.turn_rad).sin_cos();
                (sin, cos, whole) = (sin + s * weight, cos + c * weight, whole + weight);
            }
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
                for particle in &self.particles {
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

    /// Whether these log odds, and those of the views before, are enough for a claim.
    pub(super) fn is_sure(&mut self, odds: f64) -> bool {
        let is_more = odds >= crate::tuning::claims::SURE;
        self.n_sure = if is_more {
            self.n_sure.saturating_add(1)
        } else {
            0
        };
        self.n_sure >= crate::tuning::claims::TIMES
    }

    /// Whether the state is one that this program may have written to a checkpoint.
    pub(super) fn is_sound(&self, agents: usize, channels: usize) -> bool {
        let is_finite = |particle: &Particle| {
            let [x, y, z] = particle.at;
            let all = [x, y, z, particle.turn_rad, particle.scale, particle.weight];
            all.iter().all(|number| number.is_finite())
        };
        (self.agent as usize) < agents
            && usize::from(self.channel) < channels
            && self.particles.len() <= tuning::COUNT
            && self.particles.iter().all(is_finite)
    }

    /// Bytes of memory that its particles take.
    pub(super) fn bytes(&self) -> usize {
        self.particles.len() * size_of::<Particle>()
    }
}

#[cfg(test)]
mod tests;
