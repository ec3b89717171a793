//! Robots on two wheels in a flat room with landmarks.
//!
//! Their odometry is what encoders count, and errs as wheels do: one is larger than it is thought
//! to be, and both slip. No estimator's model of motion noise is drawn from here.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::reading::{Reading, ReadingBody, ReadingTarget, robot_name};
use trajectory::StampedPose;

/// Time of a tick \[s\] and \[ns\].
const TICK_S: f64 = 0.1;
const TICK_NS: i64 = 100_000_000;
/// Distance of the wheels \[m\].
const BASE_M: f64 = 0.3;
/// Fastest speed \[m/s\] and turn \[rad/s\].
const SPEED_M_S: f64 = 0.5;
const TURN_RAD_S: f64 = 1.0;
/// A point has been reached within this distance \[m\].
const REACHED_M: f64 = 0.3;
/// Robots keep this far from the walls \[m\].
const MARGIN_M: f64 = 0.5;

/// What the robots are like, and the room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelSettings {
    /// Seed of the room, the ways and all errors.
    pub seed: u64,
    /// Number of robots.
    pub n_robots: u32,
    /// Number of landmarks, anywhere in the room.
    pub n_landmarks: u32,
    /// Length of the room along x and y \[m\].
    pub room_m: [f64; 2],
    /// Standard deviation from which the error of each wheel's size is drawn, as a share of it.
    pub wheel_error_sd: f64,
    /// Standard deviation of a wheel's slip after a metre \[m\]; it grows with the root of the way.
    pub slip_sd_m: f64,
    /// How far landmarks and robots are seen \[m\], to every side.
    pub reach_m: f64,
    /// How often each of them is seen \[Hz\], at most ten times a second.
    pub sightings_hz: f64,
    /// Standard deviation of a seen distance, as its sample states it \[m\].
    pub range_sd_m: f64,
    /// Standard deviation of a seen direction, as its sample states it \[rad\].
    pub bearing_sd_rad: f64,
}

impl Default for WheelSettings {
    /// A room of 12 m × 9 m with 12 landmarks, and one robot whose wheels are not calibrated.
    fn default() -> Self {
        Self {
            seed: 1,
            n_robots: 1,
            n_landmarks: 12,
            room_m: [12.0, 9.0],
            wheel_error_sd: 0.01,
            slip_sd_m: 0.005,
            reach_m: 5.0,
            sightings_hz: 1.0,
            range_sd_m: 0.03,
            bearing_sd_rad: 0.01,
        }
    }
}

/// What one robot did and read in one tick.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelTick {
    /// Number of the robot, from 1; its name is [`robot_name`] of it.
    pub robot: u32,
    /// Its true pose at the end of the tick, in the frame of the room.
    pub truth: StampedPose,
    /// What it read, stamped at the end of the tick: start pose or motion, then sightings.
    pub readings: Vec<Reading>,
}

/// Robots on wheels in a room, tick by tick. Equal settings give equal streams.
#[derive(Clone, Debug)]
pub struct Wheels {
    settings: WheelSettings,
    landmarks_m: Vec<Vector2<f64>>,
    robots: Vec<Robot>,
    n_ticks: i64,
}

#[derive(Clone, Debug)]
struct Robot {
    at_m: Vector2<f64>,
    heading_rad: f64,
    goal_m: Vector2<f64>,
    /// True way of each wheel over what its encoder tells.
    sizes: [f64; 2],
    random: ChaCha8Rng,
}

