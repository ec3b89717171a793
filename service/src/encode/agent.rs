//! Agents: where they are and how sure that is.

use cogmap_proto as wire;
use cognitive_map::{Agent, AgentId, CognitiveMap, Status};
use geometry::upper_triangle;

use super::trajectory::stamped;
use super::{FRAME, UNPLACED_FRAME};

/// The estimate of an agent by the owner of a term; nothing before the agent's first sample.
pub(crate) fn estimate(
    space: &str,
    term: u64,
    map: &CognitiveMap,
    id: AgentId,
) -> Option<wire::Estimate> {
    let agent = map.agent(id)?;
    let stamp_ns = agent.stamp_ns()?;
    let pose = stamped(stamp_ns, agent.pose());
    let covariance = { map.covariance(id)? }.in_map_axes(&agent.pose().rotation);
    let (place, confidence) = match agent.place() {
        Some((place, confidence)) => (Some(place.0.into()), confidence),
        None => (None, 0.0),
    };
    Some(wire::Estimate {
        space: space.to_owned(),
        agent: agent.name().as_str().to_owned(),
        session: agent.session(),
        seq: agent.next_seq().saturating_sub(1),
        stamp_ns,
        frame: if map.is_in_map(id) {
            FRAME
        } else {
            UNPLACED_FRAME
        }
        .to_owned(),
        map_revision: map.revision(),
        status: status(map.status(id)?),
        translation_m: pose.translation_m,
        rotation_xyzw: pose.rotation_xyzw,
        covariance: upper_triangle(&covariance),
        place,
        confidence,
        term,
    })
}

/// The pose that an agent's motions alone lead to; nothing before its first sample.
pub(crate) fn odometry(agent: &Agent) -> Option<wire::StampedPose> {
    Some(stamped(agent.stamp_ns()?, agent.odometry()))
}

/// What became of an agent's sightings, as the wire has it.
pub fn evidence(agent: &Agent) -> wire::Evidence {
    let evidence = agent.evidence();
    let components = evidence.components as f64;
    wire::Evidence {
        accepted: evidence.accepted,
        refused: evidence.refused,
        refused_in_a_row: evidence.refused_in_a_row.into(),
        nis_mean: (components > 0.0).then(|| evidence.nis / components),
    }
}

/// How an agent is localised, as the wire has it.
pub(super) fn status(status: Status) -> wire::Status {
    match status {
        Status::Localized => wire::Status::Localized,
        Status::Uncertain => wire::Status::Uncertain,
        Status::Lost => wire::Status::Lost,
    }
}
