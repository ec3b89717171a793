//! `cogmap-lab eval patrol`.

use std::time::Instant;

use anyhow::Context;
use clap::{Args, ValueEnum};
use cogmap::cli::{output, quantile};
use cogmap::metrics::resident_bytes;
use cogmap_client::Api;
use cogmap_lab::routes::{Floor, FloorKind};
use cogmap_proto::{RecallQuery, SpaceSettings};
use cognitive_map::{CognitiveMap, PlaceId};
use nalgebra::{Point2, Point3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::scout::Scout;
use crate::cli::bench::Bench;

/// Stations of a round.
const STATIONS: usize = 12;
/// Parts of the run, a row each.
const PARTS: u64 = 10;
/// Questions of each kind at the end of a part.
const QUESTIONS: usize = 500;

#[derive(Debug, Args)]
pub(in crate::cli) struct PatrolArgs {
    /// Samples that the robot sends.
    #[arg(long, default_value_t = 10_000_000, value_name = "N",
        value_parser = clap::value_parser!(u64).range(PARTS..))]
    samples: u64,
    /// Floor on which it patrols.
    #[arg(long, value_enum, default_value_t = PatrolFloor::Office)]
    floor: PatrolFloor,
    /// Seed of floor, stations, noise and questions.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum PatrolFloor {
    Hall,
    Office,
    Maze,
}

#[derive(Debug, Serialize)]
struct Report {
    floor: &'static str,
    seed: u64,
    /// By how much more memory the process has at the end than half-way, as a share.
    memory_growth: f64,
    rows: Vec<Row>,
}

/// A tenth of the run.
#[derive(Debug, Serialize)]
struct Row {
    /// So far.
    samples: u64,
    /// Of the process, the robot in it; 0 where the machine does not tell.
    memory_mb: f64,
    /// Durable, in this part.
    samples_per_s: f64,
    places: usize,
    ways: usize,
    trips: usize,
    legs: usize,
    recall_ms_p50: f64,
    recall_ms_p99: f64,
    route_ms_p50: f64,
    route_ms_p99: f64,
    /// How far the robot is from where the service has it \[m\].
    off_m: f64,
}

/// A place and where it is.
type Placed = (PlaceId, Point3<f64>);

/// A robot on its rounds, and the service that it sends to.
struct Patrol<'a> {
    bench: &'a Bench,
    scout: Scout<'a>,
    stations: Vec<Point2<f64>>,
    /// Stations that it has been at.
    visited: usize,
    random: ChaCha8Rng,
}

pub(in crate::cli) fn run(args: &PatrolArgs) -> anyhow::Result<()> {
    let bench = Bench::start(None)?;
    let rows = rows(&bench, args);
    bench.stop();
    let rows = rows?;
    let memory_mb = |part: usize| rows.get(part).map_or(f64::NAN, |row| row.memory_mb);
    let report = Report {
        floor: args.floor.kind().name(),
        seed: args.seed,
        memory_growth: memory_mb(rows.len() - 1) / memory_mb(rows.len() / 2 - 1) - 1.0,
        rows,
    };
    if args.json {
        return output::json(&report);
    }
    output::line(
        "  samples  samples/s  memory [MB]  places  ways  trips   legs  recall p50, p99 [ms]  \
        route p50, p99 [ms]  off [m]",
    )?;
    for row in &report.rows {
        output::line(&format!(
            "{:9}  {:9.0}  {:11.1}  {:6}  {:4}  {:5}  {:5}  {:11.2} {:8.2}  {:10.2} {:8.2}  {:7.3}",
            row.samples,
            row.samples_per_s,
            row.memory_mb,
            row.places,
            row.ways,
            row.trips,
            row.legs,
            row.recall_ms_p50,
            row.recall_ms_p99,
            row.route_ms_p50,
            row.route_ms_p99,
            row.off_m
        ))?;
    }
    Ok(output::line(&format!(
        "memory over the last half: {:+.1} %",
        100.0 * report.memory_growth
    ))?)
}

