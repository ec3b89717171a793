//! What the service publishes, and the bodies of queries.

use cogmap_proto::{
    Descriptor, Estimate, Event, EventId, EventKind, EventPage, EventRecord, Increment, Level,
    MissedEvents, MotionBody, PerceptCue, PerceptKind, PredictQuery, RecallQuery, Rejection,
    RouteFailure, SeqRange, SkipReason, Status, TripEnd, Velocity, Watermark, WatermarkQuery,
};

use super::Visit;

pub(super) const REASONS: [SkipReason; 8] = [
    SkipReason::NumberOutOfRange,
    SkipReason::NonUnitQuaternion,
    SkipReason::NegativeNoise,
    SkipReason::TimeBackwards,
    SkipReason::InvalidDescriptor,
    SkipReason::InvalidLabel,
    SkipReason::InvalidNormal,
    SkipReason::Lost,
];

pub(super) const ENDS: [TripEnd; 6] = [
    TripEnd::Stillness,
    TripEnd::Gap,
    TripEnd::SessionEnd,
    TripEnd::Marker,
    TripEnd::Full,
    TripEnd::StartPose,
];

#[expect(clippy::too_many_lines, reason = "a list: each message once")]
pub(super) fn each(visit: &mut impl Visit) {
    visit.message("estimate_localized", &estimate(Status::Localized));
    visit.message(
        "estimate_uncertain",
        &Estimate {
            place: None,
            confidence: 0.0,
            ..estimate(Status::Uncertain)
        },
    );
    visit.message("estimate_lost", &estimate(Status::Lost));
    visit.message("watermark", &watermark());
    visit.message("watermark_gap_rejections", &watermark_with_gap());
    let kinds = event_kinds().into_iter().chain(object_events());
    for (name, kind) in kinds.chain(route_events()) {
        visit.message(&format!("event_{name}"), &event(kind));
    }
    let id = |revision, index| EventId { revision, index };
    let record = EventRecord {
        id: id(4_711, 2),
        event: event(EventKind::TripStarted { trip: 12 }),
    };
    let missed = MissedEvents {
        events: Some(7),
        next: Some(id(4_700, 0)),
    };
    visit.message("event_record", &record);
    visit.message("missed_events", &missed);
    visit.message(
        "event_page",
        &EventPage {
            events: vec![record],
            missed: Some(missed),
            next: Some(id(4_711, 2)),
        },
    );
    visit.message(
        "event_page_empty",
        &EventPage {
            events: Vec::new(),
            missed: None,
            next: None,
        },
    );
    visit.message("recall_query_empty", &RecallQuery::default());
    visit.message("recall_query_full", &recall_query());
    let level = PerceptCue::Level(Level {
        channel: "touch".to_owned(),
        value: 0.75,
        offset_m: [0.0; 3],
        normal: None,
    });
    visit.message(
        "recall_query_level",
        &RecallQuery {
            percept: Some(level),
            ..RecallQuery::default()
        },
    );
    visit.message("predict_query_increment", &predict_query());
    visit.message("predict_query_velocity", &predict_query_by_velocity());
    visit.message("watermark_sequence_leap", &watermark_after_a_leap());
    visit.message(
        "watermark_query",
        &WatermarkQuery {
            agent: "robot-1".to_owned(),
        },
    );
}

pub(super) fn estimate(status: Status) -> Estimate {
    Estimate {
        space: "lab".to_owned(),
        agent: "robot-1".to_owned(),
        session: 1_800_000_000_000_000_000,
        seq: 61,
        stamp_ns: 1_800_000_000_610_000_000,
        frame: "map".to_owned(),
        map_revision: 4_711,
        status,
        translation_m: [12.5, -7.25, 0.1],
        rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
        covariance: upper_triangle(),
        place: Some(3),
        confidence: 0.875,
        term: 3,
    }
}

/// A covariance whose every entry is different, so that a changed order is seen.
pub(super) fn upper_triangle() -> [f64; 21] {
    std::array::from_fn(|i| i as f64 / 8.0)
}

pub(super) fn watermark() -> Watermark {
    Watermark {
        session: 1_800_000_000_000_000_000,
        durable: 62,
        applied: 62,
        gap: None,
        rejected: Vec::new(),
        term: 3,
    }
}

fn watermark_with_gap() -> Watermark {
    let rejected = REASONS.iter().zip(0..).map(|(&reason, from)| Rejection {
        range: SeqRange { from, to: from + 1 },
        reason,
    });
    Watermark {
        session: 1_800_000_000_000_000_000,
        durable: 40,
        applied: 50,
        gap: Some(SeqRange { from: 50, to: 60 }),
        rejected: rejected.collect(),
        term: 0,
    }
}

fn watermark_after_a_leap() -> Watermark {
    Watermark {
        rejected: vec![Rejection {
            range: SeqRange {
                from: 1 << 63,
                to: (1 << 63) + 1,
            },
            reason: SkipReason::SequenceLeap,
        }],
        ..watermark()
    }
}

fn event(kind: EventKind) -> Event {
    Event {
        space: "lab".to_owned(),
        agent: "robot-1".to_owned(),
        map_revision: 4_711,
        stamp_ns: 1_800_000_000_610_000_000,
        kind,
    }
}

