//! From the map's agent and events to what is published of them.

use cogmap_proto as wire;
use cognitive_map::{
    Agent, AgentId, ChannelKind, CognitiveMap, Event, EventKind, InvalidSample, Label, SkipReason,
    Status, TripEnd,
};

use super::desk::Readout;
use super::surprise::is_surprising;
use super::trajectory::stamped;

/// What is published of an agent; nothing before its first sample.
pub(crate) fn readout(space: &str, map: &CognitiveMap, id: AgentId) -> Option<Readout> {
    let agent = map.agent(id)?;
    let stamp_ns = agent.stamp_ns()?;
    let pose = stamped(stamp_ns, agent.pose());
    let covariance = { map.covariance(id)? }.in_map_axes(&agent.pose().rotation);
    let (place, confidence) = match agent.place() {
        Some((place, confidence)) => (Some(place.0.into()), confidence),
        None => (None, 0.0),
    };
    let estimate = wire::Estimate {
        space: space.to_owned(),
        agent: agent.name().as_str().to_owned(),
        session: agent.session(),
        seq: agent.next_seq().saturating_sub(1),
        stamp_ns,
        frame: "map".to_owned(),
        map_revision: map.revision(),
        status: status(map.status(id)?),
        translation_m: pose.translation_m,
        rotation_xyzw: pose.rotation_xyzw,
        covariance: geometry::upper_triangle(&covariance),
        place,
        confidence,
    };
    let odometry = stamped(stamp_ns, agent.odometry());
    let evidence = evidence(agent);
    Some(Readout::new(
        estimate,
        odometry,
        evidence,
        agent.travelled_m(),
        agent.forgotten_matches(),
    ))
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
pub(crate) fn status(status: Status) -> wire::Status {
    match status {
        Status::Localized => wire::Status::Localized,
        Status::Uncertain => wire::Status::Uncertain,
        Status::Lost => wire::Status::Lost,
    }
}

/// The published form of an event; cell crossings stay inside, there are too many, and so do
/// percepts that are as expected and the ends of episodes, which the agent's desk tells.
pub(crate) fn event(space: &str, map: &CognitiveMap, event: &Event) -> Option<wire::Event> {
    let kind = match &event.kind {
        EventKind::CellEntered { .. } | EventKind::EpisodeEnded { .. } => return None,
        EventKind::AgentEnrolled => wire::EventKind::AgentEnrolled {},
        EventKind::AgentRemoved { .. } => wire::EventKind::AgentRemoved {},
        EventKind::SessionStarted { session } => {
            wire::EventKind::SessionStarted { session: *session }
        }
        EventKind::PlaceRecruited { place, position } => wire::EventKind::PlaceRecruited {
            place: place.0.into(),
            translation_m: position.coords.into(),
        },
        EventKind::PlaceEntered { place, confidence } => wire::EventKind::PlaceEntered {
            place: place.0.into(),
            confidence: *confidence,
        },
        EventKind::TripStarted { trip } => wire::EventKind::TripStarted {
            trip: trip.0.into(),
        },
        EventKind::TripEnded { trip, legs, reason } => wire::EventKind::TripEnded {
            trip: trip.0.into(),
            legs: *legs as u64,
            reason: trip_end(*reason),
        },
        EventKind::LandmarkLearned { landmark, position } => wire::EventKind::LandmarkLearned {
            landmark: map.landmark(*landmark)?.label().as_str().to_owned(),
            translation_m: position.coords.into(),
        },
        EventKind::SamplesSkipped { from, to, reason } => wire::EventKind::SamplesSkipped {
            from: *from,
            to: *to,
            reason: skip_reason(*reason),
        },
        EventKind::PlaceForgotten { place, position } => wire::EventKind::PlaceForgotten {
            place: place.0.into(),
            translation_m: position.coords.into(),
        },
        EventKind::TripForgotten { trip, legs } => wire::EventKind::TripForgotten {
            trip: trip.0.into(),
            legs: *legs as u64,
        },
        EventKind::AgentPlaced { position } => wire::EventKind::AgentPlaced {
            translation_m: position.coords.into(),
        },
        EventKind::ObjectsNarrowed { .. }
        | EventKind::ObjectRecognised { .. }
        | EventKind::ObjectUnknown
        | EventKind::ObjectLearned { .. }
        | EventKind::ObjectNotLearned { .. }
        | EventKind::ObjectsMerged { .. }
        | EventKind::ObjectSplit { .. } => object_event(&event.kind)?,
        EventKind::MarkerPassed { label } => wire::EventKind::MarkerPassed {
            label: label.as_str().to_owned(),
        },
        EventKind::PerceptCompared {
            place,
            channel,
            percepts,
            surprise,
        } => {
            let channel = map.channel(*channel)?;
            if !is_surprising(channel.kind(), *percepts, *surprise) {
                return None;
            }
            wire::EventKind::PerceptSurprising {
                place: place.0.into(),
                channel: channel.label().as_str().to_owned(),
                percept: match channel.kind() {
                    ChannelKind::Level => wire::PerceptKind::Level,
                    ChannelKind::Descriptor { .. } => wire::PerceptKind::Descriptor,
                },
                percepts: *percepts,
                surprise: *surprise,
            }
        }
    };
    // The number of a removed agent may be another one's by now.
    let agent = match &event.kind {
        EventKind::AgentRemoved { name } => name,
        _ => map.agent(event.agent)?.name(),
    };
    Some(wire::Event {
        space: space.to_owned(),
        agent: agent.as_str().to_owned(),
        map_revision: map.revision(),
        stamp_ns: event.stamp_ns,
        kind,
    })
}

/// What happened with objects; none of anything else.
fn object_event(kind: &EventKind) -> Option<wire::EventKind> {
    let text = |name: &Label| name.as_str().to_owned();
    Some(match kind {
        EventKind::ObjectsNarrowed { live } => wire::EventKind::ObjectsNarrowed {
            live: (*live).into(),
        },
        EventKind::ObjectRecognised {
            name, probability, ..
        } => wire::EventKind::ObjectRecognised {
            object: text(name),
            probability: *probability,
        },
        EventKind::ObjectUnknown => wire::EventKind::ObjectUnknown {},
        EventKind::ObjectLearned { name, contacts, .. } => wire::EventKind::ObjectLearned {
            object: text(name),
            contacts: *contacts,
        },
        EventKind::ObjectNotLearned { contacts } => wire::EventKind::ObjectNotLearned {
            contacts: *contacts,
        },
        EventKind::ObjectsMerged { name, absorbed, .. } => wire::EventKind::ObjectsMerged {
            object: text(name),
            absorbed: text(absorbed),
        },
        EventKind::ObjectSplit {
            name, part_name, ..
        } => wire::EventKind::ObjectSplit {
            object: text(name),
            part: text(part_name),
        },
        _ => return None,
    })
}

/// Why a trip ended, as the wire has it.
pub(crate) fn trip_end(reason: TripEnd) -> wire::TripEnd {
    match reason {
        TripEnd::Stillness => wire::TripEnd::Stillness,
        TripEnd::Gap => wire::TripEnd::Gap,
        TripEnd::SessionEnd => wire::TripEnd::SessionEnd,
        TripEnd::Marker => wire::TripEnd::Marker,
        TripEnd::Full => wire::TripEnd::Full,
        TripEnd::StartPose => wire::TripEnd::StartPose,
    }
}

/// Why samples are skipped, as the wire has it.
pub(crate) fn skip_reason(reason: SkipReason) -> wire::SkipReason {
    match reason {
        SkipReason::Lost => wire::SkipReason::Lost,
        SkipReason::TimeBackwards => wire::SkipReason::TimeBackwards,
        SkipReason::Invalid(invalid) => match invalid {
            InvalidSample::NumberOutOfRange => wire::SkipReason::NumberOutOfRange,
            InvalidSample::NonUnitQuaternion => wire::SkipReason::NonUnitQuaternion,
            InvalidSample::NegativeNoise => wire::SkipReason::NegativeNoise,
            InvalidSample::InvalidDescriptor => wire::SkipReason::InvalidDescriptor,
            InvalidSample::InvalidLabel => wire::SkipReason::InvalidLabel,
            InvalidSample::InvalidNormal => wire::SkipReason::InvalidNormal,
        },
    }
}

/// Why samples are skipped, from the journal.
pub(crate) fn skip_reason_of_wire(reason: wire::SkipReason) -> SkipReason {
    let invalid = match reason {
        // A leap is refused before the journal, and so never in it.
        wire::SkipReason::Lost | wire::SkipReason::SequenceLeap => return SkipReason::Lost,
        wire::SkipReason::TimeBackwards => return SkipReason::TimeBackwards,
        wire::SkipReason::NumberOutOfRange => InvalidSample::NumberOutOfRange,
        wire::SkipReason::NonUnitQuaternion => InvalidSample::NonUnitQuaternion,
        wire::SkipReason::NegativeNoise => InvalidSample::NegativeNoise,
        wire::SkipReason::InvalidDescriptor => InvalidSample::InvalidDescriptor,
        wire::SkipReason::InvalidLabel => InvalidSample::InvalidLabel,
        wire::SkipReason::InvalidNormal => InvalidSample::InvalidNormal,
    };
    SkipReason::Invalid(invalid)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cognitive_map::{
        Label, Level, Motion, Record, Sample, SampleBody, Settings, SettingsValues,
    };

    /// An agent that stands still and feels these values.
    fn told(values: &[f64]) -> Vec<wire::Event> {
        let label = |text| Label::new(text).expect("a label");
        let settings = Settings::new(SettingsValues::default()).expect("defaults are valid");
        let mut map = CognitiveMap::new(settings);
        let (agent, name) = (AgentId(0), label("rover"));
        let mut events = Vec::new();
        map.apply(&Record::Enrol { agent, name }, &mut events);
        let still = Motion::from_increment([0.0; 3], [0.0, 0.0, 0.0, 1.0], None);
        let felt = values.iter().map(|&value| {
            let level = Level::new(label("touch"), value, [0.0; 3], None);
            SampleBody::Level(level.expect("a level"))
        });
        let bodies = std::iter::once(SampleBody::Motion(still.expect("a motion"))).chain(felt);
        for (seq, body) in (0..).zip(bodies) {
            let sample = Sample { stamp_ns: 0, body };
            let record = Record::Sample {
                agent,
                session: 1,
                seq,
                sample,
            };
            map.apply(&record, &mut events);
        }
        let told = events.iter().filter_map(|one| event("lab", &map, one));
        told.filter(|told| matches!(told.kind, wire::EventKind::PerceptSurprising { .. }))
            .collect()
    }

    #[test]
    fn only_what_surprises_is_told() {
        assert_eq!(told(&[1.0, 9.0]), [], "too little was learned");
        assert_eq!(told(&[1.0, 2.0, 3.0, 4.0]), []);
        let [surprise] = &told(&[1.0, 2.0, 3.0, 20.0, 3.0])[..] else {
            panic!("one surprise");
        };
        let wire::EventKind::PerceptSurprising {
            place,
            channel,
            percept,
            percepts,
            surprise,
        } = &surprise.kind
        else {
            panic!("a surprise");
        };
        assert_eq!((*place, channel.as_str(), *percepts), (0, "touch", 3));
        assert_eq!(*percept, wire::PerceptKind::Level);
        assert!((surprise - 18.0 / (2.0f64 / 3.0).sqrt()).abs() < 1e-9);
    }
}
