//! `cogmap-lab eval routes`.

use std::collections::BTreeMap;

use anyhow::Context;
use clap::Args;
use cogmap_client::{Api, ApiError};
use cogmap_lab::routes::{Floor, FloorKind, PlanarRobot};
use cogmap_proto::{
    BlockageRequest, FollowRequest, RouteAvoid, RouteCost, RouteEnd, RouteFormat, RouteQuery,
    RouteReverse, SampleBatch, SpaceSettings,
};
use cognitive_map::{CognitiveMap, PlaceId};
use nalgebra::{Point2, Vector2};
use petgraph::algo::dijkstra;
use petgraph::graphmap::UnGraphMap;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::cli::bench::Bench;
use cogmap::cli::output;

const AGENT: &str = "scout";
/// Steps of a message while the floor is explored, and while a route is followed.
const BATCH_STEPS: [u64; 2] = [100, 3];
/// How near the goal one must come \[m\].
const ARRIVED_M: f64 = 0.3;
/// Steps after which a robot that has not arrived is given up.
const STEPS_MAX: u64 = 1500;
/// Steps on a route before ways are blocked.
const UNDERWAY_STEPS: u64 = 30;

#[derive(Debug, Args)]
pub(in crate::cli) struct RoutesArgs {
    /// Steps by which a floor is explored.
    #[arg(long, default_value_t = 20_000)]
    steps: u64,
    /// Pairs of places between which routes are asked for.
    #[arg(long, default_value_t = 1000)]
    pairs: usize,
    /// Routes that are followed, and as many with ways blocked underway.
    #[arg(long, default_value_t = 100)]
    followed: usize,
    /// Share of ways that are blocked underway.
    #[arg(long, default_value_t = 0.05)]
    blocked: f64,
    /// Seed of floors, noise and pairs.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Default, Serialize)]
struct Row {
    floor: &'static str,
    places: usize,
    ways: usize,
    pairs: usize,
    /// Pairs that ways join, and of these those between which a route was found.
    joined: usize,
    found: usize,
    /// Routes that were found where no way is.
    made_up: usize,
    /// Largest difference of a route's length from Dijkstra's \[m\].
    length_off_m: f64,
    free: Followed,
    blocked: Followed,
}

/// What became of routes that were followed.
#[derive(Debug, Default, Serialize)]
struct Followed {
    routes: usize,
    /// Told to be done within 0.3 m of the goal, as the map has both, and in truth.
    arrived: usize,
    arrived_in_truth: usize,
    /// Told that no way is left.
    no_way: usize,
    /// Neither.
    lost: usize,
}

/// A robot on a floor whose samples go to a service.
struct Scout<'a> {
    api: &'a Api,
    space: &'static str,
    floor: Floor,
    robot: PlanarRobot,
    /// Where the map's origin is on the floor.
    origin: Vector2<f64>,
    seq: u64,
}

pub(super) fn run(args: &RoutesArgs) -> anyhow::Result<()> {
    let bench = Bench::start(None)?;
    let rows = FloorKind::ALL.map(|kind| row(&bench, kind, args));
    bench.stop();
    let rows = rows.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    if args.json {
        return output::json(&rows);
    }
    output::line(
        "floor   places  ways  joined  found  off [m]   followed: routes arrived in truth no way lost",
    )?;
    for row in rows {
        let head = format!(
            "{:<7} {:>6} {:>5} {:>7} {:>6} {:>8.6}",
            row.floor, row.places, row.ways, row.joined, row.found, row.length_off_m
        );
        for (name, of) in [("free", &row.free), ("blocked", &row.blocked)] {
            output::line(&format!(
                "{head}   {name:<8} {:>7} {:>7} {:>8} {:>6} {:>4}",
                of.routes, of.arrived, of.arrived_in_truth, of.no_way, of.lost
            ))?;
        }
        anyhow::ensure!(
            row.made_up == 0,
            "{} routes lead along no ways",
            row.made_up
        );
    }
    Ok(())
}

