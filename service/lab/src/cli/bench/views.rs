//! `cogmap-lab bench views`.

use std::hint::black_box;
use std::thread::{self, Builder};
use std::time::Instant;

use clap::Args;
use cogmap_worlds::{Eye, Scenery};
use cognitive_map::{
    Agent, AgentId, CognitiveMap, Descriptor, Label, Motion, PoseNoise, Record, Sample, SampleBody,
    Settings, SettingsValues, StartPose,
};
use nalgebra::Vector3;
use serde::Serialize;

use cogmap::cli::output;
use cogmap::cli::quantile;

const CHANNEL: &str = "view";
/// Views between two corners of the square that a robot goes round.
const EDGE: u32 = 10;
/// So many views fill rows enough for the square of a robot, and some more.
const VIEWS_MIN: i64 = 200;
const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

#[derive(Debug, Args)]
pub(in crate::cli) struct ViewsArgs {
    /// Numbers of views that a surveyor has taken, along rows that fill a square.
    #[arg(long, value_delimiter = ',', default_values_t = [1_000, 20_000],
        value_parser = clap::value_parser!(u32).range(VIEWS_MIN..))]
    views: Vec<u32>,
    /// Way between two views \[m\].
    #[arg(long, default_value_t = 1.0, value_name = "M")]
    apart_m: f64,
    /// Two views are alike within this distance \[m\]: there their cosine is 0.6.
    #[arg(long, default_value_t = 3.0, value_name = "M")]
    length_m: f64,
    /// Numbers of a view.
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u16).range(8..=4096))]
    dimension: u16,
    /// Length of a view's noise, as a share of the view's own.
    #[arg(long, default_value_t = 0.3, value_name = "SHARE")]
    noise: f64,
    /// Robots that go on in the map, and as many that wake up in it.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    robots: u32,
    /// Views of each of them.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
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
    apart_m: f64,
    length_m: f64,
    noise: f64,
    seed: u64,
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    views: u32,
    /// What the map does with a view of the surveyor, while it grows.
    surveying: Times,
    /// What the map does with a view of a robot that knows where it is.
    placed: Times,
    /// The same of a robot that does not, until it is found.
    lost: Times,
    /// Scalar products of a view with as many others, one behind the other.
    scan_us_p50: f64,
    /// Robots that woke up and were found.
    found: u32,
    /// What was learned while the surveyor went, which a service does on a thread of its own \[s\].
    learning_s: f64,
}

#[derive(Debug, Serialize)]
struct Times {
    /// Views that were timed.
    count: usize,
    us_p50: f64,
    us_p99: f64,
}

pub(super) fn run(args: &ViewsArgs) -> anyhow::Result<()> {
    let mut rows = Vec::new();
    for &views in &args.views {
        output::progress(&format!("taking {views} views"));
        let survey = Survey::new(args, views)?;
        rows.push(survey.row(args)?);
    }
    if args.json {
        return output::json(&Report {
            dimension: args.dimension,
            apart_m: args.apart_m,
            length_m: args.length_m,
            noise: args.noise,
            seed: args.seed,
            rows,
        });
    }
    output::line(
        "    views   survey p50 [µs]   p99 [µs]   placed p50 [µs]   p99 [µs]   lost p50 [µs]   p99 [µs]\
        \u{20}  scan p50 [µs]   found   learning [s]",
    )?;
    for row in rows {
        output::line(&format!(
            "{:>9} {:>17.1} {:>10.1} {:>17.1} {:>10.1} {:>15.1} {:>10.1} {:>15.1} {:>7} {:>14.1}",
            row.views,
            row.surveying.us_p50,
            row.surveying.us_p99,
            row.placed.us_p50,
            row.placed.us_p99,
            row.lost.us_p50,
            row.lost.us_p99,
            row.scan_us_p50,
            row.found,
            row.learning_s,
        ))?;
    }
    Ok(())
}

