//! Events.

use cogmap_proto as wire;
use cognitive_map::{
    ChannelKind, CognitiveMap, Event, EventKind, InvalidSample, Label, LoopsClosed, SkipReason,
};

use super::guidance::route_event;
use super::surprise::is_surprising;
use super::trip::trip_end;

/// What is published of what the latest record of a map has brought about. Told by the map as it is
/// then, so that a replay tells the same.
pub(crate) fn event_records(
    space: &str,
    map: &CognitiveMap,
    events: &[Event],
) -> impl Iterator<Item = wire::EventRecord> {
    let revision = map.revision();
    let published = { events.iter() }.filter_map(move |one| event(space, map, one));
    (0..).zip(published).map(move |(index, event)| {
        let id = wire::EventId { revision, index };
        wire::EventRecord { id, event }
    })
}

/// The published form of an event; cell crossings stay inside, there are too many, and so do
/// percepts that are as expected and the ends of episodes, which are answered on request.
fn event(space: &str, map: &CognitiveMap, event: &Event) -> Option<wire::Event> {
    let kind = event_kind(map, &event.kind)?;
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

/// What happened; none of what is not published.
fn event_kind(map: &CognitiveMap, kind: &EventKind) -> Option<wire::EventKind> {
    Some(match kind {
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
        EventKind::LoopsClosed(closed) => loops_closed(closed),
        EventKind::ObjectsNarrowed { .. }
        | EventKind::ObjectRecognised { .. }
        | EventKind::ObjectUnknown
        | EventKind::ObjectLearned { .. }
        | EventKind::ObjectNotLearned { .. }
        | EventKind::ObjectsMerged { .. }
        | EventKind::ObjectSplit { .. } => object_event(kind)?,
        EventKind::RouteProgress { .. }
        | EventKind::RouteLeft(_)
        | EventKind::RouteDone
        | EventKind::RouteFailed { .. } => route_event(map, kind)?,
        EventKind::MarkerPassed { label } => wire::EventKind::MarkerPassed {
            label: label.as_str().to_owned(),
        },
        EventKind::PerceptCompared { .. } => surprise(map, kind)?,
    })
}

/// What closed loops have brought an agent.
fn loops_closed(closed: &LoopsClosed) -> wire::EventKind {
    wire::EventKind::LoopsClosed {
        closures: closed.closures as u64,
        view_matches: closed.view_matches as u64,
        moved_m: closed.moved_m,
        turned_rad: closed.turned_rad,
        translation_m: closed.position.coords.into(),
    }
}

/// A percept that surprises; none of one that does not, and of anything else.
fn surprise(map: &CognitiveMap, kind: &EventKind) -> Option<wire::EventKind> {
    let EventKind::PerceptCompared {
        place,
        channel,
        percepts,
        surprise,
    } = kind
    else {
        return None;
    };
    let channel = map.channel(*channel)?;
    if !is_surprising(channel.kind(), *percepts, *surprise) {
        return None;
    }
    Some(wire::EventKind::PerceptSurprising {
        place: place.0.into(),
        channel: channel.label().as_str().to_owned(),
        percept: match channel.kind() {
            ChannelKind::Level => wire::PerceptKind::Level,
            ChannelKind::Descriptor { .. } => wire::PerceptKind::Descriptor,
        },
        percepts: *percepts,
        surprise: *surprise,
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

#[cfg(test)]
mod tests {
    use super::*;
    use cognitive_map::{
        AgentId, Label, Level, Motion, Record, Sample, SampleBody, Settings, SettingsValues,
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
