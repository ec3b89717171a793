//! `cogmap-lab eval routes`.

mod followed;

use std::collections::BTreeMap;

use anyhow::Context;
use clap::Args;
use cogmap_client::{Api, ApiError};
use cogmap_lab::routes::{Floor, FloorKind};
use cogmap_proto::SpaceSettings;
use cognitive_map::CognitiveMap;
use petgraph::algo::dijkstra;
use petgraph::graphmap::UnGraphMap;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::scout::Scout;
use crate::cli::bench::Bench;
use cogmap::cli::output;
use followed::Followed;

#[derive(Debug, Args)]
pub(in crate::cli) struct RoutesArgs {
    /// Steps by which a floor is explored.
    #[arg(long, default_value_t = 20_000)]
    steps: u64,
    /// Pairs of places between which routes are asked for.
    #[arg(long, default_value_t = 1000)]
    pairs: usize,
    /// Routes that are followed, and as many with ways blocked underway.
    #[arg(long, default_value_t = 200)]
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

pub(super) fn run(args: &RoutesArgs) -> anyhow::Result<()> {
    let bench = Bench::start(None)?;
    let rows = FloorKind::ALL.map(|kind| row(&bench, kind, args));
    bench.stop();
    let rows = rows.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    if args.json {
        return output::json(&rows);
    }
    output::line(
        "floor   places  ways  joined  found  off [m]   followed: routes arrived in truth  no way  \
        lost  reported  pose and place off [m]",
    )?;
    for row in rows {
        let head = format!(
            "{:<7} {:>6} {:>5} {:>7} {:>6} {:>8.6}",
            row.floor, row.places, row.ways, row.joined, row.found, row.length_off_m
        );
        for (name, of) in [("free", &row.free), ("blocked", &row.blocked)] {
            output::line(&format!(
                "{head}   {name:<8} {:>7} {:>7} {:>8} {:>7} {:>5} {:>9} {:>6.3} {:>6.3}",
                of.routes,
                of.arrived,
                of.arrived_in_truth,
                of.no_way,
                of.lost,
                of.reported,
                of.pose_off_m,
                of.place_off_m
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
    let mut scout = Scout::new(&api, kind.name(), floor, start, args.seed);
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
        followed::follow(&mut scout, &map, 0.0, &mut random, &mut row.free)?;
    }
    for _ in 0..args.followed {
        followed::follow(
            &mut scout,
            &map,
            args.blocked,
            &mut random,
            &mut row.blocked,
        )?;
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
