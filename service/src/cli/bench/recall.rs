//! `cogmap bench recall`.

use std::time::Instant;

use clap::Args;
use cognitive_map::grid::{PartialCode, similarity};
use cognitive_map::{
    AgentId, CognitiveMap, Label, Motion, PlaceId, PoseNoise, RecallCue, Record, Sample,
    SampleBody, Settings, SettingsValues, StartPose,
};
use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::quantile::quantile;
use crate::cli::output;

/// Queries of one round at one size; rounds of all sizes alternate, so that the machine's moods hit
/// them alike.
const QUERIES_OF_ROUND: usize = 1_000;
/// Queries compared with a scan over all places, at each number of places.
const SCANNED: usize = 50;
/// Places per cubic metre: a million fill a cube of 50 m.
const PLACES_PER_M3: f64 = 8.0;
/// Standard deviation of a query's position from the stored one, along each axis.
const JITTER_M: f64 = 0.05;
/// An answer farther away than this is another place's.
const FAR_M: f64 = 0.5;

#[derive(Debug, Args)]
pub(in crate::cli) struct RecallArgs {
    /// Numbers of places.
    #[arg(long, value_delimiter = ',', default_values_t = [1_000, 10_000, 100_000, 1_000_000])]
    places: Vec<u64>,
    /// Rounds of 1,000 recalls at each number.
    #[arg(long, default_value_t = 20)]
    rounds: u64,
    /// Seed of places and queries.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    /// What a query is.
    query: &'static str,
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    places: u64,
    us_p50: f64,
    us_p99: f64,
    /// Share of the queries that were scanned whose answer is the scan's.
    recall_at_1: f64,
    /// Share of all queries that were answered by a place more than half a metre away.
    beyond_half_m: f64,
    bytes_per_place: f64,
    /// From the journal's samples.
    build_s: f64,
    /// From a checkpoint.
    load_s: f64,
}

pub(super) fn run(args: &RecallArgs) -> anyhow::Result<()> {
    let mut memories = Vec::new();
    for &places in &args.places {
        output::progress(&format!("building a map of {places} places"));
        memories.push(Memory::of(places, args.seed)?);
    }
    for memory in &mut memories {
        let places = memory.map.place_count();
        output::progress(&format!("scanning {places} places {SCANNED} times"));
        memory.compare_with_scan();
    }
    for round in 0..args.rounds {
        output::progress(&format!("round {} of {}", round + 1, args.rounds));
        for memory in &mut memories {
            memory.round();
        }
    }
    let rows: Vec<_> = memories.iter_mut().map(Memory::row).collect();
    if args.json {
        return output::json(&Report {
            query: "whole code of a stored position, shifted by 5 cm (sd) along each axis",
            rows,
        });
    }
    output::line(
        "   places   p50 [µs]   p99 [µs]   recall@1   > 0.5 m   bytes/place   build [s]   load [s]",
    )?;
    for row in rows {
        output::line(&format!(
            "{:>9} {:>10.2} {:>10.2} {:>10.4} {:>9.5} {:>13.1} {:>11.2} {:>10.2}",
            row.places,
            row.us_p50,
            row.us_p99,
            row.recall_at_1,
            row.beyond_half_m,
            row.bytes_per_place,
            row.build_s,
            row.load_s,
        ))?;
    }
    Ok(())
}

/// A map and what was measured on it.
struct Memory {
    map: CognitiveMap,
    random: Random,
    build_s: f64,
    load_s: f64,
    times_us: Vec<f64>,
    beyond_half_m: u64,
    agreed: usize,
}

