//! `cogmap-lab bench descriptors`.

use std::time::Instant;

use clap::Args;
use cogmap_worlds::{Eye, Scenery};
use cognitive_map::{
    AgentId, CognitiveMap, Descriptor, Label, Motion, PerceptCue, PlaceId, PoseNoise, RecallCue,
    Record, Sample, SampleBody, Settings, SettingsValues, StartPose,
};
use nalgebra::Vector3;
use serde::Serialize;

use cogmap::cli::output;
use cogmap::cli::quantile;

/// Distance of neighbouring places \[m\]: they stand on a cubic grid, as close as the rule of
/// novelty lets them with the field radius of a space's defaults, and see nearly the same.
const APART_M: f64 = 0.3;
const CHANNEL: &str = "view";

#[derive(Debug, Args)]
pub(in crate::cli) struct DescriptorsArgs {
    /// Numbers of places, each with what was seen there.
    #[arg(long, value_delimiter = ',', default_values_t = [1_000, 10_000, 100_000, 200_000],
        value_parser = clap::value_parser!(u32).range(1..))]
    places: Vec<u32>,
    /// Numbers of a descriptor.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u16).range(8..=4096))]
    dimension: u16,
    /// Length of a query's noise, as a share of the view's own.
    #[arg(long, default_value_t = 0.1, value_name = "SHARE")]
    noise: f64,
    /// Queries at each number.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    queries: u32,
    /// Seed of scenery and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    dimension: u16,
    noise: f64,
    seed: u64,
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    places: u32,
    us_p50: f64,
    us_p99: f64,
    /// The same questions put to every place.
    scan_us_p50: f64,
    /// Share of the queries whose answer is the scan's.
    recall_at_1: f64,
    /// Share of the ten best places of the scan that are among the ten best of the answer.
    recall_at_10: f64,
}

pub(super) fn run(args: &DescriptorsArgs) -> anyhow::Result<()> {
    let mut rows = Vec::new();
    for &places in &args.places {
        output::progress(&format!("building a map of {places} places"));
        let gallery = Gallery::new(args, places)?;
        output::progress(&format!("asking {} times, and scanning", args.queries));
        rows.push(gallery.row(args)?);
    }
    if args.json {
        return output::json(&Report {
            dimension: args.dimension,
            noise: args.noise,
            seed: args.seed,
            rows,
        });
    }
    output::line("   places   p50 [µs]   p99 [µs]   scan p50 [µs]   recall@1   recall@10")?;
    for row in rows {
        output::line(&format!(
            "{:>9} {:>10.1} {:>10.1} {:>15.1} {:>10.4} {:>11.4}",
            row.places, row.us_p50, row.us_p99, row.scan_us_p50, row.recall_at_1, row.recall_at_10,
        ))?;
    }
    Ok(())
}

/// A map of places that each remember a view.
struct Gallery {
    map: CognitiveMap,
    scenery: Scenery,
    places: u32,
}

impl Gallery {
    fn new(args: &DescriptorsArgs, places: u32) -> anyhow::Result<Self> {
        let scenery = Scenery::new(args.seed, args.dimension.into());
        let mut eye = Eye::new(scenery.clone(), 0.0, args.seed);
        let mut map = CognitiveMap::new(Settings::new(SettingsValues {
            places_max: u32::MAX,
            ..SettingsValues::default()
        })?);
        let (agent, mut seq) = (AgentId(0), 0);
        let mut events = Vec::new();
        let name = Label::new("surveyor")?;
        map.apply(&Record::Enrol { agent, name }, &mut events);
        let upright = [0.0, 0.0, 0.0, 1.0];
        let still = Motion::from_increment([0.0; 3], upright, None)?;
        for place in 0..places {
            let at_m = position_m(place, places);
            let put = StartPose::new(at_m.into(), upright, PoseNoise::none())?;
            let view = Descriptor::new(Label::new(CHANNEL)?, &eye.look(&at_m))?;
            for body in [
                SampleBody::StartPose(put),
                SampleBody::Motion(still),
                SampleBody::Descriptor(view),
            ] {
                let stamp_ns = i64::from(place);
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
        Ok(Self {
            map,
            scenery,
            places,
        })
    }

    fn row(&self, args: &DescriptorsArgs) -> anyhow::Result<Row> {
        let mut eye = Eye::new(self.scenery.clone(), args.noise, args.seed + 1);
        let (mut times_us, mut scan_times_us) = (Vec::new(), Vec::new());
        let (mut firsts, mut tens, mut tens_of) = (0, 0, 0);
        for query in 0..args.queries {
            // Evenly over the places, and a third of a step beside each along every axis.
            let place = u64::from(query) * u64::from(self.places) / u64::from(args.queries);
            let place = u32::try_from(place).unwrap_or(u32::MAX);
            let from_m = position_m(place, self.places) + Vector3::repeat(APART_M / 3.0);
            let view = Descriptor::new(Label::new(CHANNEL)?, &eye.look(&from_m))?;
            let cue = RecallCue {
                position: None,
                code: None,
                percept: Some(PerceptCue::Descriptor(view)),
                radius_m: None,
                founder: None,
                since_ns: None,
                until_ns: None,
                limit: 10,
            };
            // A filter that lets all pass is put to every place.
            let scan = RecallCue {
                since_ns: Some(i64::MIN),
                ..cue.clone()
            };
            let found = self.ask(&cue, &mut times_us);
            let exact = self.ask(&scan, &mut scan_times_us);
            firsts += u32::from(found.first() == exact.first());
            tens += exact.iter().filter(|place| found.contains(place)).count();
            tens_of += exact.len();
        }
        Ok(Row {
            places: self.places,
            us_p50: quantile(&mut times_us, 0.5),
            us_p99: quantile(&mut times_us, 0.99),
            scan_us_p50: quantile(&mut scan_times_us, 0.5),
            recall_at_1: f64::from(firsts) / f64::from(args.queries),
            recall_at_10: tens as f64 / tens_of as f64,
        })
    }

    /// Recalls, and notes how long it took.
    fn ask(&self, cue: &RecallCue, times_us: &mut Vec<f64>) -> Vec<PlaceId> {
        let start = Instant::now();
        let answer = self.map.recall(cue);
        times_us.push(start.elapsed().as_nanos() as f64 / 1e3);
        answer.iter().map(|recalled| recalled.place).collect()
    }
}

/// Where a place stands, of so many in a cube \[m\].
fn position_m(place: u32, places: u32) -> Vector3<f64> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a cube root of a count"
    )]
    let side = (f64::from(places).cbrt().ceil() as u32).max(1);
    let index = [place % side, place / side % side, place / side / side];
    Vector3::from(index.map(f64::from)) * APART_M
}