fn row(bench: &Bench, kind: FloorKind, args: &RoutesArgs) -> anyhow::Result<Row> {
    let api = Api::new(&format!("http://{}", bench.service().address()), None);
    let floor = Floor::new(kind, args.seed);
    let mut random = ChaCha8Rng::seed_from_u64(args.seed);
    let start = floor.any_free(&mut random);
    let mut scout = Scout {
        api: &api,
        space: kind.name(),
        floor,
        robot: PlanarRobot::new(start, args.seed),
        origin: start.coords,
        seq: 0,
    };
    api.create_space(kind.name(), &SpaceSettings::default())?;
    output::progress(&format!("exploring the {}", kind.name()));
    scout.explore(args.steps, &mut random)?;
    let space = bench.service().engine().space(kind.name());
    let space = space.context("the space is there")?;
    let map = bench.runtime().block_on(space.snapshot())?;
    let mut row = Row {
        floor: kind.name(),
        places: map.place_count(),
        ways: map.way_count(),
        ..Row::default()
    };
    output::progress(&format!("asking for {} routes", args.pairs));
    ask(&scout, &map, args.pairs, &mut random, &mut row)?;
    output::progress(&format!("following {} routes", 2 * args.followed));
    for _ in 0..args.followed {
        scout.follow(&map, 0.0, &mut random, &mut row.free)?;
    }
    for _ in 0..args.followed {
        scout.follow(&map, args.blocked, &mut random, &mut row.blocked)?;
    }
    Ok(row)
}

/// Asks for routes between random places, and compares them with Dijkstra's.
fn ask(
    scout: &Scout<'_>,
    map: &CognitiveMap,
    pairs: usize,
    random: &mut ChaCha8Rng,
    row: &mut Row,
) -> anyhow::Result<()> {
    let mut graph = UnGraphMap::<u32, f64>::new();
    for way in map.ways() {
        let places = map.places_of_way(way).context("a way has places")?;
        let [a, b] = way.ends();
        graph.add_edge(a.0, b.0, way.length_m(&places));
    }
    let places: Vec<_> = map.places().map(|(id, _)| id).collect();
    for _ in 0..pairs {
        let [from, to] = [(); 2].map(|()| places[random.random_range(0..places.len())]);
        let lengths: BTreeMap<_, _> = if graph.contains_node(from.0) {
            let found = dijkstra(&graph, from.0, Some(to.0), |edge| *edge.2);
            found.into_iter().collect()
        } else {
            BTreeMap::from([(from.0, 0.0)])
        };
        let expected = lengths.get(&to.0);
        row.pairs += 1;
        row.joined += usize::from(expected.is_some());
        match (scout.route(from, to), expected) {
            (Ok(length_m), Some(expected)) => {
                row.found += 1;
                row.length_off_m = row.length_off_m.max((length_m - expected).abs());
            }
            (Ok(_), None) => row.made_up += 1,
            (Err(ApiError::Problem(problem)), None) if problem.status == 409 => {}
            (Err(ApiError::Problem(problem)), Some(_)) if problem.status == 409 => {}
            (Err(error), _) => return Err(error.into()),
        }
    }
    Ok(())
}

