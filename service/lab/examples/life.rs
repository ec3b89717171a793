//! A long life: memory and cost of a sample as a team goes on and on.
//!
//! ```text
//! cargo run --release -p cogmap-lab --example life -- [TICKS] [ROBOTS]
//! ```
//!
//! Robots walk in a room with beacons and see these and one another. Each tenth of the run prints a
//! line: samples so far, memory of the process, and how long the samples of that tenth took.

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

use std::error::Error;
use std::time::{Duration, Instant};

use cogmap_worlds::robot_name;
use cogmap_worlds::{ObstacleWorld, Sensor, Team, TeamSettings};
use cognitive_map::{AgentId, CognitiveMap, Label, Record, Sample, Settings};

/// Bytes of a page of memory, on the machines that tell how many a process has.
const PAGE_BYTES: f64 = 4096.0;

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

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u32| arguments.next().map_or(Ok(default), |text| text.parse());
    let ticks = number(150_000)?;
    let n_robots = number(3)?;
    let settings = TeamSettings {
        seed: 1,
        n_robots,
        robot_sensor: Some(Sensor::default()),
        ..TeamSettings::default()
    };
    let mut team = Team::new(ObstacleWorld::new(1), settings)?;
    let mut map = CognitiveMap::new(Settings::default());
    let mut events = Vec::new();
    for robot in 1..=n_robots {
        let record = Record::Enrol {
            agent: AgentId(robot - 1),
            name: Label::new(&robot_name(robot))?,
        };
        map.apply(&record, &mut events);
    }
    println!("  samples  memory [MB]  mean, 99 %, longest [us]  places  error [m]");
    let mut seqs = vec![0; n_robots as usize];
    let mut times: Vec<Duration> = Vec::new();
    let mut samples: u64 = 0;
    for tick in 1..=ticks {
        let mut error_m: f64 = 0.0;
        for robot in team.tick() {
            let agent = AgentId(robot.robot - 1);
            let seq = &mut seqs[agent.0 as usize];
            for reading in &robot.readings {
                let record = Record::Sample {
                    agent,
                    session: 1,
                    seq: *seq,
                    sample: Sample::try_from(reading)?,
                };
                *seq += 1;
                samples += 1;
                let begin = Instant::now();
                map.apply(&record, &mut events);
                times.push(begin.elapsed());
                events.clear();
            }
            if let Some(known) = map.agent(agent) {
                let off = known.pose().translation.vector - robot.truth.pose.translation.vector;
                error_m = error_m.max(off.norm());
            }
        }
        if tick % (ticks / 10).max(1) == 0 {
            let [mean, p99, longest] = times_us(&mut times);
            let (memory_mb, places) = (memory_mb(), map.place_count());
            println!(
                "{samples:9}  {memory_mb:11.1}  {mean:5.1} {p99:6.1} {longest:9.1}     \
                 {places:6}  {error_m:.3}",
            );
            times.clear();
        }
    }
    Ok(())
}

/// Memory of this process \[MB\]; 0 where the machine does not tell.
fn memory_mb() -> f64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = text.split_whitespace().nth(1);
    let pages: f64 = pages.and_then(|text| text.parse().ok()).unwrap_or(0.0);
    pages * PAGE_BYTES / 1e6
}
