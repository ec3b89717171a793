//! Streams of samples: a drive through a world with landmarks, and a circle in closed form.

use std::f64::consts::{PI, TAU};

use cogmap_proto::{
    Descriptor, Level, Marker, MotionNoise, Relation, Sample, SampleBatch, SampleBody, Sighting,
    StartPose, Target, Velocity,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Time between two samples of motion \[s\].
const STEP_S: f64 = 0.02;
/// The same \[ns\].
const STEP_NS: i64 = 20_000_000;
/// Stamp of the first sample \[ns\].
const START_NS: i64 = 1_700_000_000_000_000_000;
/// Landmarks stand on a circle of this radius \[m\] around the start.
const LANDMARK_RADIUS_M: f64 = 8.0;

/// An endless drive: a start pose, then motion with now and then a sighting, a level, a descriptor
/// or a marker. The seed fixes every sample.
#[derive(Clone, Debug)]
pub struct Drive {
    random: ChaCha8Rng,
    count: u64,
    stamp_ns: i64,
    /// The true pose, x, y \[m\] and heading \[rad\].
    pose: [f64; 3],
    turn_rad_s: f64,
    descriptor_len: usize,
}

impl Drive {
    /// The drive of a seed.
    pub fn new(seed: u64) -> Self {
        Self {
            random: ChaCha8Rng::seed_from_u64(seed),
            count: 0,
            stamp_ns: START_NS,
            pose: [0.0; 3],
            turn_rad_s: 0.0,
            descriptor_len: 16,
        }
    }

    /// The same with descriptors of this length, for streams that fill disks.
    #[must_use]
    pub fn with_descriptors_of(mut self, len: usize) -> Self {
        self.descriptor_len = len;
        self
    }

    fn motion(&mut self) -> SampleBody {
        self.stamp_ns += STEP_NS;
        let nudge: f64 = self.random.random_range(-0.2..0.2);
        self.turn_rad_s = (0.98 * self.turn_rad_s + nudge).clamp(-1.5, 1.5);
        // Home again before the landmarks are out of sight.
        let [x, y, heading] = self.pose;
        if x.hypot(y) > LANDMARK_RADIUS_M {
            let home = (-y).atan2(-x) - heading;
            self.turn_rad_s = (home + PI).rem_euclid(TAU) - PI;
        }
        let speed_m_s = self.random.random_range(0.3..0.9);
        self.pose = [
            x + speed_m_s * STEP_S * heading.cos(),
            y + speed_m_s * STEP_S * heading.sin(),
            heading + self.turn_rad_s * STEP_S,
        ];
        velocity(speed_m_s, self.turn_rad_s, STEP_S)
    }

    fn sighting(&mut self) -> SampleBody {
        let number = self.random.random_range(0..8_u32);
        let bearing = TAU * f64::from(number) / 8.0;
        let [x, y, heading] = self.pose;
        let (dx, dy) = (
            LANDMARK_RADIUS_M * bearing.cos() - x,
            LANDMARK_RADIUS_M * bearing.sin() - y,
        );
        let noise: f64 = self.random.random_range(-0.02..0.02);
        SampleBody::Sighting(Sighting {
            target: Target::Landmark(format!("post {number}")),
            relation: Relation::RangeBearing {
                range_m: dx.hypot(dy) + noise,
                azimuth_rad: (dy.atan2(dx) - heading + PI).rem_euclid(TAU) - PI,
                elevation_rad: 0.0,
                range_sd_m: 0.05,
                bearing_sd_rad: 0.02,
            },
        })
    }
}

impl Iterator for Drive {
    type Item = Sample;

    fn next(&mut self) -> Option<Sample> {
        let count = self.count;
        self.count += 1;
        let body = match count {
            0 => SampleBody::StartPose(StartPose {
                translation_m: [0.0; 3],
                rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
                noise: Some(MotionNoise {
                    translation_sd_m: [0.01; 3],
                    rotation_sd_rad: [0.01; 3],
                }),
            }),
            _ if count.is_multiple_of(500) => SampleBody::Marker(Marker {
                label: format!("lap {}", count / 500),
                ends_trip: count.is_multiple_of(1000),
            }),
            _ if count.is_multiple_of(100) => {
                let vector = (0..self.descriptor_len)
                    .map(|_| self.random.random_range(-1.0..1.0))
                    .collect();
                let channel = "camera".to_owned();
                SampleBody::Descriptor(Descriptor { channel, vector })
            }
            _ if count.is_multiple_of(40) => SampleBody::Level(Level {
                channel: "light".to_owned(),
                value: self.random.random_range(0.0..1.0),
                offset_m: [0.1, 0.0, 0.2],
                normal: None,
            }),
            _ if count.is_multiple_of(25) => self.sighting(),
            _ => self.motion(),
        };
        Some(Sample {
            stamp_ns: self.stamp_ns,
            body,
        })
    }
}

/// A batch of samples.
pub fn batch(session: u64, first_seq: u64, samples: Vec<Sample>) -> SampleBatch {
    SampleBatch {
        session,
        first_seq,
        samples,
    }
}

/// Motion straight ahead and about the vertical, held for a time.
pub fn velocity(forward_m_s: f64, turn_rad_s: f64, duration_s: f64) -> SampleBody {
    SampleBody::Velocity(Velocity {
        linear_m_s: [forward_m_s, 0.0, 0.0],
        angular_rad_s: [0.0, 0.0, turn_rad_s],
        duration_s,
        noise: None,
    })
}

/// One round on a circle of a radius \[m\] to the left of the start, in `steps` samples of 20 ms
/// after a start pose at the origin, and the position \[m\] after each sample in closed form.
pub fn circle(radius_m: f64, steps: u32) -> (Vec<Sample>, Vec<[f64; 3]>) {
    let turn_rad_s = TAU / (f64::from(steps) * STEP_S);
    let mut samples = vec![Sample {
        stamp_ns: START_NS,
        body: SampleBody::StartPose(StartPose {
            translation_m: [0.0; 3],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            noise: None,
        }),
    }];
    let mut positions = vec![[0.0; 3]];
    for step in 1..=steps {
        samples.push(Sample {
            stamp_ns: START_NS + i64::from(step) * STEP_NS,
            body: velocity(turn_rad_s * radius_m, turn_rad_s, STEP_S),
        });
        let (sin, cos) = (TAU * f64::from(step) / f64::from(steps)).sin_cos();
        positions.push([radius_m * sin, radius_m * (1.0 - cos), 0.0]);
    }
    (samples, positions)
}
