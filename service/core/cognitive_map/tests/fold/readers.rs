//! Routes and instructions: the same after a replay, and on however many threads.

use std::thread;

use cognitive_map::{
    AgentId, Ball, Blockage, BlockageId, Blocked, CognitiveMap, Errand, Goal, Instruction, NoRoute,
    PlaceId, Record, Reverse, Route, RouteBounds, RouteCost, RouteOptions, Sample, Settings,
    TripId,
};
use nalgebra::Point3;
use proptest::prelude::*;

use crate::journal::{label, motion, run};

const AGENT: AgentId = AgentId(0);

/// What happens next.
#[derive(Clone, Debug)]
enum Next {
    /// A step ahead after a turn \[rad\].
    Step(f64),
    Block(Blocked, Option<i64>),
    Unblock(u64),
    Follow(PlaceId, Reverse),
    Pin(TripId),
}

fn next() -> impl Strategy<Value = Next> {
    let place = || (0u32..30).prop_map(PlaceId);
    let ball =
        (prop::array::uniform2(-2.0..2.0f64), 0.05..0.5f64).prop_map(|([x, y], radius_m)| {
            let at = Point3::new(x, y, 0.0);
            Blocked::Ball(Ball { at, radius_m })
        });
    let blocked = prop_oneof![place().prop_map(Blocked::Place), ball];
    let until_ns = prop::option::of(0..40_000_000_000_i64);
    let reverse = prop::sample::select(vec![Reverse::Allowed, Reverse::Never]);
    prop_oneof![
        60 => (-1.5..1.5f64).prop_map(Next::Step),
        2 => (blocked, until_ns).prop_map(|(blocked, until_ns)| Next::Block(blocked, until_ns)),
        1 => (0u64..9).prop_map(Next::Unblock),
        3 => (place(), reverse).prop_map(|(place, reverse)| Next::Follow(place, reverse)),
        1 => (0u32..3).prop_map(|trip| Next::Pin(TripId(trip))),
    ]
}

/// The journal of a robot that wanders in a square of 4 m, and of somebody who gives instructions.
fn journal(all: &[Next]) -> Vec<Record> {
    let mut map = CognitiveMap::new(Settings::default());
    let name = label("robot");
    let mut records = vec![Record::Enrol { agent: AGENT, name }];
    run(&mut map, &records);
    let (mut seq, mut number) = (0, 0);
    for next in all {
        let instruction = match next {
            Next::Step(yaw) => {
                let at = map.agent(AGENT).unwrap().pose().translation.vector;
                let yaw = if at.norm() > 2.0 { 2.5 } else { *yaw };
                let sample = Sample {
                    stamp_ns: i64::try_from(seq).unwrap() * 100_000_000,
                    body: motion([0.15, 0.0, 0.0], [0.0, 0.0, yaw]),
                };
                let record = Record::Sample {
                    agent: AGENT,
                    session: 1,
                    seq,
                    sample,
                };
                seq += 1;
                run(&mut map, std::slice::from_ref(&record));
                records.push(record);
                continue;
            }
            Next::Block(blocked, until_ns) => Instruction::Block(Blockage {
                id: BlockageId(number),
                blocked: *blocked,
                until_ns: *until_ns,
            }),
            Next::Unblock(id) => Instruction::Unblock(BlockageId(*id)),
            Next::Follow(place, reverse) => {
                let errand = Errand {
                    goal: Goal::Place(*place),
                    cost: RouteCost::Length,
                    reverse: *reverse,
                    avoid_places: Vec::new(),
                    avoid_regions: Vec::new(),
                };
                Instruction::Follow(AGENT, errand)
            }
            Next::Pin(trip) => Instruction::Pin(*trip),
        };
        let record = Record::Instruct {
            number,
            instruction,
        };
        number += 1;
        run(&mut map, std::slice::from_ref(&record));
        records.push(record);
    }
    records
}

/// Routes between all pairs of some places.
fn all_routes(
    map: &CognitiveMap,
    bounds: Option<&RouteBounds>,
) -> Vec<Result<Vec<Route>, NoRoute>> {
    let places: Vec<_> = map.places().map(|(id, _)| id).step_by(3).collect();
    let options = RouteOptions {
        alternatives: 1,
        ..RouteOptions::default()
    };
    let pairs = places
        .iter()
        .flat_map(|a| places.iter().map(move |b| (a, b)));
    let found = pairs.map(|(a, b)| {
        let [from, to] = [a, b].map(|end| map.route_end_at(*end).unwrap());
        map.routes(&from, &to, &options, bounds, &mut || false)
    });
    found.collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// A map that goes on from a checkpoint has the same routes, blockages and pins.
    #[test]
    fn a_replay_comes_to_the_same_routes_and_blockages(
        all in prop::collection::vec(next(), 50..250),
        cut in any::<prop::sample::Index>(),
    ) {
        let records = journal(&all);
        let mut map = CognitiveMap::new(Settings::default());
        let events = run(&mut map, &records);
        let cut = cut.index(records.len());
        let mut other = CognitiveMap::new(Settings::default());
        let mut others = run(&mut other, &records[..cut]);
        let mut other = CognitiveMap::restore(Settings::default(), other.checkpoint(0)).unwrap();
        others.extend(run(&mut other, &records[cut..]));
        prop_assert_eq!(others, events);
        prop_assert_eq!(other.digest(), map.digest());
        prop_assert_eq!(other.blockages(), map.blockages());
        let rest = |map: &CognitiveMap| map.followed(AGENT).map(|of| of.rest().to_vec());
        prop_assert_eq!(rest(&other), rest(&map));
        let pins = |map: &CognitiveMap| [0, 1, 2].map(|trip| map.is_pinned(TripId(trip)));
        prop_assert_eq!(pins(&other), pins(&map));
        prop_assert_eq!(all_routes(&other, None), all_routes(&map, None));
    }

    /// Eight threads that ask one snapshot, which the writer goes on from, get what one gets.
    #[test]
    fn routes_are_the_same_on_one_thread_and_on_eight(
        all in prop::collection::vec(next(), 50..250),
        later in prop::collection::vec(next(), 0..50),
    ) {
        let mut map = CognitiveMap::new(Settings::default());
        run(&mut map, &journal(&all));
        let alone = all_routes(&map, None);
        let snapshot = map.clone();
        let bounds = RouteBounds::of(&snapshot);
        thread::scope(|scope| {
            let ask = |k: usize| all_routes(&snapshot, k.is_multiple_of(2).then_some(&bounds));
            let asked: Vec<_> = (0..8).map(|k| scope.spawn(move || ask(k))).collect();
            let together: Vec<_> = all.iter().chain(&later).cloned().collect();
            run(&mut map, &journal(&together));
            for thread in asked {
                assert_eq!(thread.join().unwrap(), alone);
            }
        });
    }
}
