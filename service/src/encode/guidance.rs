//! Blockages, and routes that agents follow.

use cogmap_proto as wire;
use cognitive_map::{
    Agent, AgentId, Blockage, Blocked, CognitiveMap, Errand, EventKind, Following, Goal,
    Instruction, Region, Reverse, RouteCost, RouteFailure,
};

use super::FRAME;
use super::route::step;
use crate::journal::{JournaledBlocked, JournaledErrand, JournaledGoal, JournaledInstruction};

/// Most steps of a route in an event.
const EVENT_STEPS_MAX: usize = 64;

/// The blockages of a map.
pub fn blockages(map: &CognitiveMap) -> wire::BlockageList {
    wire::BlockageList {
        blockages: map.blockages().iter().map(blockage).collect(),
    }
}

/// A blockage.
pub fn blockage(blockage: &Blockage) -> wire::Blockage {
    let mut encoded = wire::Blockage {
        id: blockage.id.0,
        place: None,
        from: None,
        to: None,
        at_m: None,
        radius_m: None,
        until_ns: blockage.until_ns,
    };
    match &blockage.blocked {
        Blocked::Place(place) => encoded.place = Some(place.0.into()),
        Blocked::Way([from, to]) => {
            (encoded.from, encoded.to) = (Some(from.0.into()), Some(to.0.into()));
        }
        Blocked::Ball(ball) => {
            (encoded.at_m, encoded.radius_m) = (Some(ball.at.into()), Some(ball.radius_m));
        }
    }
    encoded
}

/// What is left of the route that an agent follows; no steps of one that follows none.
pub fn followed_route(space: &str, map: &CognitiveMap, agent: AgentId) -> wire::FollowedRoute {
    let known = map.agent(agent);
    let position = known.map(|agent| agent.pose().translation.vector.into());
    let following = map.followed(agent);
    let rest = following.map(Following::rest).unwrap_or_default();
    let left = following.zip(position);
    wire::FollowedRoute {
        space: space.to_owned(),
        agent: known.map_or_else(String::new, |agent| agent.name().as_str().to_owned()),
        frame: FRAME.to_owned(),
        map_revision: map.revision(),
        length_m: left.map_or(0.0, |(following, at)| following.rest_m(&at)),
        duration_s: rest.iter().map(|step| step.duration_s).sum(),
        steps_done: following.map_or(0, |following| following.steps_done() as u64),
        steps: rest.iter().map(|of| step(map, of)).collect(),
    }
}

/// What is left of a route that an agent follows, without the steps.
pub fn followed_summary(agent: &Agent, following: &Following) -> wire::FollowedRouteSummary {
    let rest = following.rest();
    wire::FollowedRouteSummary {
        agent: agent.name().as_str().to_owned(),
        length_m: following.rest_m(&agent.pose().translation.vector.into()),
        duration_s: rest.iter().map(|step| step.duration_s).sum(),
        steps_done: following.steps_done() as u64,
        steps_left: rest.len() as u64,
    }
}

/// What happened to an agent on its route; none of anything else.
pub(super) fn route_event(map: &CognitiveMap, kind: &EventKind) -> Option<wire::EventKind> {
    Some(match kind {
        EventKind::RouteProgress {
            place,
            steps_left,
            rest_m,
        } => wire::EventKind::RouteProgress {
            place: place.map(|place| place.0.into()),
            steps_left: *steps_left as u64,
            left_m: *rest_m,
        },
        EventKind::RouteLeft(left) => {
            let steps = &left.route.steps;
            let first = steps.iter().take(EVENT_STEPS_MAX);
            wire::EventKind::RouteLeft {
                off_m: left.off_m,
                blockage: left.blockage.map(|blockage| blockage.0),
                length_m: left.route.length_m,
                steps_left: steps.len() as u64,
                steps: first.map(|of| step(map, of)).collect(),
            }
        }
        EventKind::RouteDone => wire::EventKind::RouteDone {},
        EventKind::RouteFailed { failure } => {
            let (reason, blockages) = match failure {
                RouteFailure::NoWay(blockages) => (wire::RouteFailure::NoWay, &blockages[..]),
                RouteFailure::GoalForgotten => (wire::RouteFailure::GoalForgotten, &[][..]),
                RouteFailure::NothingNear => (wire::RouteFailure::NothingNear, &[][..]),
                RouteFailure::AgentLost => (wire::RouteFailure::AgentLost, &[][..]),
                RouteFailure::SessionEnded => (wire::RouteFailure::SessionEnded, &[][..]),
            };
            wire::EventKind::RouteFailed {
                reason,
                blockages: blockages.iter().map(|blockage| blockage.0).collect(),
            }
        }
        _ => return None,
    })
}

/// An instruction as the journal has it.
pub(crate) fn journaled_instruction(instruction: &Instruction) -> JournaledInstruction {
    match instruction {
        Instruction::Block(blockage) => JournaledInstruction::Block {
            id: blockage.id.0,
            blocked: match &blockage.blocked {
                Blocked::Place(place) => JournaledBlocked::Place(place.0),
                Blocked::Way(ends) => JournaledBlocked::Way(ends.map(|end| end.0)),
                Blocked::Ball(ball) => JournaledBlocked::Ball(ball.at.into(), ball.radius_m),
            },
            until_ns: blockage.until_ns,
        },
        Instruction::Unblock(id) => JournaledInstruction::Unblock { id: id.0 },
        Instruction::Follow(agent, errand) => JournaledInstruction::Follow {
            agent: agent.0,
            errand: journaled_errand(errand),
        },
        Instruction::StopFollowing(agent) => JournaledInstruction::StopFollowing { agent: agent.0 },
        Instruction::Pin(trip) => JournaledInstruction::Pin { trip: trip.0 },
        Instruction::Unpin(trip) => JournaledInstruction::Unpin { trip: trip.0 },
    }
}

fn journaled_errand(errand: &Errand) -> JournaledErrand {
    let corners = |region: &Region| {
        let [min_m, max_m] = region.corners_m();
        wire::RouteBox { min_m, max_m }
    };
    let places = errand.avoid_places.iter().map(|place| place.0.into());
    JournaledErrand {
        goal: match &errand.goal {
            Goal::Place(place) => JournaledGoal::Place(place.0),
            Goal::Position(at) => JournaledGoal::Position((*at).into()),
            Goal::Retrace(retrace) => JournaledGoal::Retrace {
                trip: retrace.trip.0,
                backward: retrace.backward,
            },
        },
        cost: match errand.cost {
            RouteCost::Length => wire::RouteCost::Length,
            RouteCost::Time => wire::RouteCost::Time,
            RouteCost::Uncertainty => wire::RouteCost::Uncertainty,
            RouteCost::Recency => wire::RouteCost::Recency,
        },
        reverse: match errand.reverse {
            Reverse::Allowed => wire::RouteReverse::Allowed,
            Reverse::Never => wire::RouteReverse::Never,
        },
        avoid: wire::RouteAvoid {
            places: places.collect(),
            boxes: errand.avoid_regions.iter().map(corners).collect(),
        },
    }
}
