//! Poses of trajectories.

use ::trajectory::StampedPose;
use cogmap_proto as wire;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// Pose of a trajectory.
pub fn stamped_pose(row: &wire::StampedPose) -> StampedPose {
    let [x, y, z, w] = row.rotation_xyzw;
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
    let translation = Translation3::from(Vector3::from(row.translation_m));
    StampedPose {
        stamp_ns: row.stamp_ns,
        pose: Isometry3::from_parts(translation, rotation),
    }
}
