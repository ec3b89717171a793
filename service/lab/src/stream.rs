//! What one robot sends, in order, and where its motion alone would have brought it.

use cogmap_proto::{
    Increment, MotionNoise, Relation, Sample, SampleBody, Sighting, StartPose, Target, Velocity,
};
use nalgebra::{Isometry3, Vector3, Vector6};
use trajectory::StampedPose;

/// Samples of one robot. Their numbers count from 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stream {
    samples: Vec<Sample>,
    pose: Isometry3<f64>,
    reckoned: Vec<StampedPose>,
}

impl Stream {
    /// The samples.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// The start pose, or else the origin, and where each motion leads from there.
    pub fn reckoned(&self) -> &[StampedPose] {
        &self.reckoned
    }

    /// Appends a sample, and answers its number.
    pub fn push(&mut self, stamp_ns: i64, body: SampleBody) -> u64 {
        self.samples.push(Sample { stamp_ns, body });
        self.samples.len() as u64 - 1
    }

    /// The robot is told where it stands.
    pub fn start(&mut self, stamp_ns: i64, pose: &Isometry3<f64>) -> u64 {
        let (translation_m, rotation_xyzw) = parts(pose);
        self.reached(stamp_ns, *pose);
        let start = StartPose {
            translation_m,
            rotation_xyzw,
            noise: None,
        };
        self.push(stamp_ns, SampleBody::StartPose(start))
    }

    /// The robot begins at the origin of a frame of its own, and is told nothing.
    pub fn begin(&mut self, stamp_ns: i64) {
        self.reached(stamp_ns, Isometry3::identity());
    }

    /// The robot moved by this since the last motion.
    pub fn increment(
        &mut self,
        stamp_ns: i64,
        motion: &Isometry3<f64>,
        noise: Option<MotionNoise>,
    ) -> u64 {
        let (translation_m, rotation_xyzw) = parts(motion);
        self.reached(stamp_ns, self.pose * motion);
        let increment = Increment {
            translation_m,
            rotation_xyzw,
            noise,
        };
        self.push(stamp_ns, SampleBody::Increment(increment))
    }

    /// The robot moved at this velocity \[m/s, rad/s\] for a time that ends at the stamp.
    pub fn velocity(
        &mut self,
        stamp_ns: i64,
        [linear, angular]: [Vector3<f64>; 2],
        duration_s: f64,
    ) -> u64 {
        let motion = geometry::se3::exp(&(linear * duration_s), &(angular * duration_s));
        self.reached(stamp_ns, self.pose * motion);
        let velocity = Velocity {
            linear_m_s: linear.into(),
            angular_rad_s: angular.into(),
            duration_s,
            noise: None,
        };
        self.push(stamp_ns, SampleBody::Velocity(velocity))
    }

    /// The robot saw something.
    pub fn sighting(&mut self, stamp_ns: i64, target: Target, relation: Relation) -> u64 {
        self.push(
            stamp_ns,
            SampleBody::Sighting(Sighting { target, relation }),
        )
    }

    fn reached(&mut self, stamp_ns: i64, pose: Isometry3<f64>) {
        self.pose = pose;
        self.reckoned.push(StampedPose { stamp_ns, pose });
    }
}

/// A pose that was seen, with its standard deviations \[m, m, m, rad, rad, rad\] in the axes of
/// what was seen.
pub fn seen_pose(pose: &Isometry3<f64>, sd: &Vector6<f64>) -> Relation {
    let (translation_m, rotation_xyzw) = parts(pose);
    Relation::Pose {
        translation_m,
        rotation_xyzw,
        noise: motion_noise(sd),
    }
}

/// Standard deviations \[m, m, m, rad, rad, rad\] as a sample states them.
pub fn motion_noise(sd: &Vector6<f64>) -> MotionNoise {
    MotionNoise {
        translation_sd_m: [sd[0], sd[1], sd[2]],
        rotation_sd_rad: [sd[3], sd[4], sd[5]],
    }
}

fn parts(pose: &Isometry3<f64>) -> ([f64; 3], [f64; 4]) {
    (pose.translation.vector.into(), pose.rotation.coords.into())
}
