//! What was felt near a point: what is asked about and what is answered.

use cogmap_proto::{FeltAnswer, FeltPercept, FeltPlace, FeltQuery, Looked};

use super::Visit;

const STAMP_NS: i64 = 1_800_000_000_610_000_000;

pub(super) fn each(visit: &mut impl Visit) {
    let plain = FeltQuery {
        position_m: [1.5, -2.0, 0.0],
        radius_m: None,
        since_ns: None,
        channels: None,
        limit: None,
    };
    visit.message("felt_query", &plain);
    let full = FeltQuery {
        radius_m: Some(0.5),
        since_ns: Some(STAMP_NS),
        channels: Some(vec!["touch".to_owned(), "camera".to_owned()]),
        limit: Some(3),
        ..plain
    };
    visit.message("felt_query_full", &full);
    visit.message("felt_answer", &felt());
    let never = FeltAnswer {
        looked: Looked::Never,
        last_seen_ns: None,
        last_felt_ns: None,
        near: 0,
        places: Vec::new(),
        ..felt()
    };
    visit.message("felt_answer_never", &never);
}

fn felt() -> FeltAnswer {
    let touched = FeltPercept {
        channel: "touch".to_owned(),
        last_stamp_ns: STAMP_NS,
        percepts: 3,
        strength: 2.25,
        mean: Some(0.5),
        sd: Some(0.125),
        dimension: None,
    };
    let seen = FeltPercept {
        channel: "camera".to_owned(),
        mean: None,
        sd: None,
        dimension: Some(8),
        ..touched.clone()
    };
    let place = FeltPlace {
        place: 3,
        distance_m: 0.125,
        looked: Looked::Felt,
        last_seen_ns: STAMP_NS + 5,
        percepts: vec![touched, seen],
    };
    let empty = FeltPlace {
        place: 4,
        distance_m: 0.375,
        looked: Looked::NothingFelt,
        percepts: Vec::new(),
        ..place.clone()
    };
    FeltAnswer {
        space: "lab".to_owned(),
        frame: "map".to_owned(),
        map_revision: 4_711,
        looked: Looked::Felt,
        last_seen_ns: Some(STAMP_NS + 5),
        last_felt_ns: Some(STAMP_NS),
        near: 2,
        places: vec![place, empty],
    }
}
