//! The particles of an agent among the views of a map.

use std::f64::consts::TAU;

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Matrix6, Point3, UnitQuaternion, Vector3, Vector6};
use random::Seeded;
use state::{Counted, state_of_struct};

use super::expected::Expected;
use super::view_map::ViewMap;
use crate::keyframes::SampleKey;
use crate::particle_numbers::{floats, pair};
use crate::similarity::LoggedView;
use crate::tuning::tracking as tuning;
use crate::view::View;

/// Where an agent that is tracked is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracked {
    /// Pose of the body in the map.
    pub pose: Isometry3<f64>,
    /// Covariance of the error on its right.
    pub covariance: PoseCovariance,
}

/// Where the agent may be.
#[derive(Clone, Copy, Debug)]
struct Particle {
    /// Position beside that of the estimate, in axes of the map \[m\].
    off: [f32; 2],
    /// Turn of the body about the vertical, beyond that of the estimate \[rad\].
    turn_rad: f32,
    /// Logarithm of the noise of the turn \[rad/√s\].
    noise: f32,
    weight: f32,
}

state_of_struct!(Particle {
    off,
    turn_rad,
    noise,
    weight
});

/// The particle filter of an agent that knows about where it is, by the views of a map.
///
/// Between relaxations odometry drifts. Its heading errs by more than it says for seconds, and no
/// Gaussian says that. So each particle has a heading of its own, and a noise of its own by which
/// that changes; those that fit what is seen stay.
#[derive(Clone, Debug)]
pub(crate) struct Tracker {
    pub(crate) agent: u32,
    /// The revision of the map with which it took in a view last.
    pub(crate) used: u64,
    session: u32,
    /// Views so far that fit where the agent was.
    pub(crate) fitting: u64,
    stamp_ns: i64,
    /// Pose by motion alone at the latest view.
    in_odom: Isometry3<f64>,
    /// The estimate at the latest view, as the filter left it.
    pose: Isometry3<f64>,
    /// Mean lately of how much more probable views are where the particles are than anywhere
    /// \[nats\].
    fit: f64,
    particles: Vec<Particle>,
}

state_of_struct!(Tracker {
    agent,
    used,
    session,
    fitting,
    stamp_ns,
    in_odom,
    pose,
    fit,
    particles as Counted<u16>
});

impl Tracker {
    /// Of an agent that is where a view has it.
    pub(crate) fn new(view: &View<'_>, stamp_ns: i64) -> Self {
        Self {
            agent: view.sample.agent,
            used: 0,
            session: view.sample.session,
            fitting: 0,
            stamp_ns,
            in_odom: view.in_odom,
            pose: view.pose,
            fit: tuning::FIT_ELSEWHERE,
            particles: Vec::new(),
        }
    }

    /// Forgets where the agent was: it begins anew about its estimate.
    pub(crate) fn restart(&mut self) {
        self.particles.clear();
    }

    /// Whether it is of the session of a sample.
    pub(crate) fn is_of(&self, sample: SampleKey) -> bool {
        (self.agent, self.session) == (sample.agent, sample.session)
    }

    /// Takes in a view, `logged` as the map has them, and answers where the agent is; `None` while
    /// that is hardly known, or views are no more probable there than anywhere. While they are of
    /// no place of the map, the particles stay about the estimate.
    pub(crate) fn step(
        &mut self,
        view: &View<'_>,
        stamp_ns: i64,
        logged: &LoggedView,
        map: &ViewMap,
    ) -> Option<Tracked> {
        let components = map.components(logged)?;
        let range_m = map.model.range_m;
        let mut draws = draws(view.sample);
        if self.particles.is_empty() {
            self.fit = tuning::FIT_ELSEWHERE;
            self.particles = drawn(view, tuning::COUNT, &mut draws);
        } else {
            self.go(view, stamp_ns, range_m, &mut draws);
        }
        (self.stamp_ns, self.in_odom, self.pose) = (stamp_ns, view.in_odom, view.pose);
        let gain = self.weigh(&components, logged, map);
        let gain = gain.clamp(-tuning::GAIN_MAX, tuning::GAIN_MAX);
        self.fit += (gain - self.fit) * tuning::FIT_RATE;
        if self.fit > 0.0 && gain > 0.0 {
            self.fitting = self.fitting.wrapping_add(1);
        }
        let floor_m = tuning::FLOOR * range_m;
        let is_surer = view.covariance.position_sd_m() < floor_m;
        if self.fit < tuning::FIT_ELSEWHERE || is_surer {
            self.particles = drawn(view, tuning::COUNT, &mut draws);
            return None;
        }
        let Some(tracked) = self.gaussian(view, floor_m) else {
            self.restart();
            return None;
        };
        self.resample(&mut draws);
        let is_near = tracked.covariance.position_sd_m() < tuning::NEAR * range_m;
        (is_near && self.fit > 0.0).then(|| {
            self.leave_at(&tracked.pose);
            tracked
        })
    }

