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
    wire::Trajectory {
        agent: agent.to_owned(),
        session,
        frame: FRAME.to_owned(),
        kind: kind(revision).to_owned(),
        map_revision: revision,
        poses: { poses.iter() }
            .map(|row| stamped(row.stamp_ns, &row.pose))
            .collect(),
        next_from_ns,
    }
}

/// Where an agent was at a stamp between two poses.
pub fn agent_at(
    agent: &str,
    session: u64,
    revision: Option<u64>,
    [before, after]: [&StampedPose; 2],
    stamp_ns: i64,
) -> wire::AgentAt {
    let at = before.between(after, stamp_ns);
    wire::AgentAt {
        agent: agent.to_owned(),
        session,
        frame: FRAME.to_owned(),
        trajectory: kind(revision).to_owned(),
        stamp_ns,
        translation_m: at.pose.translation.vector.into(),
        rotation_xyzw: at.pose.rotation.coords.into(),
        before_ns: before.stamp_ns,
        after_ns: after.stamp_ns,
        map_revision: revision,
    }
}

/// What a trajectory is: refined by the map of a revision, or causal where there is none.
fn kind(revision: Option<u64>) -> &'static str {
    if revision.is_some() {
        "refined"
    } else {
        "causal"
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
