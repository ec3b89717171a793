//! `cogmap-lab bench life`.

use std::time::{Duration, Instant};

use clap::Args;
use cogmap::cli::output;
use cogmap::metrics::resident_bytes;
use cogmap_worlds::{ObstacleWorld, Sensor, Team, TeamSettings, robot_name};
use cognitive_map::{AgentId, CognitiveMap, Label, Record, Sample, Settings};
use serde::Serialize;

/// Parts of the run, a row each.
const PARTS: u32 = 10;

#[derive(Debug, Args)]
pub(in crate::cli) struct LifeArgs {
    /// Ticks of 0.1 s. Robots walk in a room with beacons and see these and one another.
    #[arg(long, default_value_t = 150_000, value_name = "N")]
    ticks: u32,
    /// Robots.
    #[arg(long, default_value_t = 3, value_name = "N")]
    robots: u32,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    rows: Vec<Row>,
}

/// A tenth of the run.
#[derive(Debug, Serialize)]
struct Row {
    /// So far.
    samples: u64,
    /// Of the process; 0 where the machine does not tell.
    memory_mb: f64,
    us_mean: f64,
    us_p99: f64,
    us_max: f64,
    places: usize,
    /// Of the robot that is farthest off.
    error_m: f64,
}

/// The team, the map that it makes, and its samples.
struct Life {
    team: Team,
    map: CognitiveMap,
    seqs: Vec<u64>,
    samples: u64,
}

pub(super) fn run(args: &LifeArgs) -> anyhow::Result<()> {
    let mut life = Life::new(args.robots)?;
    let part = (args.ticks / PARTS).max(1);
    let mut rows = Vec::new();
    let mut times = Vec::new();
    for tick in 1..=args.ticks {
        let error_m = life.tick(&mut times)?;
        if tick % part == 0 {
            output::progress(&format!("tick {tick} of {}", args.ticks));
            let [us_mean, us_p99, us_max] = times_us(&mut times);
            rows.push(Row {
                samples: life.samples,
                memory_mb: resident_bytes().unwrap_or(0) as f64 / 1e6,
                us_mean,
                us_p99,
                us_max,
                places: life.map.place_count(),
                error_m,
            });
            times.clear();
        }
    }
    if args.json {
        return output::json(&Report { rows });
    }
    output::line("  samples  memory [MB]  mean, 99 %, longest [us]  places  error [m]")?;
    for row in &rows {
        output::line(&format!(
            "{:9}  {:11.1}  {:5.1} {:6.1} {:9.1}     {:6}  {:.3}",
            row.samples,
            row.memory_mb,
            row.us_mean,
            row.us_p99,
            row.us_max,
            row.places,
            row.error_m
        ))?;
    }
    Ok(())
}

impl Life {
    fn new(n_robots: u32) -> anyhow::Result<Self> {
        let settings = TeamSettings {
            seed: 1,
            n_robots,
            robot_sensor: Some(Sensor::default()),
            ..TeamSettings::default()
        };
        let mut map = CognitiveMap::new(Settings::default());
        for robot in 1..=n_robots {
            let record = Record::Enrol {
                agent: AgentId(robot - 1),
                name: Label::new(&robot_name(robot))?,
            };
            map.apply(&record, &mut Vec::new());
        }
        Ok(Self {
            team: Team::new(ObstacleWorld::new(1), settings)?,
            map,
            seqs: vec![0; n_robots as usize],
            samples: 0,
        })
    }

    /// Applies what the team does in a tick, and answers how far the worst robot is off \[m\].
    fn tick(&mut self, times: &mut Vec<Duration>) -> anyhow::Result<f64> {
        let mut events = Vec::new();
        let mut error_m: f64 = 0.0;
        for robot in self.team.tick() {
            let agent = AgentId(robot.robot - 1);
            let seq = &mut self.seqs[agent.0 as usize];
            for reading in &robot.readings {
                let record = Record::Sample {
                    agent,
                    session: 1,
                    seq: *seq,
                    sample: Sample::try_from(reading)?,
                };
                *seq += 1;
                self.samples += 1;
                let begin = Instant::now();
                self.map.apply(&record, &mut events);
                times.push(begin.elapsed());
                events.clear();
            }
            if let Some(known) = self.map.agent(agent) {
                let off = known.pose().translation.vector - robot.truth.pose.translation.vector;
                error_m = error_m.max(off.norm());
            }
        }
        Ok(error_m)
    }
}

/// The mean, the 99th percentile and the longest of times \[µs\].
fn times_us(times: &mut [Duration]) -> [f64; 3] {
    times.sort_unstable();
    let sum: Duration = times.iter().sum();
    let us = |time: Duration| time.as_secs_f64() * 1e6;
    let rank = times.len().saturating_sub(1) * 99 / 100;
    [
        us(sum) / times.len().max(1) as f64,
        times.get(rank).copied().map_or(0.0, us),
        times.last().copied().map_or(0.0, us),
    ]
}