    /// Moves the particles as the estimate has moved. Where that has been put elsewhere meanwhile,
    /// some particles are drawn about it, and the others go on by odometry: what is seen next says
    /// which are right.
    fn go(&mut self, view: &View<'_>, stamp_ns: i64, range_m: f64, draws: &mut Seeded) {
        let by_odometry = self.pose * self.in_odom.inv_mul(&view.in_odom);
        let length_m = (by_odometry.translation.vector - self.pose.translation.vector).norm();
        let off_m = (view.pose.translation.vector - by_odometry.translation.vector).norm();
        let is_put = off_m > tuning::PUT_RANGES * range_m + tuning::PUT_PART * length_m
            || view.pose.rotation.angle_to(&by_odometry.rotation) > tuning::PUT_RAD;
        let there = if is_put { by_odometry } else { view.pose };
        let way = there.translation.vector - self.pose.translation.vector;
        #[expect(clippy::cast_precision_loss, reason = "seconds between two views")]
        let seconds = stamp_ns.saturating_sub(self.stamp_ns) as f64 * 1e-9;
        let root_s = seconds.clamp(0.0, tuning::SECONDS_MAX).sqrt();
        let position_sd = tuning::POSITION_PART * length_m;
        for particle in &mut self.particles {
            let [a, b] = pair(draws);
            let [c, d] = pair(draws);
            let [e, _] = pair(draws);
            let noise = f64::from(particle.noise) + tuning::NOISE_STEP * e;
            let noise = noise.clamp(tuning::NOISE_RAD.0.ln(), tuning::NOISE_RAD.1.ln());
            let turned = f64::from(particle.turn_rad);
            let stepped = noise.exp() * root_s * c;
            let (sin, cos) = (turned + 0.5 * stepped).sin_cos();
            let scale = 1.0 + tuning::SCALE_SD * d;
            let [x, y] = particle.off.map(f64::from);
            particle.off = floats([
                x + scale * (cos * way.x - sin * way.y) - way.x + position_sd * a,
                y + scale * (sin * way.x + cos * way.y) - way.y + position_sd * b,
            ]);
            [particle.turn_rad, particle.noise] = floats([wrapped(turned + stepped), noise]);
        }
        if is_put {
            self.shift(&(there.translation.vector - view.pose.translation.vector));
            self.re_base(&there.rotation, &view.pose.rotation);
            self.resample_to(tuning::KEPT, draws);
            let new = drawn(view, tuning::COUNT - self.particles.len(), draws);
            self.particles.extend(new);
        }
    }

    /// Counts turns from another heading of the estimate on.
    fn re_base(&mut self, from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>) {
        let (_, _, turned) = (from * to.inverse()).euler_angles();
        for particle in &mut self.particles {
            [particle.turn_rad] = floats([wrapped(f64::from(particle.turn_rad) + turned)]);
        }
    }

    /// Counts positions from another one of the estimate on, from which the old one is off by that.
    fn shift(&mut self, off: &Vector3<f64>) {
        for particle in &mut self.particles {
            let [x, y] = particle.off.map(f64::from);
            particle.off = floats([x + off.x, y + off.y]);
        }
    }

    /// The estimate is put where the filter has it.
    fn leave_at(&mut self, pose: &Isometry3<f64>) {
        self.shift(&(self.pose.translation.vector - pose.translation.vector));
        let was = self.pose.rotation;
        self.re_base(&was, &pose.rotation);
        self.pose = *pose;
    }

