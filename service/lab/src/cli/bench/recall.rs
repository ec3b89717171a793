//! `cogmap-lab bench recall`.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use cogmap_lab::eval::code::{CueSource, Damage, DrawnCue, survey};
use cognitive_map::{CognitiveMap, Settings, SettingsValues};
use grid::similarity;
use nalgebra::Point3;
use serde::Serialize;

use cogmap::cli::output;
use cogmap::cli::quantile;

/// Queries of one round at one size; rounds of all sizes alternate, so that the machine's moods hit
/// them alike.
const QUERIES_OF_ROUND: usize = 1_000;
/// Queries compared with a scan over all places, at each number of places.
const SCANNED: usize = 50;
/// Standard deviation of a query's position from the stored one, along each axis.
const JITTER_M: f64 = 0.05;
/// An answer farther away than this is another place's.
const FAR_M: f64 = 0.5;

#[derive(Debug, Args)]
pub(in crate::cli) struct RecallArgs {
    /// Numbers of places.
    #[arg(long, value_delimiter = ',', default_values_t = [1_000, 10_000, 100_000, 1_000_000],
        value_parser = clap::value_parser!(u64).range(1..))]
    places: Vec<u64>,
    /// Rounds of 1,000 recalls at each number.
    #[arg(long, default_value_t = 20)]
    rounds: u64,
    /// Number of grid modules; the default of a space when absent.
    #[arg(long, value_name = "N")]
    grid_modules: Option<usize>,
    /// Spacing of the finest grid module [m]; the default of a space when absent.
    #[arg(long, value_name = "M")]
    grid_spacing_m: Option<f64>,
    /// Ratio of the spacings of neighbouring modules; the default of a space when absent.
    #[arg(long, value_name = "RATIO")]
    grid_ratio: Option<f64>,
    /// Seed of places and queries.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write where the places and the queries of the last round are [m] into this directory, for
    /// other programs to be asked the same: places-N.csv and queries-N.csv at each number N of
    /// places.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    /// What a query is.
    query: &'static str,
    seed: u64,
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
    let default = SettingsValues::default();
    let settings = Settings::new(SettingsValues {
        grid_modules: args.grid_modules.unwrap_or(default.grid_modules),
        grid_spacing_m: args.grid_spacing_m.unwrap_or(default.grid_spacing_m),
        grid_ratio: args.grid_ratio.unwrap_or(default.grid_ratio),
        places_max: u32::MAX,
        ..default
    })?;
    let mut memories = Vec::new();
    for &places in &args.places {
        output::progress(&format!("building a map of {places} places"));
        memories.push(Memory::of(places, settings.clone(), args.seed)?);
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
    if let Some(directory) = &args.out {
        for memory in &memories {
            memory
                .write(directory)
                .with_context(|| format!("write into {}", directory.display()))?;
        }
    }
    let rows: Vec<_> = memories.iter_mut().map(Memory::row).collect();
    if args.json {
        return output::json(&Report {
            query: "whole code of a stored position, shifted by 5 cm (sd) along each axis",
            seed: args.seed,
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
    cues: CueSource,
    damage: Damage,
    build_s: f64,
    load_s: f64,
    times_us: Vec<f64>,
    /// Positions of the latest round's queries.
    asked: Vec<Point3<f64>>,
    beyond_half_m: u64,
    agreed: usize,
}

impl Memory {
    /// A map of places all over a cube, at a density that does not depend on their number. They are
    /// recruited by the rule of novelty, so no two are closer than a field radius.
    fn of(places: u64, settings: Settings, seed: u64) -> anyhow::Result<Self> {
        let start = Instant::now();
        let map = survey(places, settings.clone(), seed)?;
        let build_s = start.elapsed().as_secs_f64();
        let pages: Vec<_> = map.checkpoint(0).collect();
        let start = Instant::now();
        let map = CognitiveMap::restore(settings, pages)?;
        Ok(Self {
            map,
            cues: CueSource::new(seed, 0),
            damage: Damage {
                jitter_m: JITTER_M,
                ..Damage::default()
            },
            build_s,
            load_s: start.elapsed().as_secs_f64(),
            times_us: Vec::new(),
            asked: Vec::new(),
            beyond_half_m: 0,
            agreed: 0,
        })
    }

    /// A query, and the position that its code is of.
    fn query(&mut self) -> DrawnCue {
        let drawn = self.cues.draw(&self.map, &self.damage);
        drawn.expect("there are places, and no module is erased")
    }

    /// Compares answers with those of a scan over all places.
    fn compare_with_scan(&mut self) {
        for _ in 0..SCANNED {
            let DrawnCue { cue, .. } = self.query();
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
        self.asked = queries.iter().map(|query| query.position).collect();
        for DrawnCue { cue, position } in queries {
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

    /// Writes where places and queries are.
    fn write(&self, directory: &Path) -> std::io::Result<()> {
        std::fs::create_dir_all(directory)?;
        let places = self.map.place_count();
        let write = |name: &str, positions: &mut dyn Iterator<Item = Point3<f64>>| {
            let file = File::create(directory.join(format!("{name}-{places}.csv")))?;
            let mut file = BufWriter::new(file);
            writeln!(file, "x_m,y_m,z_m")?;
            for at in positions {
                writeln!(file, "{},{},{}", at.x, at.y, at.z)?;
            }
            file.flush()
        };
        let positions = self.map.places().map(|(_, place)| *place.position());
        write("places", &mut { positions })?;
        write("queries", &mut self.asked.iter().copied())
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
