//! What the service publishes, and the bodies of queries.

use cogmap_proto::{
    Estimate, Event, EventKind, RecallQuery, Rejection, SeqRange, SkipReason, Status, TripEnd,
    Watermark, WatermarkQuery,
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
    for (name, kind) in event_kinds() {
        visit.message(&format!("event_{name}"), &event(kind));
    }
    visit.message("recall_query_empty", &RecallQuery::default());
    visit.message("recall_query_full", &recall_query());
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

fn event_kinds() -> [(&'static str, EventKind); 9] {
    let session = 1_800_000_000_000_000_000;
    let landmark = "porte 3, étage α".to_owned();
    [
        ("agent_enrolled", EventKind::AgentEnrolled {}),
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
    }
}