    /// Weighs the particles by what is seen; answers how much more probable that is where they are
    /// than anywhere \[nats\].
    fn weigh(&mut self, components: &[f32], logged: &LoggedView, map: &ViewMap) -> f64 {
        let expected = Expected::of(components, logged, map, (&self.pose, self.bounds()));
        let (side_m, side_rad) = (expected.side_m(), expected.side_rad());
        let mut keys: Vec<([i32; 3], u32)> = (0..)
            .zip(&self.particles)
            .map(|(number, particle)| (key(particle, side_m, side_rad), number))
            .collect();
        keys.sort_unstable();
        let (mut gained, mut whole) = (0.0, 0.0);
        for cell in keys.chunk_by(|a, b| a.0 == b.0) {
            let [x, y, turn] = cell[0].0.map(|number| f64::from(number) + 0.5);
            let off = Vector3::new(x * side_m, y * side_m, 0.0);
            let at = Point3::from(self.pose.translation.vector + off);
            let log_likelihood = expected.log_likelihood(&at, turn * side_rad.unwrap_or(0.0));
            let factor = (tuning::PART * log_likelihood).exp();
            for (_, number) in cell {
                let particle = &mut self.particles[*number as usize];
                let weight = f64::from(particle.weight);
                gained += weight * log_likelihood.exp();
                whole += weight;
                [particle.weight] = floats([weight * factor]);
            }
        }
        let sum: f64 = { self.particles.iter() }
            .map(|particle| f64::from(particle.weight))
            .sum();
        if sum > 0.0 {
            for particle in &mut self.particles {
                [particle.weight] = floats([f64::from(particle.weight) / sum]);
            }
        }
        if whole > 0.0 {
            (gained / whole).ln()
        } else {
            0.0
        }
    }

    /// The corners of the box of all positions.
    fn bounds(&self) -> [Point3<f64>; 2] {
        let at = Point3::from(self.pose.translation.vector);
        let positions = self.particles.iter().map(|particle| at + particle.off());
        positions.fold([at, at], |[low, high], at| [low.inf(&at), high.sup(&at)])
    }

    /// Resamples where the weights are worth less than half of the particles.
    fn resample(&mut self, draws: &mut Seeded) {
        let squares: f64 = { self.particles.iter() }
            .map(|particle| f64::from(particle.weight).powi(2))
            .sum();
        if squares * self.particles.len() as f64 > 2.0 {
            self.resample_to(tuning::COUNT, draws);
        }
    }

    /// Systematic resampling (Kitagawa 1996).
    fn resample_to(&mut self, count: usize, draws: &mut Seeded) {
        let weights = self.particles.iter().map(|each| f64::from(each.weight));
        let step = weights.sum::<f64>() / count as f64;
        let [weight] = floats([1.0 / tuning::COUNT as f64]);
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

    /// The particles as a Gaussian about a pose; `None` if they are nowhere. What they say nothing
    /// of, height and tilt, is as the estimate has it.
    fn gaussian(&self, view: &View<'_>, floor_m: f64) -> Option<Tracked> {
        let weights = self.particles.iter().map(|each| f64::from(each.weight));
        let whole: f64 = weights.sum();
        if whole <= 0.0 {
            return None;
        }
        let (mut middle, mut sin, mut cos) = (Vector3::zeros(), 0.0, 0.0);
        for particle in &self.particles {
            let weight = f64::from(particle.weight) / whole;
            middle += particle.off() * weight;
            let (s, c) = f64::from(particle.turn_rad).sin_cos();
            (sin, cos) = (sin + s * weight, cos + c * weight);
        }
        let turn_rad = sin.atan2(cos);
        let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, turn_rad) * view.pose.rotation;
        let in_map = view.covariance.in_map_axes(&view.pose.rotation);
        let mut covariance = Matrix6::zeros();
        for row in KEPT {
            for column in KEPT {
                covariance[(row, column)] = in_map[(row, column)];
            }
        }
        for particle in &self.particles {
            let off = particle.off() - middle;
            let turned = wrapped(f64::from(particle.turn_rad) - turn_rad);
            let error = Vector6::new(off.x, off.y, 0.0, 0.0, 0.0, turned);
            covariance += error * error.transpose() * (f64::from(particle.weight) / whole);
        }
        for axis in 0..2 {
            covariance[(axis, axis)] += floor_m * floor_m;
        }
        let is_known = covariance
            .iter()
            .chain(&middle)
            .all(|entry| entry.is_finite());
        is_known.then(|| Tracked {
            pose: Isometry3::from_parts((self.pose.translation.vector + middle).into(), rotation),
            covariance: in_body_axes(&covariance, &rotation),
        })
    }

