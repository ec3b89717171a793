//! The joint estimate by itself, without the map around it: errors on a data set or in the room.
//!
//! ```text
//! cargo run --release -p cogmap-lab --example estimate -- mrclam DIR \
//!     [no-robots] [unknown] [anonymous=N,N]
//! cargo run --release -p cogmap-lab --example estimate -- env2 [STEPS [RUNS [RANGE_M]]] [look]
//! ```
//!
//! `no-robots` leaves out sightings of robots, `unknown` all start poses but the first robot's;
//! robots that are `anonymous` have names of their own for landmarks; `look` sights obstacles
//! before the first step, too. An unaligned error of robots with unknown starts counts from when
//! they came into the map.

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

#[path = "estimate/mrclam.rs"]
mod mrclam;
#[path = "estimate/room.rs"]
mod room;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |word: &str| arguments.iter().any(|argument| argument == word);
    let count = |at: usize| arguments.get(at).and_then(|text| text.parse::<u32>().ok());
    let range_m = arguments.get(3).and_then(|text| text.parse().ok());
    let done = match arguments.first().map(String::as_str) {
        Some("mrclam") => {
            let names = arguments
                .iter()
                .find_map(|text| text.strip_prefix("anonymous="));
            let numbers = names.unwrap_or_default().split(',');
            let told = mrclam::Told {
                sightings_of_robots: !has("no-robots"),
                all_starts: !has("unknown"),
                anonymous: numbers.filter_map(|text| text.parse().ok()).collect(),
            };
            arguments
                .get(1)
                .is_some_and(|directory| mrclam::run(directory, &told))
        }
        Some("env2") => {
            let room = room::Room {
                steps: count(1).map_or(1000, i64::from),
                range_m: range_m.unwrap_or(8.0),
                looks_first: has("look"),
            };
            room.run(count(2).map_or(20, u64::from))
        }
        _ => false,
    };
    if done {
        ExitCode::SUCCESS
    } else {
        eprintln!(
            "estimate mrclam DIR [no-robots] [unknown] [anonymous=N,N] | env2 [STEPS [RUNS [RANGE_M]]] [look]"
        );
        ExitCode::from(2)
    }
}