fn rows(bench: &Bench, args: &PatrolArgs) -> anyhow::Result<Vec<Row>> {
    let api = Api::new(&format!("http://{}", bench.service().address()), None);
    let mut patrol = Patrol::new(bench, &api, args)?;
    let mut rows = Vec::new();
    for part in 1..=PARTS {
        let samples = u128::from(args.samples) * u128::from(part) / u128::from(PARTS);
        rows.push(patrol.part(u64::try_from(samples)?)?);
        output::progress(&format!("{samples} of {} samples", args.samples));
    }
    Ok(rows)
}

impl PatrolFloor {
    fn kind(self) -> FloorKind {
        match self {
            Self::Hall => FloorKind::Hall,
            Self::Office => FloorKind::Office,
            Self::Maze => FloorKind::Maze,
        }
    }
}

impl<'a> Patrol<'a> {
    fn new(bench: &'a Bench, api: &'a Api, args: &PatrolArgs) -> anyhow::Result<Self> {
        let kind = args.floor.kind();
        let floor = Floor::new(kind, args.seed);
        let mut random = ChaCha8Rng::seed_from_u64(args.seed);
        let stations: Vec<_> = (0..STATIONS).map(|_| floor.any_free(&mut random)).collect();
        api.create_space(kind.name(), &SpaceSettings::default())?;
        let mut scout = Scout::new(api, kind.name(), floor, stations[0], args.seed);
        scout.robot.forget_trail();
        Ok(Self {
            bench,
            scout,
            stations,
            visited: 0,
            random,
        })
    }

    /// Goes on until so many samples are sent, and asks.
    fn part(&mut self, samples: u64) -> anyhow::Result<Row> {
        let (before, begin) = (self.scout.sent(), Instant::now());
        while self.scout.sent() < samples {
            self.visited += 1;
            let station = self.stations[self.visited % STATIONS];
            self.scout.go_to(&station)?;
        }
        self.scout.send()?;
        let samples_per_s = (self.scout.sent() - before) as f64 / begin.elapsed().as_secs_f64();
        // Before the questions, whose snapshot is a copy.
        let memory_mb = resident_bytes().unwrap_or(0) as f64 / 1e6;
        let space = self.bench.service().engine().space(self.scout.space);
        let space = space.context("the space is there")?;
        let map = self.bench.runtime().block_on(space.snapshot())?;
        let [recall_ms_p50, recall_ms_p99] = self.ask(&map, Self::recall)?;
        let [route_ms_p50, route_ms_p99] = self.ask(&map, Self::route)?;
        let started_at = self.scout.robot.started_at();
        let moved = self.scout.robot.position() - started_at;
        Ok(Row {
            samples: self.scout.sent(),
            memory_mb,
            samples_per_s,
            places: map.place_count(),
            ways: map.way_count(),
            trips: map.trip_count(),
            legs: map.leg_count(),
            recall_ms_p50,
            recall_ms_p99,
            route_ms_p50,
            route_ms_p99,
            off_m: (self.scout.estimate()?.0.coords - moved).norm(),
        })
    }

    /// Asks about random pairs of places; answers the median and the 99th percentile \[ms\].
    fn ask(
        &mut self,
        map: &CognitiveMap,
        question: fn(&Self, [Placed; 2]) -> anyhow::Result<()>,
    ) -> anyhow::Result<[f64; 2]> {
        let places: Vec<_> = map
            .places()
            .map(|(id, place)| (id, *place.position()))
            .collect();
        let mut times_ms = Vec::new();
        for _ in 0..QUESTIONS {
            let pair = [(); 2].map(|()| places[self.random.random_range(0..places.len())]);
            let begin = Instant::now();
            question(self, pair)?;
            times_ms.push(begin.elapsed().as_secs_f64() * 1e3);
        }
        Ok([0.5, 0.99].map(|q| quantile(&mut times_ms, q)))
    }

    fn recall(&self, [(_, position), _]: [Placed; 2]) -> anyhow::Result<()> {
        let query = RecallQuery {
            position_m: Some(position.coords.into()),
            ..RecallQuery::default()
        };
        let answer = self.scout.api.recall(self.scout.space, &query)?;
        anyhow::ensure!(!answer.places.is_empty(), "no place is recalled");
        Ok(())
    }

    fn route(&self, [(from, _), (to, _)]: [Placed; 2]) -> anyhow::Result<()> {
        let length_m = self.scout.route(from, to);
        length_m.with_context(|| format!("route from place {} to {}", from.0, to.0))?;
        Ok(())
    }
}
