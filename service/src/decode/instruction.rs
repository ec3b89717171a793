//! Instructions: blockages, routes to follow, and pins.

use cogmap_proto as wire;
use cogmap_proto::limits::METRES_MAX;
use cognitive_map::{
    AgentId, BLOCKAGES_MAX, Ball, Blockage, BlockageId, Blocked, CognitiveMap, Errand, Goal,
    Instruction, PlaceId, Region, Retrace, TripId,
};

use super::route::{InvalidRoute, cost, end, options_of, retrace, reverse, unknown};
use crate::journal::{JournaledBlocked, JournaledErrand, JournaledGoal, JournaledInstruction};

/// Least and largest radius of a blockage \[m\].
const RADII_M: std::ops::RangeInclusive<f64> = 0.01..=1000.0;

/// A blockage, which has no number of its own yet.
///
/// # Errors
/// Says which rule the request breaks, what in it is unknown, or that there are too many.
pub fn blockage(
    map: &CognitiveMap,
    request: &wire::BlockageRequest,
) -> Result<Blockage, InvalidRoute> {
    let blocked = blocked(map, request)?;
    if map.blockages().len() >= BLOCKAGES_MAX {
        return Err(InvalidRoute::TooManyBlockages(BLOCKAGES_MAX));
    }
    Ok(Blockage {
        id: BlockageId(0),
        blocked,
        until_ns: request.until_ns,
    })
}

fn blocked(map: &CognitiveMap, request: &wire::BlockageRequest) -> Result<Blocked, InvalidRoute> {
    let place = |number: u64| {
        let place = u32::try_from(number).ok().map(PlaceId);
        let place = place.filter(|place| (place.0 as usize) < map.places_recruited());
        place.ok_or_else(|| unknown("place", &number))
    };
    let named = (request.place, request.from, request.to);
    match (named, request.at_m, request.radius_m) {
        ((Some(number), None, None), None, None) => Ok(Blocked::Place(place(number)?)),
        ((None, Some(from), Some(to)), None, None) => {
            let ends = [place(from)?, place(to)?];
            if map.way(ends[0], ends[1]).is_none() {
                return Err(unknown("way", &format!("from {from} to {to}")));
            }
            Ok(Blocked::Way(ends))
        }
        ((None, None, None), Some(at_m), Some(radius_m)) => {
            // A comparison with NaN is false.
            if !at_m.iter().all(|metre| metre.abs() <= METRES_MAX) {
                let rule = format!("finite and within {METRES_MAX:e} m, not {at_m:?}");
                return Err(InvalidRoute::Number("at_m", rule));
            }
            if !RADII_M.contains(&radius_m) {
                let (min, max) = (RADII_M.start(), RADII_M.end());
                let rule = format!("{min} to {max} m, not {radius_m}");
                return Err(InvalidRoute::Number("radius_m", rule));
            }
            let at = at_m.into();
            Ok(Blocked::Ball(Ball { at, radius_m }))
        }
        _ => Err(InvalidRoute::WhichBlockage),
    }
}

/// Where an agent is to go, and how.
///
/// # Errors
/// Says which rule the request breaks, or what in it is unknown.
pub fn errand(map: &CognitiveMap, request: &wire::FollowRequest) -> Result<Errand, InvalidRoute> {
    let options = options_of(map, request.cost, request.reverse, &request.avoid)?;
    let goal = match &request.to {
        wire::RouteEnd::Retrace(of) => Goal::Retrace(retrace(of)?),
        to => end(map, "to", to)?.goal(),
    };
    Ok(Errand {
        goal,
        cost: options.cost,
        reverse: options.reverse,
        avoid_places: options.avoid_places.into_iter().collect(),
        avoid_regions: options.avoid_regions,
    })
}

/// An instruction of the journal; `None` of one that makes no sense.
pub(super) fn journaled_instruction(instruction: &JournaledInstruction) -> Option<Instruction> {
    Some(match instruction {
        JournaledInstruction::Block {
            id,
            blocked,
            until_ns,
        } => Instruction::Block(Blockage {
            id: BlockageId(*id),
            blocked: match blocked {
                JournaledBlocked::Place(place) => Blocked::Place(PlaceId(*place)),
                JournaledBlocked::Way(ends) => Blocked::Way(ends.map(PlaceId)),
                JournaledBlocked::Ball(at, radius_m) => Blocked::Ball(Ball {
                    at: (*at).into(),
                    radius_m: *radius_m,
                }),
            },
            until_ns: *until_ns,
        }),
        JournaledInstruction::Unblock { id } => Instruction::Unblock(BlockageId(*id)),
        JournaledInstruction::Follow { agent, errand } => {
            Instruction::Follow(AgentId(*agent), journaled_errand(errand)?)
        }
        JournaledInstruction::StopFollowing { agent } => {
            Instruction::StopFollowing(AgentId(*agent))
        }
        JournaledInstruction::Pin { trip } => Instruction::Pin(TripId(*trip)),
        JournaledInstruction::Unpin { trip } => Instruction::Unpin(TripId(*trip)),
    })
}

fn journaled_errand(errand: &JournaledErrand) -> Option<Errand> {
    let goal = match errand.goal {
        JournaledGoal::Place(place) => Goal::Place(PlaceId(place)),
        JournaledGoal::Position(at) => Goal::Position(at.into()),
        JournaledGoal::Retrace { trip, backward } => Goal::Retrace(Retrace {
            trip: TripId(trip),
            backward,
        }),
    };
    let places = errand.avoid.places.iter();
    let places = places.map(|place| u32::try_from(*place).ok().map(PlaceId));
    let boxes = errand.avoid.boxes.iter();
    let boxes = boxes.map(|corners| Region::new(corners.min_m, corners.max_m));
    Some(Errand {
        goal,
        cost: cost(errand.cost),
        reverse: reverse(errand.reverse),
        avoid_places: places.collect::<Option<_>>()?,
        avoid_regions: boxes.collect::<Option<_>>()?,
    })
}
