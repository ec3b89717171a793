//! Which object is touched, and in which pose.

use cogmap_proto as wire;
use cognitive_map::{CognitiveMap, Identified};
use geometry::upper_triangle;
use object_recognition::{
    Contact, LevelReading, ObjectId, PoseEstimate, Posterior, Reached, Verdict,
};

/// Least probability of an object that is named in an answer.
const PROBABILITY_MIN: f64 = 1e-6;

/// The episode of an agent, and the latest one that has ended. An episode says whether it teaches,
/// and what is recognised by which contacts.
pub fn agent_object(
    space: &str,
    map: &CognitiveMap,
    agent: &str,
    (episode, contacts): (Option<&(bool, Identified)>, &[Contact]),
    last: Option<wire::EndedEpisode>,
) -> wire::AgentObject {
    wire::AgentObject {
        space: space.to_owned(),
        agent: agent.to_owned(),
        episode: episode.map(|(teaches, _)| wire::EpisodeKind::of(*teaches)),
        identification: episode.map(|(_, identified)| identification(space, map, identified)),
        last,
        contacts: contacts.iter().map(|felt| contact(map, felt)).collect(),
    }
}

/// A contact of an episode, without descriptors.
fn contact(map: &CognitiveMap, felt: &Contact) -> wire::Contact {
    let level = |level: &LevelReading| {
        let channel = map.object_channel(level.channel)?;
        Some(wire::ContactLevel {
            channel: channel.as_str().to_owned(),
            value: level.value,
        })
    };
    wire::Contact {
        position_m: felt.position_m.into(),
        normal: felt.normal.map(|normal| normal.into_inner().into()),
        levels: felt.levels.iter().filter_map(level).collect(),
        descriptors: Vec::new(),
        drift_sd_m: felt.drift_sd_m,
        reached: match felt.reached {
            Reached::Found => wire::Reached::Found,
            Reached::Drawn => wire::Reached::Drawn,
            Reached::Aimed => wire::Reached::Aimed,
        },
    }
}

/// What is recognised of an object.
pub fn identification(
    space: &str,
    map: &CognitiveMap,
    identified: &Identified,
) -> wire::Identification {
    let Identified {
        posterior,
        next_touch,
        explanation,
    } = identified;
    let Posterior {
        objects,
        unknown,
        pose,
        live_hypotheses,
        live_objects,
        entropy_nats,
        contacts,
        fit,
        answer_probability: _, // told by the settings of the space
    } = posterior;
    let name = |id: ObjectId| map.object(id).map(|known| known.name().as_str().to_owned());
    let likely = objects
        .iter()
        .filter(|&&(_, probability)| probability >= PROBABILITY_MIN);
    wire::Identification {
        space: space.to_owned(),
        map_revision: map.revision(),
        verdict: match posterior.verdict() {
            Verdict::Unknown => wire::ObjectVerdict::Unknown {},
            Verdict::Object(id) => name(id).map_or(wire::ObjectVerdict::Undecided {}, |name| {
                wire::ObjectVerdict::Object { name }
            }),
            Verdict::Undecided => wire::ObjectVerdict::Undecided {},
        },
        objects: likely
            .filter_map(|&(id, probability)| {
                Some(wire::ObjectProbability {
                    name: name(id)?,
                    probability,
                })
            })
            .collect(),
        unknown: *unknown,
        live_objects: *live_objects as u64,
        live_hypotheses: *live_hypotheses as u64,
        entropy_nats: *entropy_nats,
        contacts: *contacts as u64,
        fit: *fit,
        pose: pose
            .as_ref()
            .and_then(|pose| Some(object_pose(name(pose.object)?, pose))),
        next_touch: next_touch.as_ref().map(|touch| wire::NextTouch {
            position_m: touch.point_m.coords.into(),
            approach: touch.approach.map(|way| way.into_inner().into()),
            gain_nats: touch.gain_nats,
        }),
        explored: explanation.explored,
        rival: { explanation.rival.as_ref() }.and_then(|(id, said)| {
            Some(wire::RivalObject {
                name: name(*id)?,
                contacts_nats: said.clone(),
            })
        }),
    }
}

fn object_pose(object: String, pose: &PoseEstimate) -> wire::ObjectPose {
    let frame = &pose.map_from_episode;
    wire::ObjectPose {
        object,
        translation_m: frame.translation.vector.into(),
        rotation_xyzw: frame.rotation.coords.into(),
        covariance: upper_triangle(pose.covariance.matrix()),
        share: pose.share,
        others: { pose.others.iter() }
            .map(|(frame, share)| wire::OtherPose {
                translation_m: frame.translation.vector.into(),
                rotation_xyzw: frame.rotation.coords.into(),
                share: *share,
            })
            .collect(),
    }
}