/// A map of a floor that somebody has walked along.
#[derive(Clone)]
struct Survey {
    map: CognitiveMap,
    eye: Eye,
    length_m: f64,
    apart_m: f64,
    /// Views along a side of the square.
    side: u32,
    views: u32,
    agents: u32,
    stamp_ns: i64,
    /// Times of the surveyor's views \[µs\].
    surveying_us: Vec<f64>,
    learning_s: f64,
}

/// Somebody who walks.
struct Walker {
    agent: AgentId,
    seq: u64,
    at_m: Vector3<f64>,
}

impl Survey {
    fn new(args: &ViewsArgs, views: u32) -> anyhow::Result<Self> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the root of a count"
        )]
        let side = (f64::from(views).sqrt().ceil() as u32).max(1);
        let settings = Settings::new(SettingsValues {
            places_max: u32::MAX,
            ..SettingsValues::default()
        })?;
        let scenery = Scenery::new(args.seed, args.dimension.into());
        let mut survey = Self {
            map: CognitiveMap::new(settings),
            eye: Eye::new(scenery, args.noise, args.seed),
            length_m: args.length_m,
            apart_m: args.apart_m,
            side,
            views,
            agents: 0,
            stamp_ns: 0,
            surveying_us: Vec::new(),
            learning_s: 0.0,
        };
        let mut surveyor = survey.walker(Vector3::zeros())?;
        survey.put(&mut surveyor)?;
        for number in 0..views {
            // Row by row, there and back.
            let (row, column) = (number / side, number % side);
            let column = if row % 2 == 0 {
                column
            } else {
                side - 1 - column
            };
            let to_m = Vector3::new(f64::from(column), f64::from(row), 0.0) * args.apart_m;
            let us = survey.step(&mut surveyor, &to_m)?;
            survey.surveying_us.push(us);
        }
        Ok(survey)
    }

    /// Every robot goes on a clone of the map: its views are in nobody else's.
    fn row(&self, args: &ViewsArgs) -> anyhow::Result<Row> {
        let (mut placed_us, mut lost_us) = (Vec::new(), Vec::new());
        let mut found = 0;
        for number in 0..args.robots {
            output::progress(&format!("robot {} of {}", number + 1, args.robots));
            let start_m = self.start_m(number, args.robots);
            let mut own = self.seen_anew(args, number);
            let mut robot = own.walker(start_m)?;
            own.put(&mut robot)?;
            for step in 0..args.steps {
                let to_m = robot.at_m + self.step_m(step);
                placed_us.push(own.step(&mut robot, &to_m)?);
            }
            let mut own = self.seen_anew(args, number);
            let mut robot = own.walker(start_m)?;
            for step in 0..args.steps {
                let to_m = robot.at_m + self.step_m(step);
                lost_us.push(own.step(&mut robot, &to_m)?);
                if own.map.agent(robot.agent).is_some_and(Agent::placed) {
                    found += 1;
                    break;
                }
            }
        }
        Ok(Row {
            views: self.views,
            surveying: Times::of(&mut self.surveying_us.clone()),
            placed: Times::of(&mut placed_us),
            lost: Times::of(&mut lost_us),
            scan_us_p50: self.clone().scan(args),
            found,
            learning_s: self.learning_s,
        })
    }

    /// A clone for a robot, which sees noise of its own.
    fn seen_anew(&self, args: &ViewsArgs, number: u32) -> Self {
        let scenery = Scenery::new(args.seed, args.dimension.into());
        let seed = args.seed.wrapping_add(1).wrapping_add(number.into());
        Self {
            eye: Eye::new(scenery, args.noise, seed),
            ..self.clone()
        }
    }

    /// Where one of some robots begins: spread along the diagonal, beside the rows, and no nearer
    /// to the end of the full rows than it will go \[m\].
    fn start_m(&self, number: u32, robots: u32) -> Vector3<f64> {
        const BESIDE: f64 = 0.3;
        let rows = self.views / self.side;
        let share = (f64::from(number) + 0.5) / f64::from(robots);
        let at = BESIDE + share * (f64::from(rows - 1 - EDGE) - BESIDE);
        Vector3::new(at, at, 0.0) * self.apart_m
    }

    /// A step of a robot, which goes round a square \[m\].
    fn step_m(&self, step: u32) -> Vector3<f64> {
        let axis = [Vector3::x(), Vector3::y(), -Vector3::x(), -Vector3::y()];
        axis[(step / EDGE % 4) as usize] * self.apart_m
    }

    fn walker(&mut self, at_m: Vector3<f64>) -> anyhow::Result<Walker> {
        let agent = AgentId(self.agents);
        self.agents += 1;
        let name = Label::new(&format!("robot{}", agent.0))?;
        let enrol = Record::Enrol { agent, name };
        self.map.apply(&enrol, &mut Vec::new());
        Ok(Walker {
            agent,
            seq: 0,
            at_m,
        })
    }

    /// Tells a walker where it is.
    fn put(&mut self, walker: &mut Walker) -> anyhow::Result<()> {
        let put = StartPose::new(walker.at_m.into(), UPRIGHT, PoseNoise::none())?;
        self.apply(walker, SampleBody::StartPose(put));
        Ok(())
    }

    /// A walker goes somewhere, and sees what is there; answers how long the view took to be taken
    /// in \[µs\].
    fn step(&mut self, walker: &mut Walker, to_m: &Vector3<f64>) -> anyhow::Result<f64> {
        let by_m = to_m - walker.at_m;
        walker.at_m = *to_m;
        let motion = Motion::from_increment(by_m.into(), UPRIGHT, Some(PoseNoise::none()))?;
        self.apply(walker, SampleBody::Motion(motion));
        let seen = self.eye.look(&(to_m / self.length_m));
        let view = Descriptor::new(Label::new(CHANNEL)?, &seen)?;
        Ok(self.apply(walker, SampleBody::Descriptor(view)))
    }

    /// Takes in a sample, a tenth of a second after the one before; answers how long it took
    /// \[µs\], without what a thread of a service learns beside its writer.
    fn apply(&mut self, walker: &mut Walker, body: SampleBody) -> f64 {
        self.stamp_ns += 100_000_000;
        let stamp_ns = self.stamp_ns;
        let record = Record::Sample {
            agent: walker.agent,
            session: 1,
            seq: walker.seq,
            sample: Sample { stamp_ns, body },
        };
        walker.seq += 1;
        if let Some(job) = self.map.relaxation().filter(|job| !job.is_done()) {
            let start = Instant::now();
            let relaxer = Builder::new().name("relaxer".into());
            thread::scope(|scope| {
                relaxer
                    .spawn_scoped(scope, || job.run())
                    .expect("the system can start a thread");
            });
            self.learning_s += start.elapsed().as_secs_f64();
        }
        let mut events = Vec::new();
        let start = Instant::now();
        self.map.apply(&record, &mut events);
        start.elapsed().as_nanos() as f64 / 1e3
    }

    /// Median time of the yardstick \[µs\].
    fn scan(&mut self, args: &ViewsArgs) -> f64 {
        let length = usize::from(args.dimension);
        let view = self.eye.look(&Vector3::zeros());
        let all: Vec<f32> = { view.iter().cycle() }
            .take(length * self.views as usize)
            .copied()
            .collect();
        let mut times_us: Vec<f64> = (0..21)
            .map(|_| {
                let start = Instant::now();
                for other in all.chunks_exact(length) {
                    black_box(product(other, &view));
                }
                start.elapsed().as_nanos() as f64 / 1e3
            })
            .collect();
        quantile(&mut times_us, 0.5)
    }
}

/// Scalar product of two views, in sums side by side that fill vector registers.
fn product(a: &[f32], b: &[f32]) -> f32 {
    let (a, a_rest) = a.as_chunks::<16>();
    let (b, b_rest) = b.as_chunks::<16>();
    let mut sums = [0.0; 16];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..16 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + rest
}

impl Times {
    fn of(times_us: &mut [f64]) -> Self {
        Self {
            count: times_us.len(),
            us_p50: quantile(times_us, 0.5),
            us_p99: quantile(times_us, 0.99),
        }
    }
}