impl Memory {
    /// A map of places all over a cube, at a density that does not depend on their number. They are
    /// recruited by the rule of novelty, so no two are closer than a field radius.
    fn of(places: u64, seed: u64) -> anyhow::Result<Self> {
        let mut random = Random(seed);
        let edge_m = (places as f64 / PLACES_PER_M3).cbrt();
        let upright = [0.0, 0.0, 0.0, 1.0];
        let still = Motion::from_increment([0.0; 3], upright, None)?;
        let start = Instant::now();
        let settings = Settings::new(SettingsValues {
            places_max: u32::MAX,
            ..SettingsValues::default()
        })?;
        let mut map = CognitiveMap::new(settings.clone());
        let (agent, mut seq) = (AgentId(0), 0);
        let mut events = Vec::new();
        let name = Label::new("surveyor")?;
        map.apply(&Record::Enrol { agent, name }, &mut events);
        while (map.place_count() as u64) < places {
            let position = [(); 3].map(|()| (random.uniform() - 0.5) * edge_m);
            let put = StartPose::new(position, upright, PoseNoise::none())?;
            for body in [SampleBody::StartPose(put), SampleBody::Motion(still)] {
                let stamp_ns = i64::try_from(seq).unwrap_or(i64::MAX);
                let sample = Sample { stamp_ns, body };
                let record = Record::Sample {
                    agent,
                    session: 1,
                    seq,
                    sample,
                };
                map.apply(&record, &mut events);
                seq += 1;
            }
            events.clear();
        }
        let build_s = start.elapsed().as_secs_f64();
        let pages: Vec<_> = map.checkpoint(0).collect();
        let start = Instant::now();
        let map = CognitiveMap::restore(settings, pages)?;
        Ok(Self {
            map,
            random,
            build_s,
            load_s: start.elapsed().as_secs_f64(),
            times_us: Vec::new(),
            beyond_half_m: 0,
            agreed: 0,
        })
    }

    /// A query, and the position that its code is of.
    fn query(&mut self) -> (RecallCue, Point3<f64>) {
        let places = self.map.place_count() as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a share of a count is an identifier"
        )]
        let place = PlaceId((self.random.uniform() * places) as u32);
        let place = self.map.place(place).expect("identifiers count up from 0");
        let shift = Vector3::from_fn(|_, _| self.random.normal() * JITTER_M);
        let position = place.position() + shift;
        let code = PartialCode::from(&self.map.modules().code_at(&position));
        let cue = RecallCue {
            position: None,
            code: Some(code),
            percept: None,
            radius_m: None,
            founder: None,
            since_ns: None,
            until_ns: None,
            limit: 1,
        };
        (cue, position)
    }

    /// Compares answers with those of a scan over all places.
    fn compare_with_scan(&mut self) {
        for _ in 0..SCANNED {
            let (cue, _) = self.query();
            let code = cue.code.as_ref().expect("queries have a code");
            let modules = self.map.modules();
            let scored = self.map.places().map(|(id, place)| {
                let cosine = similarity::kernel(modules, code, &place.code(modules));
                (id, cosine)
            });
            // The first of equals stays, which is that with the lowest identifier.
            let best = scored.reduce(|best, other| if other.1 > best.1 { other } else { best });
            let answer = self.map.recall(&cue);
            let same = answer.first().map(|first| first.place) == best.map(|best| best.0);
            self.agreed += usize::from(same);
        }
    }

    /// Recalls many times and notes how long each took.
    fn round(&mut self) {
        let queries: Vec<_> = (0..QUERIES_OF_ROUND).map(|_| self.query()).collect();
        for (cue, position) in queries {
            let start = Instant::now();
            let answer = self.map.recall(&cue);
            let elapsed = start.elapsed();
            self.times_us.push(elapsed.as_nanos() as f64 / 1e3);
            let near = answer
                .first()
                .and_then(|first| self.map.place(first.place))
                .is_some_and(|place| (place.position() - position).norm() <= FAR_M);
            self.beyond_half_m += u64::from(!near);
        }
    }

    fn row(&mut self) -> Row {
        Row {
            places: self.map.place_count() as u64,
            us_p50: quantile(&mut self.times_us, 0.5),
            us_p99: quantile(&mut self.times_us, 0.99),
            recall_at_1: self.agreed as f64 / SCANNED as f64,
            beyond_half_m: self.beyond_half_m as f64 / self.times_us.len() as f64,
            bytes_per_place: self.map.place_bytes() as f64 / self.map.place_count() as f64,
            build_s: self.build_s,
            load_s: self.load_s,
        }
    }
}

/// A seeded source of random numbers (`SplitMix64`).
struct Random(u64);

impl Random {
    /// Uniform in \[0, 1).
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal (Box & Muller 1958).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}
