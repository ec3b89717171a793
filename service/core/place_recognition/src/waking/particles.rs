//! The particle filter of an agent that does not know where it is.

use std::f64::consts::TAU;

use nalgebra::Isometry3;
use random::Seeded;
use state::{Counted, state_of_struct};

use super::cells::Cells;
use super::model::Scores;
use super::particle::{Particle, draw, gains, keys, normalise};
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
    pub(super) particles: Vec<Particle>,
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
        let gains = gains(temper, scores);
        let all: f64 = gains.iter().copied().map(f64::from).sum();
        let mean_within = all / gains.len().max(1) as f64;
        let within = scores.within.clamp(tuning::WITHIN.0, tuning::WITHIN.1);
        let numerator = if self.particles.is_empty() {
            let first = temper.max(tuning::FIRST);
            self.particles = draw(
                tuning::COUNT,
                (first, &self::gains(first, scores)),
                *turn,
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
                    of_cell[*cell as usize] = f64::from(*gain);
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
            let mut new = draw(n_fresh, (temper, &gains), *turn, scores, cells, &mut draws);
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
        let (sines, cosines) = simd::sin_cos(self.particles.iter().map(|own| own.turn_rad));
        let turns = sines.into_iter().zip(cosines);
        for (particle, (sin, cos)) in self.particles.iter_mut().zip(turns) {
            let [a, b] = pair(draws);
            let [c, d] = pair(draws);
            let [sin, cos] = [sin, cos].map(f64::from);
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
