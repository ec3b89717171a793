//! `cogmap-lab replay sequences`.

use std::collections::HashMap;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use cogmap::cli::{output, quantile};
use cogmap_client::Api;
use cogmap_lab::csv::{Choice, TableSet, Truth};
use cogmap_lab::eval::sequences::{Bin, Calibration};
use cogmap_proto::{
    Descriptor, PerceptCue, Sample, SampleBatch, SampleBody, SequenceElement, SequenceQuery,
    SpaceSettings,
};
use nalgebra::Vector3;
use serde::Serialize;

use crate::cli::eval::{Host, Progress};

const SPACE: &str = "sequences";
/// Samples of a message.
const BATCH: usize = 500;
/// What is told with this probability counts as a claim.
const CLAIM: f64 = 0.9;

#[derive(Debug, Args)]
pub(in crate::cli) struct SequencesArgs {
    /// Directory of a set with views, as `replay csv` reads it.
    directory: PathBuf,
    /// The agent whose way is remembered; the others are asked for.
    #[arg(long, value_name = "AGENT")]
    taught: String,
    /// Views of a question, one after the other.
    #[arg(long, default_value_t = 10, value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=64))]
    length: u32,
    /// An answer is right that is no farther off \[m\].
    #[arg(long, default_value_t = 30.0, value_name = "M", value_parser = distance_m)]
    within_m: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// A distance \[m\].
fn distance_m(text: &str) -> Result<f64, String> {
    let metres: f64 = text.parse().map_err(|_| "it is no number".to_owned())?;
    if metres.is_finite() && metres >= 0.0 {
        Ok(metres)
    } else {
        Err("a distance is finite, and not below zero".to_owned())
    }
}

#[derive(Debug, Serialize)]
struct Report {
    taught: String,
    length: u32,
    within_m: f64,
    rows: Vec<Row>,
}

/// What became of the questions of one agent.
#[derive(Debug, Serialize)]
struct Row {
    agent: String,
    questions: usize,
    /// Share of them whose likeliest answer was right.
    right: f64,
    /// Answers that were told with 0.9 or more, and the share of these that were right.
    claims: u32,
    claims_right: Option<f64>,
    ms_p50: f64,
    ms_p99: f64,
    /// By the probability of the likeliest answer.
    calibration: Vec<Bin>,
}

/// A view, and where it was seen.
struct View {
    percept: Descriptor,
    at: Vector3<f64>,
}

pub(super) fn run(args: &SequencesArgs) -> anyhow::Result<()> {
    let set = TableSet::load(&args.directory)?;
    let is_there = set.agents.contains_key(&args.taught);
    anyhow::ensure!(is_there, "the set has no agent {}", args.taught);
    let host = Host::start()?;
    let api = host.api();
    let places = teach(&api, &set, &args.taught)?;
    let mut report = Report {
        taught: args.taught.clone(),
        length: args.length,
        within_m: args.within_m,
        rows: Vec::new(),
    };
    for (name, log) in &set.agents {
        if let Some(truth) = log.truth.as_ref().filter(|_| *name != args.taught) {
            let views = views(&set, name, truth)?;
            let fewest = args.length as usize + 1;
            anyhow::ensure!(
                views.len() >= fewest,
                "{name} has fewer than {fewest} views"
            );
            report.rows.push(ask(&api, args, &places, (name, &views))?);
        }
    }
    drop(host);
    if args.json {
        return output::json(&report);
    }
    print(&report)
}

/// Sends what the taught agent recorded; answers where its places are.
fn teach(api: &Api, set: &TableSet, taught: &str) -> anyhow::Result<HashMap<u64, Vector3<f64>>> {
    api.create_space(SPACE, &SpaceSettings::default())?;
    let log = &set.agents[taught];
    let first_ns = log.rows.first().map_or(0, |row| row.stamp_ns);
    let truth = log
        .truth
        .as_ref()
        .context("the taught agent has no truth")?;
    let stream = set.stream(taught, truth.start(first_ns).as_ref(), &Choice::default())?;
    for (message, samples) in (0..).zip(stream.samples().chunks(BATCH)) {
        let batch = SampleBatch {
            session: 1,
            first_seq: message * BATCH as u64,
            samples: samples.to_vec(),
        };
        api.post_samples(SPACE, taught, &batch)?;
    }
    let places = api.places(SPACE)?.into_iter();
    Ok(places
        .map(|place| (place.id, place.translation_m.into()))
        .collect())
}

/// The views of an agent, in order of time.
fn views(set: &TableSet, agent: &str, truth: &Truth) -> anyhow::Result<Vec<View>> {
    let stream = set.stream(agent, None, &Choice::default())?;
    let view = |sample: &Sample| {
        let SampleBody::Descriptor(percept) = &sample.body else {
            return None;
        };
        let at = truth.at(sample.stamp_ns - TableSet::sent_ns(0))?;
        let percept = percept.clone();
        Some(View { percept, at })
    };
    Ok(stream.samples().iter().filter_map(view).collect())
}

/// Asks what comes next after every few views, and compares with where the next one was seen.
fn ask(
    api: &Api,
    args: &SequencesArgs,
    places: &HashMap<u64, Vector3<f64>>,
    (agent, views): (&str, &[View]),
) -> anyhow::Result<Row> {
    let length = args.length as usize;
    let questions = views.len().saturating_sub(length);
    let progress = Progress::new(questions as u64, "questions");
    let (mut right, mut claims, mut claims_right) = (0_u32, 0_u32, 0_u32);
    let mut calibration = Calibration::default();
    let mut ms = Vec::with_capacity(questions);
    for window in views.windows(length + 1) {
        let (cue, next) = window.split_at(length);
        let elements = { cue.iter() }
            .map(|view| SequenceElement::Percept(PerceptCue::Descriptor(view.percept.clone())));
        let query = SequenceQuery {
            cue: elements.collect(),
            error_rate: None,
            none_prior: None,
            limit: Some(1),
        };
        let start = Instant::now();
        let answer = api.sequence(SPACE, &query)?;
        ms.push(start.elapsed().as_secs_f64() * 1e3);
        progress.add(1);
        let Some(best) = answer.next.first() else {
            continue;
        };
        let place = { places.get(&best.place) }.context("a place is told that is not listed")?;
        let is_right = (place - next[0].at).norm() <= args.within_m;
        calibration.add(best.probability, is_right);
        right += u32::from(is_right);
        if best.probability >= CLAIM {
            claims += 1;
            claims_right += u32::from(is_right);
        }
    }
    progress.finish();
    Ok(Row {
        agent: agent.to_owned(),
        questions,
        right: f64::from(right) / questions.max(1) as f64,
        claims,
        claims_right: (claims > 0).then(|| f64::from(claims_right) / f64::from(claims)),
        ms_p50: quantile(&mut ms, 0.5),
        ms_p99: quantile(&mut ms, 0.99),
        calibration: calibration.bins(),
    })
}

fn print(report: &Report) -> anyhow::Result<()> {
    output::line(&format!(
        "{} views of each agent after {}'s; right is within {} m of where the next one was seen",
        report.length, report.taught, report.within_m
    ))?;
    for row in &report.rows {
        let claims_right = row
            .claims_right
            .map_or("none".to_owned(), |share| format!("{:.1} %", share * 100.0));
        output::line(&format!(
            "\n{}: {} questions, {:.1} % right; {} told with {CLAIM} or more, {claims_right} of \
            these right; p50 {:.2} ms, p99 {:.2} ms",
            row.agent,
            row.questions,
            row.right * 100.0,
            row.claims,
            row.ms_p50,
            row.ms_p99,
        ))?;
        output::line("probability        said    right       sd     count")?;
        for bin in &row.calibration {
            output::line(&format!(
                "{:.2} to {:.2} {:>10.3} {:>8.3} {:>8.3} {:>9}",
                bin.from, bin.to, bin.said, bin.came, bin.sd, bin.count
            ))?;
        }
    }
    Ok(())
}
