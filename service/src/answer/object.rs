//! Objects: from lessons and questions to contacts, and from what is known to the answers.

use cogmap_proto as wire;
use cogmap_proto::limits::{IDENTIFY_CONTACTS_MAX, LESSON_CONTACTS_MAX};
use cognitive_map::{AgentId, CognitiveMap, Identified, InvalidSample, KnownObject, Lesson, Touch};
use geometry::upper_triangle;
use object_recognition::{
    LevelMemory, ModelPlace, ObjectId, ObjectModel, Orientation, PoseEstimate, Posterior, Verdict,
};

use crate::decode::{self, fault};

/// Least probability of an object that is named in an answer.
const PROBABILITY_MIN: f64 = 1e-6;

/// Why nothing can be learned or recognised.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidContacts {
    /// There are none, or too many.
    #[error("contacts must be 1 to {0}, not {1}")]
    Count(usize, usize),
    /// A contact makes no sense; which field of which.
    #[error("{0}: {1}")]
    Contact(String, InvalidSample),
    /// The noise, the spacing or the orientation makes no sense.
    #[error("{0}: {1}")]
    Field(String, InvalidSample),
    /// The name is none.
    #[error("name: {0}")]
    Name(InvalidSample),
}

/// A lesson that has just come, as the map takes it.
///
/// # Errors
/// Says which rule it breaks.
pub fn lesson(lesson: &wire::ObjectLesson) -> Result<Lesson, InvalidContacts> {
    check_channels(&lesson.contacts)?;
    journaled_lesson(lesson)
}

/// A lesson of the journal: as [`lesson`], but for names of channels, which older versions took in more
/// forms.
///
/// # Errors
/// Says which rule it breaks.
pub fn journaled_lesson(lesson: &wire::ObjectLesson) -> Result<Lesson, InvalidContacts> {
    check_count(lesson.contacts.len(), LESSON_CONTACTS_MAX)?;
    let spacing = decode::spacing(lesson.spacing_m);
    let spacing = spacing.map_err(|error| {
        InvalidContacts::Field(format!("spacing_m {}", lesson.spacing_m), error)
    })?;
    let noise = decode::touch_noise(&lesson.noise);
    let noise = noise.map_err(|error| of_noise(&lesson.noise, error))?;
    let touches = decode::touches(&lesson.contacts, noise);
    let touches = touches.map_err(|refused| of_contact(&lesson.contacts, refused))?;
    Ok(Lesson::new(spacing, touches))
}

/// A sequence of contacts whose object is asked for, and what is known of how it is turned.
///
/// # Errors
/// Says which rule the query breaks.
pub fn touches_to_identify(
    query: &wire::IdentifyQuery,
) -> Result<(Orientation, Vec<Touch>), InvalidContacts> {
    check_count(query.contacts.len(), IDENTIFY_CONTACTS_MAX)?;
    check_channels(&query.contacts)?;
    let orientation = decode::orientation(&query.orientation);
    let orientation =
        orientation.map_err(|error| InvalidContacts::Field("orientation".to_owned(), error))?;
    let noise = decode::touch_noise(&query.noise);
    let noise = noise.map_err(|error| of_noise(&query.noise, error))?;
    let touches = decode::touches(&query.contacts, noise);
    let touches = touches.map_err(|refused| of_contact(&query.contacts, refused))?;
    Ok((orientation, touches))
}

/// The episode of an agent, and the latest one that has ended.
pub fn agent_object(
    space: &str,
    map: &CognitiveMap,
    agent: AgentId,
    name: &str,
    last: Option<wire::EndedEpisode>,
) -> wire::AgentObject {
    let episode = map.episode(agent);
    wire::AgentObject {
        space: space.to_owned(),
        agent: name.to_owned(),
        episode: { episode.as_ref() }.map(|(teaches, _)| wire::EpisodeKind::of(*teaches)),
        identification: episode.map(|(_, identified)| identification(space, map, &identified)),
        last,
    }
}

/// What is known of an object.
pub fn object_summary(known: &KnownObject, model: &ObjectModel) -> wire::ObjectSummary {
    let corner = |pick: fn(f64, f64) -> f64| {
        let positions = model.places().iter().map(|place| place.position_m);
        let corner = positions.reduce(|a, b| a.coords.zip_map(&b.coords, pick).into());
        corner.map_or([0.0; 3], |corner| corner.coords.into())
    };
    wire::ObjectSummary {
        name: known.name().as_str().to_owned(),
        places: model.places().len() as u64,
        spacing_m: model.spacing_m(),
        min_m: corner(f64::min),
        max_m: corner(f64::max),
        contacts: known.contacts(),
        visits: known.visits(),
    }
}

/// An object with its places.
pub fn object_detail(
    map: &CognitiveMap,
    known: &KnownObject,
    model: &ObjectModel,
) -> wire::ObjectDetail {
    wire::ObjectDetail {
        summary: object_summary(known, model),
        places: { model.places().iter() }
            .map(|place| object_place(map, place))
            .collect(),
    }
}

fn object_place(map: &CognitiveMap, place: &ModelPlace) -> wire::ObjectPlace {
    let level = |level: &LevelMemory| {
        Some(wire::ObjectLevel {
            channel: map.object_channel(level.channel)?.as_str().to_owned(),
            mean: level.mean,
            sd: level.variance().max(0.0).sqrt(),
        })
    };
    wire::ObjectPlace {
        position_m: place.position_m.coords.into(),
        normal: place.normal().map(|normal| normal.into_inner().into()),
        contacts: place.count,
        levels: place.levels.iter().filter_map(level).collect(),
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

fn check_channels(contacts: &[wire::Contact]) -> Result<(), InvalidContacts> {
    let checked = decode::check_channels(contacts);
    checked.map_err(|refused| of_contact(contacts, refused))
}

fn of_contact(contacts: &[wire::Contact], (at, error): (usize, InvalidSample)) -> InvalidContacts {
    InvalidContacts::Contact(fault::in_contact(at, &contacts[at]), error)
}

fn of_noise(noise: &wire::TouchNoise, error: InvalidSample) -> InvalidContacts {
    InvalidContacts::Field(fault::in_touch_noise(noise), error)
}

fn check_count(count: usize, most: usize) -> Result<(), InvalidContacts> {
    if (1..=most).contains(&count) {
        Ok(())
    } else {
        Err(InvalidContacts::Count(most, count))
    }
}
