//! Poses of trajectories.

use cogmap_proto::StampedPose;
use nalgebra::Isometry3;

/// A pose at a time, as the wire has it.
pub fn stamped(stamp_ns: i64, pose: &Isometry3<f64>) -> StampedPose {
    let rotation = pose.rotation.coords;
    StampedPose {
        stamp_ns,
        translation_m: pose.translation.vector.into(),
        rotation_xyzw: [rotation.x, rotation.y, rotation.z, rotation.w],
    }
}
