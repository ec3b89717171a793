//! What those who watch a space live are shown.

use cogmap_proto as wire;
use cognitive_map::{AgentId, CognitiveMap, Relation, Sample, SampleBody, Target};
use nalgebra::{Point3, Vector3};

/// The line of sight of a sighting that was just applied; nothing where the sample is none, or is
/// one of the agent's own past, or the agent is not in `map`.
pub(crate) fn live_sighting(
    map: &CognitiveMap,
    id: AgentId,
    sample: &Sample,
) -> Option<wire::LiveSighting> {
    let SampleBody::Sighting(sighting) = &sample.body else {
        return None;
    };
    let target = match &sighting.target {
        Target::Landmark(label) => wire::Target::Landmark(label.as_str().to_owned()),
        Target::Agent(name) => wire::Target::Agent(name.as_str().to_owned()),
        Target::OwnSample(_) => return None,
    };
    let agent = map.agent(id).filter(|agent| agent.placed())?;
    let pose = agent.pose();
    let to = match in_body(&sighting.relation) {
        Some(seen) => pose * Point3::from(seen),
        None => estimated(map, &sighting.target)?,
    };
    Some(wire::LiveSighting {
        agent: agent.name().as_str().to_owned(),
        stamp_ns: sample.stamp_ns,
        from_m: pose.translation.vector.into(),
        to_m: to.coords.into(),
        target,
    })
}

/// Where a target is estimated to be in `map`, once that is known.
fn estimated(map: &CognitiveMap, target: &Target) -> Option<Point3<f64>> {
    match target {
        Target::Landmark(label) => {
            let (_, landmark) = map.landmark_by_label(label.as_str())?;
            Some(*landmark.position())
        }
        Target::Agent(name) => {
            let agent = map.agent(map.agent_by_name(name)?)?;
            { agent.placed() }.then(|| agent.pose().translation.vector.into())
        }
        Target::OwnSample(_) => None,
    }
}

/// Position of a target in the body frame \[m\]; `None` of a distance alone.
fn in_body(relation: &Relation) -> Option<Vector3<f64>> {
    Some(match relation {
        Relation::Position(seen) => *seen.translation_m(),
        Relation::RangeBearing(seen) => {
            let (azimuth, elevation) = (seen.azimuth_rad(), seen.elevation_rad());
            let ahead = elevation.cos();
            let direction = Vector3::new(
                ahead * azimuth.cos(),
                ahead * azimuth.sin(),
                elevation.sin(),
            );
            seen.range_m() * direction
        }
        Relation::Pose(seen) => seen.pose().translation.vector,
        Relation::Range(_) => return None,
    })
}

/// Sizes of a space.
pub(crate) fn live_counts(map: &CognitiveMap) -> wire::LiveCounts {
    wire::LiveCounts {
        agents: map.agent_count() as u64,
        places: map.place_count() as u64,
        trips: map.trip_count() as u64,
        landmarks: map.landmark_count() as u64,
        objects: map.object_count() as u64,
    }
}
