//! `cogmap-lab bench teach`.

use std::time::Instant;

use clap::Args;
use cogmap_lab::outlines::{Family, Levels, OutlineProtocol, Turn, drawn_lesson};
use cognitive_map::{CognitiveMap, IndexingJob, Label, Record, Settings};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use cogmap::cli::output;
use cogmap::cli::quantile;

#[derive(Debug, Args)]
pub(in crate::cli) struct TeachArgs {
    /// Numbers of contacts by which a box is taught.
    #[arg(long, value_delimiter = ',', default_values_t = [20, 60, 240, 1_000],
        value_parser = clap::value_parser!(u32).range(1..))]
    touches: Vec<u32>,
    /// Boxes at each number.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    objects: u32,
    /// Seed of boxes, contacts and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    seed: u64,
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    touches: u32,
    /// The record of a lesson: nothing else is applied meanwhile.
    pause_ms_p50: f64,
    pause_ms_max: f64,
    /// What recognition needs of the object, which a thread of a service computes beside.
    indexing_ms_p50: f64,
    indexing_ms_max: f64,
}

pub(super) fn run(args: &TeachArgs) -> anyhow::Result<()> {
    let mut rows = Vec::new();
    for &touches in &args.touches {
        output::progress(&format!("{} boxes by {touches} contacts", args.objects));
        rows.push(row(args, touches)?);
    }
    if args.json {
        let seed = args.seed;
        return output::json(&Report { seed, rows });
    }
    output::line("contacts   pause p50 [ms]   max [ms]   indexing p50 [ms]   max [ms]")?;
    for row in rows {
        output::line(&format!(
            "{:>8} {:>16.2} {:>10.2} {:>19.1} {:>10.1}",
            row.touches,
            row.pause_ms_p50,
            row.pause_ms_max,
            row.indexing_ms_p50,
            row.indexing_ms_max
        ))?;
    }
    Ok(())
}

fn row(args: &TeachArgs, touches: u32) -> anyhow::Result<Row> {
    let taught = touches as usize;
    let protocol = OutlineProtocol::new(Family::Box, Levels::Spread, Turn::None, taught);
    let random = &mut ChaCha8Rng::seed_from_u64(args.seed);
    let mut map = CognitiveMap::new(Settings::default());
    let (mut pauses_ms, mut indexing_ms) = (Vec::new(), Vec::new());
    for number in 0..args.objects {
        let record = Record::TeachObject {
            number: number.into(),
            name: Label::new(&format!("box-{number}"))?,
            lesson: drawn_lesson(&protocol, random)?,
        };
        pauses_ms.push(timed_ms(|| map.apply(&record, &mut Vec::new())));
        let job = map.indexing(None);
        indexing_ms.push(timed_ms(|| job.iter().for_each(IndexingJob::run)));
    }
    Ok(Row {
        touches,
        pause_ms_p50: quantile(&mut pauses_ms, 0.5),
        pause_ms_max: quantile(&mut pauses_ms, 1.0),
        indexing_ms_p50: quantile(&mut indexing_ms, 0.5),
        indexing_ms_max: quantile(&mut indexing_ms, 1.0),
    })
}

fn timed_ms(work: impl FnOnce()) -> f64 {
    let begin = Instant::now();
    work();
    begin.elapsed().as_secs_f64() * 1e3
}
