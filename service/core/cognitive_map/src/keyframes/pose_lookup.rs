//! Poses of the past: what place recognition asks of the chains of keyframes.

use nalgebra::Isometry3;
use place_recognition::{Keyframes, SampleKey};

use super::chains::Chains;

impl Keyframes for Chains {
    fn pose_at(&self, sample: SampleKey) -> Option<Isometry3<f64>> {
        self.pose_of(&self.at_sample(sample)?)
    }

    fn motion_between(&self, from: SampleKey, to: SampleKey) -> Option<Isometry3<f64>> {
        let pose = |sample: SampleKey| self.own_pose_of(&self.at_sample(sample)?);
        Some(pose(from)?.inv_mul(&pose(to)?))
    }

    fn is_planar(&self, agent: u32) -> bool {
        let own = self.track(agent);
        own.is_some_and(|track| track.is_planar)
            && self
                .tracks
                .iter()
                .all(|track| track.is_planar || !track.is_in_map())
    }
}
