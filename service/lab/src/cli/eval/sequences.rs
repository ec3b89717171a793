//! `cogmap-lab eval sequences`.

use std::time::Instant;

use anyhow::Context;
use clap::Args;
use cogmap_client::Api;
use cogmap_lab::eval::sequences::{Bin, Calibration, Cue, Cues, SequenceProtocol, walks};
use cogmap_proto::{
    Increment, Marker, Sample, SampleBatch, SampleBody, SequenceElement, SequenceQuery, StartPose,
};
use serde::Serialize;

use super::progress::Progress;
use super::service::Host;
use cogmap::cli::output;
use cogmap::cli::quantile;

/// Distance of neighbouring places \[m\]: beyond the radius of a field.
const SPACING_M: f64 = 1.0;
/// Time from place to place \[ns\].
const STEP_NS: i64 = 1_000_000_000;
/// Samples of a message.
const BATCH: usize = 500;
const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
const SPACE: &str = "sequences";
const AGENT: &str = "walker";

#[derive(Debug, Args)]
pub(in crate::cli) struct SequencesArgs {
    /// Places along an edge of the lattice.
    #[arg(long, default_value_t = SequenceProtocol::default().edge, value_name = "N",
        value_parser = clap::value_parser!(u32).range(2..1000))]
    edge: u32,
    /// Trips.
    #[arg(long, default_value_t = SequenceProtocol::default().trips, value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..))]
    trips: u32,
    /// Legs of each trip.
    #[arg(long, default_value_t = SequenceProtocol::default().legs, value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..1000))]
    legs: u32,
    /// Cues of each length.
    #[arg(long, default_value_t = SequenceProtocol::default().cues, value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..))]
    cues: u32,
    /// Places of a cue.
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2, 3, 5], value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=64))]
    lengths: Vec<u32>,
    /// Share of a cue's places that are wrong; the service is told.
    #[arg(long, default_value_t = SequenceProtocol::default().error_rate, value_name = "SHARE")]
    noise: f64,
    /// Share of cues that nobody travelled; the service is told.
    #[arg(long, default_value_t = SequenceProtocol::default().none, value_name = "SHARE")]
    none: f64,
    /// Seed of trips and cues.
    #[arg(long, default_value_t = SequenceProtocol::default().seed)]
    seed: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    places: usize,
    legs: usize,
    seed: u64,
    rows: Vec<Row>,
}

/// What became of the cues of one length.
#[derive(Debug, Serialize)]
struct Row {
    length: u32,
    cues: u32,
    /// Cues that leave one continuation only.
    unique: u32,
    /// The share of these whose likeliest continuation, or none, was the right one.
    unique_right: f64,
    /// The same of the others.
    other_right: f64,
    /// Largest distance of a sum of probabilities from 1.
    sum_off: f64,
    ms_p50: f64,
    ms_p99: f64,
    /// Expected calibration error, of all that was said, and by size.
    calibration_error: f64,
    calibration: Vec<Bin>,
}

pub(super) fn run(args: &SequencesArgs) -> anyhow::Result<()> {
    let protocol = |length| SequenceProtocol {
        edge: args.edge,
        trips: args.trips,
        legs: args.legs,
        cues: args.cues,
        length,
        error_rate: args.noise,
        none: args.none,
        seed: args.seed,
    };
    anyhow::ensure!(
        (0.001..=0.5).contains(&args.noise),
        "--noise is 0.001 to 0.5"
    );
    anyhow::ensure!(
        (0.001..=0.999).contains(&args.none),
        "--none is 0.001 to 0.999"
    );
    let host = Host::start()?;
    let api = host.api();
    output::progress("sending the trips");
    let trips = travel(&api, &protocol(1))?;
    let mut report = Report {
        places: 0,
        legs: trips.iter().map(|trip| trip.len() - 1).sum(),
        seed: args.seed,
        rows: Vec::new(),
    };
    for &length in &args.lengths {
        let protocol = protocol(length);
        let mut cues = Cues::new(&protocol, &trips);
        report.places = cues.n_places();
        let progress = Progress::new(protocol.cues.into(), "cues");
        let mut tally = Tally::default();
        for _ in 0..protocol.cues {
            tally.ask(&api, &protocol, &cues.draw())?;
            progress.add(1);
        }
        progress.finish();
        report.rows.push(tally.row(&protocol));
    }
    drop(host);
    if args.json {
        return output::json(&report);
    }
    print(&report)
}

