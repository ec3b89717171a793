//! A data set as the stream of readings which the robots would have sent.

use super::data_set::{FIRST_LANDMARK, Mrclam};
use super::robot::{Command, Measurement, RobotLog};
use cogmap_worlds::{Reading, ReadingBody, ReadingTarget, robot_name};
use trajectory::Span;

/// Standard deviation that a sighting states for its range \[m\].
///
/// Over set 6 and a similar one the range's robust deviation from the truth is 0.07 to 0.18 m.
pub const RANGE_SD_M: f64 = 0.15;
/// Standard deviation that a sighting states for its bearing \[rad\].
///
/// Over the same sets 0.006 to 0.018 rad were found; the camera's delay while turning adds to it.
pub const BEARING_SD_RAD: f64 = 0.025;
/// Longest motion of one reading: an hour, the most that the core accepts \[ns\].
const PIECE_NS_MAX: i64 = 3_600_000_000_000;

/// A reading of one robot of the team.
#[derive(Clone, Debug, PartialEq)]
pub struct TeamReading {
    /// Number of the robot.
    pub robot: u32,
    /// What it read.
    pub reading: Reading,
}

impl TeamReading {
    /// The same reading, of a robot that gives landmarks names of its own, which nobody else uses:
    /// `landmark-6` is `landmark-6-of-robot3` to robot 3. Other robots it calls as everybody does.
    #[must_use]
    pub fn with_own_names(mut self) -> Self {
        if let ReadingBody::Sighting {
            target: ReadingTarget::Landmark(name),
            ..
        } = &mut self.reading.body
        {
            name.push_str("-of-");
            name.push_str(&robot_name(self.robot));
        }
        self
    }
}

impl Mrclam {
    /// The readings of one robot over the common span `t0..t1`; empty for a robot that the set
    /// has not.
    ///
    /// - First a start pose at `t0`: the truth, interpolated linearly, in the plane z = 0.
    /// - Each odometry command holds until the next row. The command in force at `t0` is cut
    ///   there, the last one at `t1`. A command is cut again at each sighting which falls into it,
    ///   so that motion and sightings come in their exact order. Each piece is a velocity stamped
    ///   at its end, lasting `(end_ns − start_ns) · 1e-9` seconds; pieces of no length are left
    ///   out, pieces longer than an hour are split into hours and a rest.
    /// - Each measurement with `t0 < t < t1` is a sighting at its own stamp: of a landmark
    ///   `landmark-<subject>`, or of another robot of the set by its name. Sightings of oneself
    ///   and of robots that are not in the set are left out, and cut no command.
    ///
    /// Readings come by stamp, a motion before the sightings at its end, those in the file's order.
    pub fn robot_readings(&self, robot: u32) -> Vec<Reading> {
        let Some(log) = self.robots().get(&robot) else {
            return Vec::new();
        };
        let span = self.span();
        let mut readings = Vec::with_capacity(log.odometry.len() + log.measurements.len() + 1);
        readings.push(start_pose(log, span.start_ns));
        let mut sightings = log
            .measurements
            .iter()
            .filter(|seen| span.start_ns < seen.stamp_ns && seen.stamp_ns < span.end_ns)
            .filter_map(|seen| Some(sighting(seen, self.target(robot, seen.subject)?)))
            .peekable();
        let mut now_ns = span.start_ns;
        for (command, until_ns) in held(&log.odometry, span) {
            while let Some(seen) = sightings.next_if(|seen| seen.stamp_ns <= until_ns) {
                push_motion(&mut readings, command, now_ns, seen.stamp_ns);
                now_ns = seen.stamp_ns;
                readings.push(seen);
            }
            push_motion(&mut readings, command, now_ns, until_ns);
            now_ns = until_ns;
        }
        readings
    }

    /// The readings of all robots by stamp; at one stamp, by robot number.
    pub fn team_readings(&self) -> Vec<TeamReading> {
        let mut team: Vec<TeamReading> = Vec::new();
        for &robot in self.robots().keys() {
            let readings = self.robot_readings(robot).into_iter();
            team.extend(readings.map(|reading| TeamReading { robot, reading }));
        }
        // The sort is stable, so each robot's own order is kept.
        team.sort_by_key(|entry| (entry.reading.stamp_ns, entry.robot));
        team
    }

    /// What `robot` saw when it saw `subject`.
    fn target(&self, robot: u32, subject: u32) -> Option<ReadingTarget> {
        if subject >= FIRST_LANDMARK {
            Some(ReadingTarget::Landmark(format!("landmark-{subject}")))
        } else if subject != robot && self.robots().contains_key(&subject) {
            Some(ReadingTarget::Robot(robot_name(subject)))
        } else {
            None
        }
    }
}

/// The commands in force over `span`, each with the instant until which it holds \[ns\].
///
/// The span ends no later than the last row, so nothing has to be held beyond the table.
fn held(odometry: &[Command], span: Span) -> impl Iterator<Item = (&Command, i64)> {
    let first = odometry
        .partition_point(|row| row.stamp_ns <= span.start_ns)
        .saturating_sub(1);
    let next = odometry[first..].iter().skip(1).map(|row| row.stamp_ns);
    odometry[first..]
        .iter()
        .zip(next)
        .take_while(move |(command, _)| command.stamp_ns < span.end_ns)
        .map(move |(command, next_ns)| (command, next_ns.min(span.end_ns)))
}

/// A command carried out from one instant to another, in pieces of an hour at most.
fn push_motion(readings: &mut Vec<Reading>, command: &Command, start_ns: i64, end_ns: i64) {
    let mut now_ns = start_ns;
    while now_ns < end_ns {
        let piece_ns = end_ns.saturating_sub(now_ns).min(PIECE_NS_MAX);
        now_ns += piece_ns;
        let body = ReadingBody::Velocity {
            linear_m_s: [command.forward_m_s, 0.0, 0.0],
            angular_rad_s: [0.0, 0.0, command.turn_rad_s],
            duration_s: piece_ns as f64 * 1e-9,
            noise: None,
        };
        readings.push(Reading {
            stamp_ns: now_ns,
            body,
        });
    }
}

fn sighting(seen: &Measurement, target: ReadingTarget) -> Reading {
    let body = ReadingBody::Sighting {
        target,
        range_m: seen.range_m,
        azimuth_rad: seen.bearing_rad,
        elevation_rad: 0.0,
        range_sd_m: RANGE_SD_M,
        bearing_sd_rad: BEARING_SD_RAD,
    };
    Reading {
        stamp_ns: seen.stamp_ns,
        body,
    }
}

/// The true pose at the start of the common span.
fn start_pose(log: &RobotLog, start_ns: i64) -> Reading {
    let truth = log
        .truth_at(start_ns)
        .expect("the common span lies inside every truth");
    let half = truth.heading_rad / 2.0;
    let body = ReadingBody::StartPose {
        translation_m: [truth.x_m, truth.y_m, 0.0],
        rotation_xyzw: [0.0, 0.0, half.sin(), half.cos()],
    };
    Reading {
        stamp_ns: start_ns,
        body,
    }
}
