//! The hidden publisher of the benchmarks: a process of its own, as robots are.

use std::time::{Duration, Instant};

use anyhow::Context;
use clap::{Args, ValueEnum};
use cogmap_client::{Robot, RobotSettings, open_session};
use cogmap_proto::{Codec, Sample, SampleBatch, SampleBody, Velocity, samples_key};
use zenoh::Wait;
use zenoh::qos::CongestionControl;

use cogmap::cli::output;

/// Longest wait for the service.
const TIMEOUT: Duration = Duration::from_secs(20);

#[derive(Debug, Args)]
pub(in crate::cli) struct LoadArgs {
    #[arg(long)]
    connect: String,
    #[arg(long)]
    space: String,
    #[arg(long)]
    agent: String,
    #[arg(long)]
    samples_per_message: usize,
    #[arg(long)]
    seconds: f64,
    /// Most messages a second; as many as possible when absent.
    #[arg(long)]
    rate: Option<f64>,
    #[arg(long, value_enum)]
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Kind {
    /// As a robot does, through the client that sends again what is lost.
    Robot,
    /// The same messages, put as fast as Zenoh takes them.
    Raw,
}

pub(super) fn run(args: &LoadArgs) -> anyhow::Result<()> {
    match args.kind {
        Kind::Robot => robot(args),
        Kind::Raw => raw(args),
    }
}

/// A robot that drives a wide circle at 1 m/s, sampled at 1 kHz.
fn samples(first_seq: u64, count: usize) -> Vec<Sample> {
    let velocity = Velocity {
        linear_m_s: [1.0, 0.0, 0.0],
        angular_rad_s: [0.0, 0.0, 0.1],
        duration_s: 0.001,
        noise: None,
    };
    (first_seq..)
        .take(count)
        .map(|seq| Sample {
            stamp_ns: i64::try_from(seq)
                .unwrap_or(i64::MAX)
                .saturating_mul(1_000_000),
            body: SampleBody::Velocity(velocity.clone()),
        })
        .collect()
}

fn robot(args: &LoadArgs) -> anyhow::Result<()> {
    let settings = RobotSettings {
        session: Some(1),
        batch_samples: args.samples_per_message,
        batch_delay: Duration::from_secs(1),
        // What arrives is counted against what was published.
        ends_session: false,
        send_timeout: TIMEOUT,
        ..RobotSettings::default()
    };
    let robot = Robot::builder(&args.space, &args.agent)
        .endpoint(&args.connect)
        .settings(settings)
        .connect()?;
    let mut pace = Pace::new(args);
    let mut seq = 0;
    // Batches are handed over many at a time, as a driver does that reads a buffered sensor.
    let count = args.samples_per_message * pace.messages_at_once();
    while pace.next() {
        robot.send_batch(samples(seq, count))?;
        seq += count as u64;
    }
    robot.flush(TIMEOUT)?;
    let counters = robot.counters();
    robot.close(TIMEOUT)?;
    output::progress(&format!("published {seq} samples, {counters:?}"));
    Ok(())
}

/// A key that no service listens to.
pub(super) fn raw_key(space: &str, agent: &str) -> String {
    format!("raw/{}", samples_key(space, agent))
}

fn raw(args: &LoadArgs) -> anyhow::Result<()> {
    let session = open_session(&[&args.connect], TIMEOUT)?;
    let publisher = session
        .declare_publisher(raw_key(&args.space, &args.agent))
        .encoding(Codec::Postcard.encoding())
        .congestion_control(CongestionControl::Block)
        .wait()
        .map_err(anyhow::Error::from_boxed)
        .context("declare")?;
    let deadline = Instant::now() + TIMEOUT;
    while !publisher
        .matching_status()
        .wait()
        .map_err(anyhow::Error::from_boxed)?
        .matching()
    {
        anyhow::ensure!(Instant::now() < deadline, "nobody subscribes");
        std::thread::sleep(Duration::from_millis(10));
    }
    let mut pace = Pace::new(args);
    let mut seq = 0;
    while pace.next() {
        for _ in 0..pace.messages_at_once() {
            let samples = samples(seq, args.samples_per_message);
            let message = SampleBatch {
                session: 1,
                first_seq: seq,
                samples,
            };
            seq += args.samples_per_message as u64;
            publisher
                .put(Codec::Postcard.encode(&message))
                .wait()
                .map_err(anyhow::Error::from_boxed)?;
        }
    }
    session.close().wait().map_err(anyhow::Error::from_boxed)
}

/// How fast and how long.
struct Pace {
    end: Instant,
    start: Instant,
    rounds: u64,
    rate: Option<f64>,
    at_once: usize,
}

impl Pace {
    fn new(args: &LoadArgs) -> Self {
        let start = Instant::now();
        let end = start + Duration::from_secs_f64(args.seconds);
        let at_once = if args.rate.is_some() {
            1
        } else {
            (1024 / args.samples_per_message).max(1)
        };
        Self {
            end,
            start,
            rounds: 0,
            rate: args.rate,
            at_once,
        }
    }

    fn messages_at_once(&self) -> usize {
        self.at_once
    }

    /// Waits for the next round's time; false when the time is over.
    fn next(&mut self) -> bool {
        if let Some(rate) = self.rate {
            let due = self.start + Duration::from_secs_f64(self.rounds as f64 / rate);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        self.rounds += 1;
        Instant::now() < self.end
    }
}
