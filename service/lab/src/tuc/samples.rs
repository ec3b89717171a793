//! A data set as its robot would have sent it.

use cogmap_proto::Target;
use nalgebra::{Isometry3, Vector6};

use super::data_set::{Match, Tuc};
use crate::stream::{Stream, motion_noise, seen_pose};

/// How far apart two samples of one place are taken, along each axis \[m\] …
const POSITION_SD_M: f64 = 0.5;
/// … and in heading \[rad\].
const HEADING_SD_RAD: f64 = 0.2;

/// How the robot tells its motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// As increments with the noise that the set states.
    StatedNoise,
    /// As velocities without noise, so that the space's odometry noise holds.
    UnstatedNoise,
}

impl Tuc {
    /// The set with these matches, which need not be its own: the robot's true pose at the first
    /// step, a motion at each further one, and each match at the later of its moments, as a
    /// sighting of what the robot was at the earlier one. A match says that two poses are one, to
    /// within what recognition of a place is good for. A moment is put at the step next to it;
    /// two moments next to the same step say nothing.
    pub fn stream(&self, matches: &[Match], motion: Motion) -> Stream {
        let ends = matches
            .iter()
            .map(|found| (self.step_at(found.later_ns), self.step_at(found.earlier_ns)));
        let mut ends: Vec<(usize, usize)> =
            ends.filter(|(later, earlier)| later != earlier).collect();
        ends.sort_unstable();
        let mut ends = ends.into_iter().peekable();
        let mut sd = Vector6::zeros();
        (sd[0], sd[1], sd[5]) = (POSITION_SD_M, POSITION_SD_M, HEADING_SD_RAD);
        let same_place = seen_pose(&Isometry3::identity(), &sd);
        let mut stream = Stream::default();
        // Number of the sample that is the motion of a step; the start pose is that of the first.
        let mut motions: Vec<u64> = Vec::with_capacity(self.steps().len());
        for (step, odometry) in self.steps().iter().enumerate() {
            let stamp_ns = odometry.stamp_ns;
            motions.push(match motion {
                _ if step == 0 => stream.start(stamp_ns, self.start()),
                Motion::StatedNoise => {
                    let noise = motion_noise(&odometry.noise_sd);
                    stream.increment(stamp_ns, &odometry.motion, Some(noise))
                }
                Motion::UnstatedNoise => {
                    stream.velocity(stamp_ns, odometry.velocity, odometry.duration_s)
                }
            });
            while let Some((_, earlier)) = ends.next_if(|(later, _)| *later == step) {
                let target = Target::OwnSample(motions[earlier]);
                stream.sighting(stamp_ns, target, same_place.clone());
            }
        }
        stream
    }
}