impl Wheels {
    /// The robots, anywhere in the room, before their first step.
    pub fn new(settings: WheelSettings) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
        let landmarks_m = (0..settings.n_landmarks)
            .map(|_| point(&settings, 0.0, &mut random))
            .collect();
        let robots = (1..=settings.n_robots).map(|robot| {
            let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
            random.set_stream(u64::from(robot));
            Robot {
                at_m: point(&settings, MARGIN_M, &mut random),
                heading_rad: random.random_range(-PI..PI),
                goal_m: point(&settings, MARGIN_M, &mut random),
                sizes: [(); 2].map(|()| 1.0 + settings.wheel_error_sd * normal(&mut random)),
                random,
            }
        });
        Self {
            settings,
            landmarks_m,
            robots: robots.collect(),
            n_ticks: 0,
        }
    }

    /// The next tick, robots in order of their numbers: in the first, start poses and sightings; in
    /// every later one, a motion without stated noise, and sightings.
    pub fn tick(&mut self) -> Vec<WheelTick> {
        let stamp_ns = self.n_ticks * TICK_NS;
        let settings = self.settings;
        let moves = self.n_ticks > 0;
        let step = |robot: &mut Robot| robot.step(&settings);
        let motions: Vec<Option<ReadingBody>> = if moves {
            self.robots
                .iter_mut()
                .map(|robot| Some(step(robot)))
                .collect()
        } else {
            self.robots
                .iter()
                .map(|robot| Some(robot.start()))
                .collect()
        };
        self.n_ticks += 1;
        let positions_m: Vec<Vector2<f64>> = self.robots.iter().map(|robot| robot.at_m).collect();
        let mut ticks = Vec::with_capacity(self.robots.len());
        for ((number, robot), motion) in (1..).zip(&mut self.robots).zip(motions) {
            let landmarks = (1..).zip(&self.landmarks_m).map(|(landmark, at_m)| {
                (
                    ReadingTarget::Landmark(format!("landmark-{landmark}")),
                    *at_m,
                )
            });
            let others = (1..)
                .zip(&positions_m)
                .filter(|(other, _)| *other != number);
            let others =
                others.map(|(other, at_m)| (ReadingTarget::Robot(robot_name(other)), *at_m));
            let seen = landmarks
                .chain(others)
                .filter_map(|(target, at_m)| robot.look(&settings, target, &at_m));
            let bodies = motion.into_iter().chain(seen.collect::<Vec<_>>());
            ticks.push(WheelTick {
                robot: number,
                truth: StampedPose {
                    stamp_ns,
                    pose: robot.pose(),
                },
                readings: bodies.map(|body| Reading { stamp_ns, body }).collect(),
            });
        }
        ticks
    }
}

impl Robot {
    fn pose(&self) -> Isometry3<f64> {
        let turn = Vector3::z() * self.heading_rad;
        Isometry3::new(self.at_m.push(0.0), turn)
    }

    /// What it is told before its first step.
    fn start(&self) -> ReadingBody {
        let pose = self.pose();
        ReadingBody::StartPose {
            translation_m: pose.translation.vector.into(),
            rotation_xyzw: pose.rotation.coords.into(),
        }
    }

    /// Drives towards its goal for a tick, and tells what its encoders say.
    fn step(&mut self, settings: &WheelSettings) -> ReadingBody {
        if (self.goal_m - self.at_m).norm() < REACHED_M {
            self.goal_m = point(settings, MARGIN_M, &mut self.random);
        }
        let way = self.goal_m - self.at_m;
        let off_rad = wrapped(way.y.atan2(way.x) - self.heading_rad);
        let turn_rad_s = (off_rad / TICK_S).clamp(-TURN_RAD_S, TURN_RAD_S);
        let speed_m_s = SPEED_M_S * off_rad.cos().max(0.0);
        let sides = [-1.0, 1.0].map(|side| (speed_m_s + side * turn_rad_s * BASE_M / 2.0) * TICK_S);
        let [left_m, right_m] = sides;
        self.drive(left_m, right_m);
        let mut told = [0.0; 2];
        for ((told_m, side_m), size) in told.iter_mut().zip(sides).zip(self.sizes) {
            let slip_m = settings.slip_sd_m * side_m.abs().sqrt() * normal(&mut self.random);
            *told_m = side_m / size + slip_m;
        }
        let [left_m, right_m] = told;
        ReadingBody::Velocity {
            linear_m_s: [f64::midpoint(left_m, right_m) / TICK_S, 0.0, 0.0],
            angular_rad_s: [0.0, 0.0, (right_m - left_m) / BASE_M / TICK_S],
            duration_s: TICK_S,
            noise: None,
        }
    }

    /// Goes along the arc that ways of both wheels make.
    fn drive(&mut self, left_m: f64, right_m: f64) {
        let (ahead_m, turn_rad) = (f64::midpoint(left_m, right_m), (right_m - left_m) / BASE_M);
        let half_rad = turn_rad / 2.0;
        let chord_m = if half_rad == 0.0 {
            ahead_m
        } else {
            ahead_m * half_rad.sin() / half_rad
        };
        let (sin, cos) = (self.heading_rad + half_rad).sin_cos();
        self.at_m += Vector2::new(cos, sin) * chord_m;
        self.heading_rad = wrapped(self.heading_rad + turn_rad);
    }

