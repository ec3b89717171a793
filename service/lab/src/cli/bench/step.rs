//! `cogmap-lab bench step`.

use std::time::Instant;

use clap::Args;
use cognitive_map::{
    AgentId, CognitiveMap, Label, Motion, PoseNoise, Record, Sample, SampleBody, Settings,
    SettingsValues, StartPose,
};
use serde::Serialize;

use cogmap::cli::output;
use cogmap::cli::quantile;

/// Steps of one round at one size; rounds of all sizes alternate, so that the machine's moods hit
/// them alike.
const STEPS_OF_ROUND: u64 = 20_000;
/// A robot at 1 m/s, sampled at 100 Hz.
const STEP_M: f64 = 0.01;
const STEP_NS: i64 = 10_000_000;
/// Steps along one side of the square that is walked, well inside the places: 4 m.
const STEPS_OF_SIDE: u64 = 400;

#[derive(Debug, Args)]
pub(in crate::cli) struct StepArgs {
    /// Numbers of places.
    #[arg(long, value_delimiter = ',', default_values_t = [1_000, 10_000, 100_000, 1_000_000])]
    places: Vec<u64>,
    /// Rounds of 20,000 steps at each number.
    #[arg(long, default_value_t = 20)]
    rounds: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    places: u64,
    ns_p50: f64,
    ns_p99: f64,
}

pub(super) fn run(args: &StepArgs) -> anyhow::Result<()> {
    let mut walks = Vec::new();
    for &places in &args.places {
        output::progress(&format!("building a map of {places} places"));
        walks.push(Walk::among(places)?);
    }
    let mut times = vec![Vec::new(); walks.len()];
    for round in 0..args.rounds {
        output::progress(&format!("round {} of {}", round + 1, args.rounds));
        for (walk, times) in walks.iter_mut().zip(&mut times) {
            walk.round(times);
        }
    }
    let rows: Vec<_> = walks
        .iter()
        .zip(&mut times)
        .map(|(walk, times)| Row {
            places: walk.map.place_count() as u64,
            ns_p50: quantile(times, 0.5),
            ns_p99: quantile(times, 0.99),
        })
        .collect();
    if args.json {
        return output::json(&Report { rows });
    }
    output::line("   places     p50 [ns]     p99 [ns]")?;
    for Row {
        places,
        ns_p50,
        ns_p99,
    } in rows
    {
        output::line(&format!("{places:>9} {ns_p50:>12.0} {ns_p99:>12.0}"))?;
    }
    Ok(())
}

/// An agent that walks among places.
struct Walk {
    map: CognitiveMap,
    seq: u64,
    /// Steps on the present side of the square.
    on_side: u64,
}

impl Walk {
    /// A map whose places were recruited by driving along rows, so that it is what a robot would
    /// have made: a square with a place about every field radius.
    fn among(places: u64) -> anyhow::Result<Self> {
        let settings = Settings::new(SettingsValues {
            places_max: u32::MAX,
            ..SettingsValues::default()
        })?;
        let spacing_m = 1.2 * settings.field_radius_m;
        let mut walk = Self {
            map: CognitiveMap::new(settings),
            seq: 0,
            on_side: 0,
        };
        let name = Label::new("walker")?;
        walk.map.apply(
            &Record::Enrol {
                agent: AgentId(0),
                name,
            },
            &mut Vec::new(),
        );
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the root of a count is a count"
        )]
        let side = (places as f64).sqrt().ceil() as u64;
        let upright = [0.0, 0.0, 0.0, 1.0];
        let mut row = 0_u64;
        while (walk.map.place_count() as u64) < places {
            let start = [0.0, row as f64 * spacing_m, 0.0];
            let start = StartPose::new(start, upright, PoseNoise::none())?;
            walk.apply(SampleBody::StartPose(start));
            let along = Motion::from_increment([spacing_m, 0.0, 0.0], upright, None)?;
            for _ in 0..side {
                if (walk.map.place_count() as u64) < places {
                    walk.apply(SampleBody::Motion(along));
                }
            }
            row += 1;
        }
        let middle = side as f64 * spacing_m / 2.0;
        let start = StartPose::new([middle, middle, 0.0], upright, PoseNoise::none())?;
        walk.apply(SampleBody::StartPose(start));
        Ok(walk)
    }

    /// Drives around the square and notes the time of each step \[ns\].
    fn round(&mut self, times: &mut Vec<f64>) {
        let rotation = |turn_rad: f64| {
            let half = turn_rad / 2.0;
            [0.0, 0.0, half.sin(), half.cos()]
        };
        let step = |turn_rad| {
            Motion::from_increment([STEP_M, 0.0, 0.0], rotation(turn_rad), None)
                .expect("a step is a valid motion")
        };
        let (straight, corner) = (step(0.0), step(std::f64::consts::FRAC_PI_2));
        for _ in 0..STEPS_OF_ROUND {
            self.on_side = (self.on_side + 1) % STEPS_OF_SIDE;
            let motion = if self.on_side == 0 { corner } else { straight };
            times.push(self.apply(SampleBody::Motion(motion)));
        }
    }

    /// Applies a sample and returns how long that took \[ns\].
    fn apply(&mut self, body: SampleBody) -> f64 {
        let stamp_ns = i64::try_from(self.seq)
            .unwrap_or(i64::MAX)
            .saturating_mul(STEP_NS);
        let sample = Sample { stamp_ns, body };
        let record = Record::Sample {
            agent: AgentId(0),
            session: 1,
            seq: self.seq,
            sample,
        };
        self.seq += 1;
        let mut events = Vec::new();
        let start = Instant::now();
        self.map.apply(&record, &mut events);
        start.elapsed().as_nanos() as f64
    }
}