fn route_events() -> [(&'static str, EventKind); 4] {
    [
        (
            "route_progress",
            EventKind::RouteProgress {
                place: Some(3),
                steps_left: 4,
                left_m: 2.25,
            },
        ),
        (
            "route_left",
            EventKind::RouteLeft {
                off_m: Some(0.75),
                blockage: None,
                length_m: 4.5,
                steps_left: 2,
                steps: super::routes::steps(),
            },
        ),
        ("route_done", EventKind::RouteDone {}),
        (
            "route_failed",
            EventKind::RouteFailed {
                reason: RouteFailure::NoWay,
                blockages: vec![3, 5],
            },
        ),
    ]
}

fn object_events() -> [(&'static str, EventKind); 7] {
    [
        ("objects_narrowed", EventKind::ObjectsNarrowed { live: 2 }),
        (
            "object_recognised",
            EventKind::ObjectRecognised {
                object: "mug".to_owned(),
                probability: 0.992_187_5,
            },
        ),
        ("object_unknown", EventKind::ObjectUnknown {}),
        (
            "object_learned",
            EventKind::ObjectLearned {
                object: "object-7".to_owned(),
                contacts: 31,
            },
        ),
        (
            "object_not_learned",
            EventKind::ObjectNotLearned { contacts: 4 },
        ),
        (
            "objects_merged",
            EventKind::ObjectsMerged {
                object: "mug".to_owned(),
                absorbed: "object-7".to_owned(),
            },
        ),
        (
            "object_split",
            EventKind::ObjectSplit {
                object: "mug".to_owned(),
                part: "object-9".to_owned(),
            },
        ),
    ]
}

#[expect(clippy::too_many_lines, reason = "a list: each kind once")]
fn event_kinds() -> [(&'static str, EventKind); 16] {
    let session = 1_800_000_000_000_000_000;
    let landmark = "porte 3, étage α".to_owned();
    [
        ("agent_enrolled", EventKind::AgentEnrolled {}),
        ("agent_removed", EventKind::AgentRemoved {}),
        ("session_started", EventKind::SessionStarted { session }),
        (
            "place_recruited",
            EventKind::PlaceRecruited {
                place: 3,
                translation_m: [12.5, -7.0, 0.3],
            },
        ),
        (
            "place_entered",
            EventKind::PlaceEntered {
                place: 3,
                confidence: 0.875,
            },
        ),
        ("trip_started", EventKind::TripStarted { trip: 2 }),
        (
            "trip_ended",
            EventKind::TripEnded {
                trip: 2,
                legs: 14,
                reason: TripEnd::SessionEnd,
            },
        ),
        (
            "landmark_learned",
            EventKind::LandmarkLearned {
                landmark,
                translation_m: [2.0, -1.5, 0.25],
            },
        ),
        (
            "samples_skipped",
            EventKind::SamplesSkipped {
                from: 50,
                to: 60,
                reason: SkipReason::Lost,
            },
        ),
        (
            "marker_passed",
            EventKind::MarkerPassed {
                label: "lap 1".to_owned(),
            },
        ),
        (
            "place_forgotten",
            EventKind::PlaceForgotten {
                place: 1,
                translation_m: [-0.5, 2.25, 0.0],
            },
        ),
        (
            "trip_forgotten",
            EventKind::TripForgotten { trip: 2, legs: 14 },
        ),
        (
            "loops_closed",
            EventKind::LoopsClosed {
                closures: 12,
                view_matches: 340,
                moved_m: 0.75,
                turned_rad: 0.0625,
                translation_m: [4.5, -1.25, 0.0],
            },
        ),
        (
            "agent_placed",
            EventKind::AgentPlaced {
                translation_m: [4.5, -1.25, 0.0],
            },
        ),
        (
            "percept_surprising_level",
            EventKind::PerceptSurprising {
                place: 3,
                channel: "touch".to_owned(),
                percept: PerceptKind::Level,
                percepts: 9,
                surprise: 6.5,
            },
        ),
        (
            "percept_surprising_descriptor",
            EventKind::PerceptSurprising {
                place: 3,
                channel: "camera".to_owned(),
                percept: PerceptKind::Descriptor,
                percepts: 4,
                surprise: 0.875,
            },
        ),
    ]
}

fn recall_query() -> RecallQuery {
    RecallQuery {
        position_m: Some([12.5, -7.0, 0.0]),
        code: Some(vec![
            Some([0.0, 0.25, 0.5]),
            None,
            Some([0.75, 0.125, 0.875]),
        ]),
        radius_m: Some(2.5),
        agent: Some("robot-1".to_owned()),
        since_ns: Some(1_800_000_000_000_000_000),
        until_ns: Some(-1),
        limit: Some(20),
        percept: Some(PerceptCue::Descriptor(Descriptor {
            channel: "camera".to_owned(),
            vector: vec![0.5, -0.5, 0.25, 0.0, 1.0, -0.125, 0.75, 0.0],
        })),
    }
}

fn predict_query() -> PredictQuery {
    PredictQuery {
        agent: Some("robot-1".to_owned()),
        motion: MotionBody::Increment(Increment {
            translation_m: [0.5, 0.25, 0.0],
            rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
            noise: None,
        }),
        offset_m: [0.25, 0.0, 0.125],
        channel: Some("touch".to_owned()),
    }
}

fn predict_query_by_velocity() -> PredictQuery {
    PredictQuery {
        agent: None,
        motion: MotionBody::Velocity(Velocity {
            linear_m_s: [1.5, 0.0, 0.0],
            angular_rad_s: [0.0, 0.0, 0.25],
            duration_s: 2.0,
            noise: None,
        }),
        offset_m: [0.0; 3],
        channel: None,
    }
}
