//! Routes: what is asked and what is answered.

use cogmap_proto::{
    Blockage, BlockageList, BlockageRequest, FollowRequest, FollowedRoute, FollowedRoutePage,
    FollowedRouteSummary, Level, PerceptCue, RetraceDirection, Route, RouteAnswer, RouteAvoid,
    RouteBack, RouteBox, RouteCost, RouteEnd, RouteFormat, RoutePose, RouteQuery, RouteRetrace,
    RouteReverse, RouteStep, RouteWay,
};

use super::Visit;

pub(super) fn each(visit: &mut impl Visit) {
    visit.message("route_query", &query());
    visit.message("route_query_full", &full());
    let level = PerceptCue::Level(Level {
        channel: "touch".to_owned(),
        value: 0.75,
        offset_m: [0.0; 3],
        normal: None,
    });
    let ends = [
        ("trip", RouteEnd::Trip(17)),
        ("home", RouteEnd::Home("robot-1".to_owned())),
        ("landmark", RouteEnd::Landmark("dock".to_owned())),
        ("percept", RouteEnd::Percept(level)),
        (
            "back",
            RouteEnd::Back(RouteBack {
                agent: "robot-1".to_owned(),
                s: Some(30.0),
                m: None,
            }),
        ),
        (
            "retrace",
            RouteEnd::Retrace(RouteRetrace {
                trip: 17,
                direction: RetraceDirection::Backward,
            }),
        ),
    ];
    for (name, to) in ends {
        visit.message(
            &format!("route_query_to_{name}"),
            &RouteQuery { to, ..query() },
        );
    }
    visit.message("route_answer", &answer());
    visit.message("route_answer_there", &there());
    each_of_guidance(visit);
}

/// The steps of a route.
pub(super) fn steps() -> Vec<RouteStep> {
    answer().steps
}

fn each_of_guidance(visit: &mut impl Visit) {
    let request = BlockageRequest {
        at_m: Some([1.5, -2.0, 0.0]),
        radius_m: Some(0.25),
        until_ns: Some(1_700_000_000_000_000_000),
        ..BlockageRequest::default()
    };
    visit.message("blockage_request", &request);
    let blockage = Blockage {
        id: 3,
        place: None,
        from: Some(4),
        to: Some(5),
        at_m: None,
        radius_m: None,
        until_ns: None,
    };
    visit.message("blockage", &blockage);
    let ball = Blockage {
        id: 4,
        from: None,
        to: None,
        at_m: request.at_m,
        radius_m: request.radius_m,
        until_ns: request.until_ns,
        ..blockage
    };
    let blockages = vec![blockage, ball];
    visit.message("blockage_list", &BlockageList { blockages });
    let follow = FollowRequest {
        to: RouteEnd::Place(3),
        cost: RouteCost::Time,
        reverse: RouteReverse::Never,
        avoid: full().avoid,
    };
    visit.message("follow_request", &follow);
    let followed = FollowedRoute {
        space: "office".to_owned(),
        agent: "robot-1".to_owned(),
        frame: "map".to_owned(),
        map_revision: 4711,
        length_m: 4.5,
        duration_s: 9.0,
        steps_done: 2,
        steps: answer().steps,
    };
    visit.message("followed_route", &followed);
    let summary = FollowedRouteSummary {
        agent: "robot-1".to_owned(),
        length_m: 12.5,
        duration_s: 15.25,
        steps_done: 4,
        steps_left: 9,
    };
    let page = FollowedRoutePage {
        map_revision: 4_711,
        routes: vec![summary],
        next: Some("robot-1".to_owned()),
    };
    visit.message("followed_route_page", &page);
}

fn query() -> RouteQuery {
    RouteQuery {
        from: RouteEnd::Agent("robot-1".to_owned()),
        to: RouteEnd::Place(3),
        cost: RouteCost::Length,
        reverse: RouteReverse::Allowed,
        avoid: RouteAvoid::default(),
        shortcuts: false,
        body_radius_m: None,
        alternatives: 0,
        format: RouteFormat::Steps,
        spacing_m: None,
    }
}

fn full() -> RouteQuery {
    RouteQuery {
        from: RouteEnd::PositionM([12.5, -7.25, 0.125]),
        to: RouteEnd::Place(u64::MAX),
        cost: RouteCost::Recency,
        reverse: RouteReverse::Never,
        avoid: RouteAvoid {
            places: vec![4, 5],
            boxes: vec![RouteBox {
                min_m: [0.0, -1.5, 0.0],
                max_m: [2.0, 1.5, 2.5],
            }],
        },
        shortcuts: true,
        body_radius_m: Some(0.25),
        alternatives: 4,
        format: RouteFormat::Path,
        spacing_m: Some(0.5),
    }
}

fn step() -> RouteStep {
    RouteStep {
        place: Some(3),
        translation_m: [12.5, -7.25, 0.125],
        rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
        tolerance_m: 0.125,
        sd_m: 0.0625,
        way: RouteWay::Travelled,
        length_m: 0.375,
        duration_s: 0.75,
        traversals: 12,
        last_stamp_ns: Some(1_800_000_000_610_000_000),
        trip: Some(0),
        leg: Some(7),
    }
}

fn answer() -> RouteAnswer {
    let approach = RouteStep {
        place: None,
        way: RouteWay::Approach,
        traversals: 0,
        last_stamp_ns: None,
        trip: None,
        leg: None,
        ..step()
    };
    let shortcut = RouteStep {
        way: RouteWay::Shortcut,
        ..approach.clone()
    };
    let back = RouteStep {
        way: RouteWay::Reversed,
        traversals: 0,
        ..step()
    };
    let pose = RoutePose {
        translation_m: [12.25, -7.25, 0.125],
        rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
    };
    RouteAnswer {
        space: "lab".to_owned(),
        frame: "map".to_owned(),
        map_revision: 4_711,
        cost: 0.375,
        length_m: 0.75,
        duration_s: 1.5,
        sd_m: 0.0625,
        steps: vec![step(), approach],
        path: Some(vec![pose]),
        alternatives: vec![Route {
            cost: 0.5,
            length_m: 0.5,
            duration_s: 0.75,
            sd_m: 0.125,
            steps: vec![back, shortcut],
            path: None,
        }],
    }
}

/// Start and goal are the same.
fn there() -> RouteAnswer {
    RouteAnswer {
        cost: 0.0,
        length_m: 0.0,
        duration_s: 0.0,
        sd_m: 0.0,
        steps: Vec::new(),
        path: None,
        alternatives: Vec::new(),
        ..answer()
    }
}