    /// Whether the state is one that this program may have written to a checkpoint.
    pub(crate) fn is_sound(&self, agents: usize) -> bool {
        let is_finite = |particle: &Particle| {
            let [x, y] = particle.off;
            let all = [x, y, particle.turn_rad, particle.noise, particle.weight];
            all.iter().all(|number| number.is_finite()) && particle.weight >= 0.0
        };
        let is_pose = |pose: &Isometry3<f64>| pose.to_homogeneous().iter().all(|x| x.is_finite());
        (self.agent as usize) < agents
            && self.fit.is_finite()
            && is_pose(&self.in_odom)
            && is_pose(&self.pose)
            && self.particles.len() <= tuning::COUNT
            && self.particles.iter().all(is_finite)
    }

    /// Bytes of memory that its particles take.
    pub(crate) fn bytes(&self) -> usize {
        self.particles.len() * size_of::<Particle>()
    }
}

/// Components of a pose's error that particles do not have: height and tilt, in axes of the map.
const KEPT: [usize; 3] = [2, 3, 4];

impl Particle {
    fn off(&self) -> Vector3<f64> {
        let [x, y] = self.off.map(f64::from);
        Vector3::new(x, y, 0.0)
    }
}

/// Its random numbers with a sample: the same on every run.
fn draws(sample: SampleKey) -> Seeded {
    let seed = u64::from(sample.agent) << 32 | u64::from(sample.session);
    Seeded(random::bits(seed, [sample.seq, 0, 2]))
}

/// An angle from -π to π.
fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0
}

/// Particles about the estimate.
fn drawn(view: &View<'_>, count: usize, draws: &mut Seeded) -> Vec<Particle> {
    let in_map = view.covariance.in_map_axes(&view.pose.rotation);
    let sd = |component: usize| {
        let variance = in_map[(component, component)];
        variance.max(0.0).sqrt().min(tuning::SD_MAX)
    };
    let (sd_x, sd_y, sd_turn) = (sd(0), sd(1), sd(5));
    let (low, high) = (tuning::NOISE_RAD.0.ln(), tuning::NOISE_RAD.1.ln());
    let [weight] = floats([1.0 / tuning::COUNT as f64]);
    let drawn = (0..count).map(|_| {
        let [a, b] = pair(draws);
        let [c, _] = pair(draws);
        let noise = low + (high - low) * draws.uniform();
        let [x, y, turn_rad, noise] = floats([sd_x * a, sd_y * b, sd_turn * c, noise]);
        Particle {
            off: [x, y],
            turn_rad,
            noise,
            weight,
        }
    });
    drawn.collect()
}

#[expect(clippy::cast_possible_truncation, reason = "saturates")]
fn key(particle: &Particle, side_m: f64, side_rad: Option<f64>) -> [i32; 3] {
    let [x, y] = particle.off.map(|x| f64::from(x) / side_m);
    let turn = side_rad.map_or(0.0, |side_rad| f64::from(particle.turn_rad) / side_rad);
    [x, y, turn].map(|number| number.floor() as i32)
}

/// A covariance of an error in axes of the map, on the right of a pose.
fn in_body_axes(covariance: &Matrix6<f64>, rotation: &UnitQuaternion<f64>) -> PoseCovariance {
    let inverse = rotation.inverse().to_rotation_matrix().into_inner();
    let mut turn = Matrix6::zeros();
    turn.fixed_view_mut::<3, 3>(0, 0).copy_from(&inverse);
    turn.fixed_view_mut::<3, 3>(3, 3).copy_from(&inverse);
    PoseCovariance::from_matrix(&(turn * covariance * turn.transpose()))
}