impl Scout<'_> {
    /// Length of the route between two places \[m\].
    fn route(&self, from: PlaceId, to: PlaceId) -> Result<f64, ApiError> {
        let query = RouteQuery {
            from: RouteEnd::Place(from.0.into()),
            to: RouteEnd::Place(to.0.into()),
            cost: RouteCost::Length,
            reverse: RouteReverse::Allowed,
            avoid: RouteAvoid::default(),
            shortcuts: false,
            body_radius_m: None,
            alternatives: 0,
            format: RouteFormat::Steps,
            spacing_m: None,
        };
        Ok(self.api.route(self.space, &query)?.length_m)
    }

    /// Goes from one random position to the next.
    fn explore(&mut self, steps: u64, random: &mut ChaCha8Rng) -> anyhow::Result<()> {
        while self.robot.steps() < steps {
            let goal = self.floor.any_free(random);
            for point in self.floor.path(&self.robot.position(), &goal) {
                while (point - self.robot.position()).norm() > 1e-6 {
                    let to = point - self.robot.position();
                    let turn_rad = turn_to(self.robot.heading_rad(), &to);
                    // Beside the points the way to them may be cut off by a corner.
                    if !self.robot.step(&self.floor, turn_rad, to.norm()) {
                        break;
                    }
                    if self.robot.steps().is_multiple_of(BATCH_STEPS[0]) {
                        self.send()?;
                    }
                }
            }
        }
        self.send()
    }

    fn send(&mut self) -> anyhow::Result<()> {
        let samples = self.robot.take();
        let count = samples.len() as u64;
        if count > 0 {
            let batch = SampleBatch {
                session: 1,
                first_seq: self.seq,
                samples,
            };
            self.api.post_samples(self.space, AGENT, &batch)?;
            self.seq += count;
        }
        Ok(())
    }

    /// Lets the robot follow a route to a random place, and drives it.
    fn follow(
        &mut self,
        map: &CognitiveMap,
        blocked: f64,
        random: &mut ChaCha8Rng,
        told: &mut Followed,
    ) -> anyhow::Result<()> {
        let places: Vec<_> = map.places().collect();
        let (goal, place) = places[random.random_range(0..places.len())];
        let goal_m = Point2::from(place.position().xy());
        let request = FollowRequest {
            to: RouteEnd::Place(goal.0.into()),
            cost: RouteCost::Length,
            reverse: RouteReverse::Allowed,
            avoid: RouteAvoid::default(),
        };
        self.api.follow_route(self.space, AGENT, &request)?;
        told.routes += 1;
        let first = self.robot.steps();
        let mut blockages = Vec::new();
        let mut outcome = None;
        while outcome.is_none() && self.robot.steps() < first + STEPS_MAX {
            if blocked > 0.0 && blockages.is_empty() && self.robot.steps() > first + UNDERWAY_STEPS
            {
                blockages = self.block(map, blocked, random)?;
            }
            outcome = self.drive(&goal_m)?;
        }
        let near = self.estimate()?.0;
        let at = self.robot.position() - self.origin;
        let arrived = (near - goal_m).norm() <= ARRIVED_M;
        told.arrived += usize::from(arrived);
        told.arrived_in_truth += usize::from(arrived && (at - goal_m).norm() <= ARRIVED_M);
        told.no_way += usize::from(!arrived && outcome.is_some());
        told.lost += usize::from(!arrived && outcome.is_none());
        for blockage in blockages {
            // Somebody may have travelled there.
            let _ = self.api.unblock(self.space, blockage);
        }
        Ok(())
    }

    /// Blocks a share of the ways.
    fn block(
        &self,
        map: &CognitiveMap,
        share: f64,
        random: &mut ChaCha8Rng,
    ) -> anyhow::Result<Vec<u64>> {
        let mut blockages = Vec::new();
        for way in map.ways() {
            if random.random::<f64>() < share {
                let [from, to] = way.ends().map(|end| Some(u64::from(end.0)));
                let request = BlockageRequest {
                    from,
                    to,
                    ..BlockageRequest::default()
                };
                blockages.push(self.api.block(self.space, &request)?.id);
            }
        }
        Ok(blockages)
    }

    /// Goes some steps of the route; answers whether it is over.
    fn drive(&mut self, goal_m: &Point2<f64>) -> anyhow::Result<Option<()>> {
        let route = match self.api.followed_route(self.space, AGENT) {
            Ok(route) => route,
            Err(ApiError::Problem(problem)) if problem.status == 404 => return Ok(Some(())),
            Err(error) => return Err(error.into()),
        };
        let [x, y, _] = route
            .steps
            .first()
            .map_or([goal_m.x, goal_m.y, 0.0], |s| s.translation_m);
        let (at, mut heading_rad) = self.estimate()?;
        let to = Point2::new(x, y) - at;
        for k in 0..BATCH_STEPS[1] {
            let left_m = to.norm() - 0.1 * k as f64;
            if left_m <= 0.0 && k > 0 {
                break;
            }
            let turn_rad = turn_to(heading_rad, &to);
            heading_rad += turn_rad;
            self.robot.step(&self.floor, turn_rad, left_m.max(0.02));
        }
        self.send()?;
        Ok(None)
    }

    /// Where the service has the robot, and which way it faces \[rad\].
    fn estimate(&self) -> anyhow::Result<(Point2<f64>, f64)> {
        let estimate = self.api.agent(self.space, AGENT)?.estimate;
        let estimate = estimate.context("an agent with samples has an estimate")?;
        let [x, y, _] = estimate.translation_m;
        let [_, _, sine, cosine] = estimate.rotation_xyzw;
        Ok((Point2::new(x, y), 2.0 * sine.atan2(cosine)))
    }
}

/// The turn after which one faces along a vector \[rad\].
fn turn_to(heading_rad: f64, to: &Vector2<f64>) -> f64 {
    let turn_rad = to.y.atan2(to.x) - heading_rad;
    turn_rad.sin().atan2(turn_rad.cos())
}
