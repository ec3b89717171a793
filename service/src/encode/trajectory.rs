//! Trajectories.

use ::trajectory::StampedPose;
use cogmap_proto as wire;
use nalgebra::Isometry3;

use super::FRAME;

/// A page of a trajectory: refined by the map of a revision, or causal where there is none.
pub fn trajectory(
    agent: &str,
    session: u64,
    revision: Option<u64>,
    poses: &[StampedPose],
    next_from_ns: Option<i64>,
) -> wire::Trajectory {
    let kind = if revision.is_some() {
        "refined"
    } else {
        "causal"
    };
    wire::Trajectory {
        agent: agent.to_owned(),
        session,
        frame: FRAME.to_owned(),
        kind: kind.to_owned(),
        map_revision: revision,
        poses: { poses.iter() }
            .map(|row| stamped(row.stamp_ns, &row.pose))
            .collect(),
        next_from_ns,
    }
}

/// A pose at a time.
pub fn stamped(stamp_ns: i64, pose: &Isometry3<f64>) -> wire::StampedPose {
    wire::StampedPose {
        stamp_ns,
        translation_m: pose.translation.vector.into(),
        rotation_xyzw: pose.rotation.coords.into(),
    }
}