    /// What it sees of something in this tick, if it does.
    fn look(
        &mut self,
        settings: &WheelSettings,
        target: ReadingTarget,
        target_m: &Vector2<f64>,
    ) -> Option<ReadingBody> {
        let line = target_m - self.at_m;
        let reported = self
            .random
            .random_bool((settings.sightings_hz * TICK_S).min(1.0));
        if line.norm() > settings.reach_m || !reported {
            return None;
        }
        let bearing_rad = line.y.atan2(line.x) - self.heading_rad;
        let range_m = line.norm() + settings.range_sd_m * normal(&mut self.random);
        let azimuth_rad = bearing_rad + settings.bearing_sd_rad * normal(&mut self.random);
        Some(ReadingBody::Sighting {
            target,
            range_m: range_m.max(0.0),
            azimuth_rad: wrapped(azimuth_rad),
            elevation_rad: 0.0,
            range_sd_m: settings.range_sd_m,
            bearing_sd_rad: settings.bearing_sd_rad,
        })
    }
}

/// A point of the room, at least this far from its walls.
fn point(settings: &WheelSettings, margin_m: f64, random: &mut ChaCha8Rng) -> Vector2<f64> {
    let [x, y] = settings.room_m;
    Vector2::new(
        random.random_range(margin_m..=(x - margin_m).max(margin_m)),
        random.random_range(margin_m..=(y - margin_m).max(margin_m)),
    )
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    random.sample(StandardNormal)
}

/// The same angle in ±π.
fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dead_reckoned;

    fn readings(settings: WheelSettings, ticks: usize) -> (Vec<Reading>, Vec<StampedPose>) {
        let mut wheels = Wheels::new(settings);
        let ticks: Vec<WheelTick> = (0..ticks).flat_map(|_| wheels.tick()).collect();
        let truth = ticks.iter().map(|tick| tick.truth).collect();
        (
            ticks.into_iter().flat_map(|tick| tick.readings).collect(),
            truth,
        )
    }

    fn last_error_m(settings: WheelSettings) -> f64 {
        let (readings, truth) = readings(settings, 601);
        let reckoned = dead_reckoned(&readings).unwrap();
        let (reckoned, truth) = (reckoned.last().unwrap(), truth.last().unwrap());
        (reckoned.pose.translation.vector - truth.pose.translation.vector).norm()
    }

    #[test]
    fn wheels_without_faults_tell_where_they_are() {
        let exact = WheelSettings {
            wheel_error_sd: 0.0,
            slip_sd_m: 0.0,
            ..WheelSettings::default()
        };
        assert!(last_error_m(exact) < 1e-9);
        let uneven = WheelSettings {
            wheel_error_sd: 0.01,
            ..exact
        };
        assert!(last_error_m(uneven) > 0.1);
        let slipping = WheelSettings {
            slip_sd_m: 0.005,
            ..exact
        };
        assert!(last_error_m(slipping) > 0.02);
    }

    #[test]
    fn sightings_lead_to_what_was_seen() {
        let exact = WheelSettings {
            n_robots: 2,
            range_sd_m: 0.0,
            bearing_sd_rad: 0.0,
            sightings_hz: 10.0,
            ..WheelSettings::default()
        };
        let mut wheels = Wheels::new(exact);
        let mut n_seen = 0;
        for _ in 0..50 {
            let ticks = wheels.tick();
            for tick in &ticks {
                for reading in &tick.readings {
                    let ReadingBody::Sighting {
                        target,
                        range_m,
                        azimuth_rad,
                        ..
                    } = &reading.body
                    else {
                        continue;
                    };
                    let (sin, cos) = azimuth_rad.sin_cos();
                    let ahead = Vector3::new(cos, sin, 0.0) * *range_m;
                    let there = (tick.truth.pose * nalgebra::Point3::from(ahead))
                        .coords
                        .xy();
                    let target_m = match target {
                        ReadingTarget::Landmark(name) => {
                            let number: usize = name["landmark-".len()..].parse().unwrap();
                            wheels.landmarks_m[number - 1]
                        }
                        ReadingTarget::Robot(name) => {
                            let other = ticks.iter().find(|tick| robot_name(tick.robot) == *name);
                            other.unwrap().truth.pose.translation.vector.xy()
                        }
                    };
                    assert!((there - target_m).norm() < 1e-9);
                    n_seen += 1;
                }
            }
        }
        assert!(n_seen > 100);
    }

    #[test]
    fn robots_stay_in_the_room() {
        let (_, truth) = readings(WheelSettings::default(), 3000);
        for pose in truth {
            let at_m = pose.pose.translation.vector;
            assert!((0.0..12.0).contains(&at_m.x) && (0.0..9.0).contains(&at_m.y));
        }
    }
}
