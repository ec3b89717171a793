//! `cogmap-lab bench route`.

use std::collections::BTreeMap;
use std::time::Instant;

use clap::Args;
use cogmap_lab::eval::network::network;
use cognitive_map::{CognitiveMap, PlaceId, Route, RouteBounds, RouteEnd, RouteOptions};
use nalgebra::Point3;
use petgraph::algo::astar;
use petgraph::graph::{NodeIndex, UnGraph};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use cogmap::cli::output;
use cogmap::cli::quantile;

#[derive(Debug, Args)]
pub(in crate::cli) struct RouteArgs {
    /// Numbers of places; there are nearly three times as many ways.
    #[arg(long, value_delimiter = ',', default_values_t = [1_000, 10_000, 100_000],
        value_parser = clap::value_parser!(u32).range(4..))]
    places: Vec<u32>,
    /// Pairs of places between which routes are asked for, at each number.
    #[arg(long, default_value_t = 300)]
    pairs: u32,
    /// Seed of places and pairs.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    /// What is asked.
    question: &'static str,
    seed: u64,
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    places: usize,
    ways: usize,
    /// With distances from pivots.
    us_p50: f64,
    us_p99: f64,
    /// With the ways as a search reads them, and the straight line alone.
    straight_us_p50: f64,
    straight_us_p99: f64,
    /// Petgraph's `astar` with the straight line.
    petgraph_us_p50: f64,
    petgraph_us_p99: f64,
    /// Routes whose cost is not that of petgraph's.
    other_costs: usize,
    /// Routes that are others with distances from pivots, without, or without any bounds.
    other_routes: usize,
    /// Until the distances from pivots are made.
    bounds_s: f64,
    bytes_per_way: f64,
}

pub(super) fn run(args: &RouteArgs) -> anyhow::Result<()> {
    let mut rows = Vec::new();
    for &places in &args.places {
        output::progress(&format!("building a network of {places} places"));
        let map = network(places, args.seed)?;
        output::progress(&format!("asking for {} routes", args.pairs));
        rows.push(row(&map, args));
    }
    if args.json {
        let question = "the shortest route between two random places";
        let seed = args.seed;
        return output::json(&Report {
            question,
            seed,
            rows,
        });
    }
    output::line(
        "  places     ways   p50 [µs]   p99 [µs]   straight p50   p99   petgraph p50   p99   \
        bounds [s]   bytes/way",
    )?;
    for row in rows {
        output::line(&format!(
            "{:>8} {:>8} {:>10.1} {:>10.1} {:>14.1} {:>8.1} {:>11.1} {:>8.1} {:>8.2} {:>8.0}",
            row.places,
            row.ways,
            row.us_p50,
            row.us_p99,
            row.straight_us_p50,
            row.straight_us_p99,
            row.petgraph_us_p50,
            row.petgraph_us_p99,
            row.bounds_s,
            row.bytes_per_way,
        ))?;
        if row.other_costs + row.other_routes > 0 {
            output::line(&format!(
                "{} costs and {} routes differ",
                row.other_costs, row.other_routes
            ))?;
        }
    }
    Ok(())
}

/// The ways as a graph of petgraph.
struct Yardstick {
    graph: UnGraph<Point3<f64>, u64>,
    nodes: BTreeMap<PlaceId, NodeIndex>,
}

impl Yardstick {
    fn of(map: &CognitiveMap) -> Self {
        let mut graph = UnGraph::default();
        let nodes = map
            .places()
            .map(|(id, place)| (id, graph.add_node(*place.position())));
        let nodes: BTreeMap<_, _> = nodes.collect();
        for way in map.ways() {
            if let [Some(a), Some(b)] = way.ends().map(|end| nodes.get(&end))
                && let Some(places) = map.places_of_way(way)
            {
                graph.add_edge(*a, *b, micrometres((way.length_m(&places) * 1e6).ceil()));
            }
        }
        Self { graph, nodes }
    }

    /// The cost of the shortest route.
    fn cost(&self, from: PlaceId, to: PlaceId) -> Option<u64> {
        let (from, to) = (*self.nodes.get(&from)?, *self.nodes.get(&to)?);
        let goal = self.graph[to];
        let straight =
            |node: NodeIndex| micrometres((self.graph[node] - goal).norm() * (1e6 - 1e-3));
        let found = astar(
            &self.graph,
            from,
            |node| node == to,
            |edge| *edge.weight(),
            straight,
        );
        Some(found?.0)
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "lengths within a building"
)]
fn micrometres(length_um: f64) -> u64 {
    length_um as u64
}

fn row(map: &CognitiveMap, args: &RouteArgs) -> Row {
    let start = Instant::now();
    let bounds = RouteBounds::of(map);
    let bounds_s = start.elapsed().as_secs_f64();
    let line = RouteBounds::straight(map);
    let yardstick = Yardstick::of(map);
    let mut random = ChaCha8Rng::seed_from_u64(args.seed);
    let places: Vec<_> = map.places().map(|(id, _)| id).collect();
    let [mut with, mut straight, mut petgraph] = [(); 3].map(|()| Vec::new());
    let (mut other_costs, mut other_routes) = (0, 0);
    for _ in 0..args.pairs {
        let [from, to] = [(); 2].map(|()| places[random.random_range(0..places.len())]);
        let ends = [from, to].map(|place| map.route_end_at(place).expect("a place of the map"));
        // One after the other, so that the machine's moods hit them alike.
        let led = timed(&mut with, || route(map, &ends, Some(&bounds)));
        let plain = timed(&mut straight, || route(map, &ends, Some(&line)));
        let cost = timed(&mut petgraph, || yardstick.cost(from, to));
        other_costs += usize::from(plain.as_ref().map(|route| route.cost_micro) != cost);
        other_routes += usize::from(plain != led || plain != route(map, &ends, None));
    }
    Row {
        places: map.place_count(),
        ways: map.way_count(),
        us_p50: quantile(&mut with, 0.5),
        us_p99: quantile(&mut with, 0.99),
        straight_us_p50: quantile(&mut straight, 0.5),
        straight_us_p99: quantile(&mut straight, 0.99),
        petgraph_us_p50: quantile(&mut petgraph, 0.5),
        petgraph_us_p99: quantile(&mut petgraph, 0.99),
        other_costs,
        other_routes,
        bounds_s,
        bytes_per_way: map.way_bytes() as f64 / map.way_count() as f64,
    }
}

fn route(map: &CognitiveMap, ends: &[RouteEnd; 2], bounds: Option<&RouteBounds>) -> Option<Route> {
    let options = RouteOptions::default();
    let found = map.routes(&ends[0], &ends[1], &options, bounds, &mut || false);
    found.ok()?.into_iter().next()
}

/// Notes how long something takes \[µs\].
fn timed<T>(times_us: &mut Vec<f64>, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let made = work();
    times_us.push(start.elapsed().as_nanos() as f64 / 1e3);
    made
}