/// Sends the trips, and reads the places that they led through.
fn travel(api: &Api, protocol: &SequenceProtocol) -> anyhow::Result<Vec<Vec<u64>>> {
    api.create_space(SPACE, &cogmap_proto::SpaceSettings::default())?;
    let mut bodies = Vec::new();
    for walk in walks(protocol) {
        let position = |at: [i32; 2]| at.map(|along| f64::from(along) * SPACING_M);
        let mut at = position(walk[0]);
        bodies.push(SampleBody::StartPose(StartPose {
            translation_m: [at[0], at[1], 0.0],
            rotation_xyzw: UPRIGHT,
            noise: None,
        }));
        bodies.push(moved([0.0; 3]));
        for to in walk[1..].iter().map(|to| position(*to)) {
            bodies.push(moved([to[0] - at[0], to[1] - at[1], 0.0]));
            at = to;
        }
        bodies.push(SampleBody::Marker(Marker {
            label: "done".to_owned(),
            ends_trip: true,
        }));
    }
    let stamped = (0..).step_by(usize::try_from(STEP_NS)?).zip(bodies);
    let samples: Vec<_> = stamped
        .map(|(stamp_ns, body)| Sample { stamp_ns, body })
        .collect();
    for (message, samples) in (0..).zip(samples.chunks(BATCH)) {
        let batch = SampleBatch {
            session: 1,
            first_seq: message * BATCH as u64,
            samples: samples.to_vec(),
        };
        api.post_samples(SPACE, AGENT, &batch)?;
    }
    let trips = api.trips(SPACE)?;
    let detail = |id| {
        api.trip(SPACE, id)
            .with_context(|| format!("read trip {id}"))
    };
    let trips = trips.iter().map(|trip| {
        let legs = detail(trip.id)?.legs;
        let first = legs.first().map(|leg| leg.from);
        Ok(first
            .into_iter()
            .chain(legs.iter().map(|leg| leg.to))
            .collect())
    });
    trips.collect()
}

fn moved(translation_m: [f64; 3]) -> SampleBody {
    SampleBody::Increment(Increment {
        translation_m,
        rotation_xyzw: UPRIGHT,
        noise: None,
    })
}

/// What became of cues.
#[derive(Default)]
struct Tally {
    unique: (u32, u32),
    other: (u32, u32),
    sum_off: f64,
    ms: Vec<f64>,
    calibration: Calibration,
}

impl Tally {
    fn ask(&mut self, api: &Api, protocol: &SequenceProtocol, cue: &Cue) -> anyhow::Result<()> {
        let query = SequenceQuery {
            cue: cue
                .places
                .iter()
                .map(|place| SequenceElement::Place(*place))
                .collect(),
            error_rate: Some(protocol.error_rate),
            none_prior: Some(protocol.none),
            limit: Some(1000),
        };
        let start = Instant::now();
        let answer = api.sequence(SPACE, &query)?;
        self.ms.push(start.elapsed().as_secs_f64() * 1e3);
        let best = answer
            .next
            .first()
            .filter(|next| next.probability > answer.none);
        let is_right = best.map(|next| next.place) == cue.next;
        let count = if cue.is_unique {
            &mut self.unique
        } else {
            &mut self.other
        };
        *count = (count.0 + 1, count.1 + u32::from(is_right));
        for next in &answer.next {
            self.calibration
                .add(next.probability, cue.next == Some(next.place));
        }
        // It is right where nothing that was told comes next.
        let is_told = |place| answer.next.iter().any(|next| next.place == place);
        let is_none = cue.next.is_none_or(|place| !is_told(place));
        self.calibration.add(answer.none, is_none);
        let sum: f64 = answer.next.iter().map(|next| next.probability).sum();
        let off = (sum + answer.others + answer.none - 1.0).abs();
        self.sum_off = self.sum_off.max(off);
        Ok(())
    }

    fn row(mut self, protocol: &SequenceProtocol) -> Row {
        let share = |(all, right): (u32, u32)| f64::from(right) / f64::from(all.max(1));
        Row {
            length: protocol.length,
            cues: protocol.cues,
            unique: self.unique.0,
            unique_right: share(self.unique),
            other_right: share(self.other),
            sum_off: self.sum_off,
            ms_p50: quantile(&mut self.ms, 0.5),
            ms_p99: quantile(&mut self.ms, 0.99),
            calibration_error: self.calibration.error(),
            calibration: self.calibration.bins(),
        }
    }
}

fn print(report: &Report) -> anyhow::Result<()> {
    output::line(&format!("{} places, {} legs", report.places, report.legs))?;
    for row in &report.rows {
        output::line(&format!(
            "\ncues of {}: {} of {} unique, of these {:.2} % right; of others {:.2} %; p50 {:.2} \
            ms, p99 {:.2} ms; sums off by {:.0e} at most",
            row.length,
            row.unique,
            row.cues,
            row.unique_right * 100.0,
            row.other_right * 100.0,
            row.ms_p50,
            row.ms_p99,
            row.sum_off,
        ))?;
        output::line("probability        said     came       sd     count")?;
        for bin in &row.calibration {
            output::line(&format!(
                "{:.2} to {:.2} {:>10.4} {:>8.4} {:>8.4} {:>9}",
                bin.from, bin.to, bin.said, bin.came, bin.sd, bin.count
            ))?;
        }
        output::line(&format!("calibration error {:.4}", row.calibration_error))?;
    }
    Ok(())
}
