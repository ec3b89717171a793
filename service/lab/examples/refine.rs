//! The past, smoothed: causal and refined errors of a data set or of a simulated team.
//!
//! ```text
//! cargo run --release -p cogmap-lab --example refine -- mrclam DIR [no-robots] [keyframes=N]
//! cargo run --release -p cogmap-lab --example refine -- team [RUNS]
//! cargo run --release -p cogmap-lab --example refine -- matches DIR [false=PERCENT] [g2o=FILE]
//! ```
//!
//! `keyframes` bounds how much is remembered; `false` adds matches of different places until they
//! make up a share of all, and `g2o` writes the graph with the matches that are believed.

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

#[path = "refine/lived.rs"]
mod lived;
#[path = "refine/matches.rs"]
mod matches;
#[path = "refine/mrclam.rs"]
mod mrclam;
#[path = "refine/team.rs"]
mod team;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |word: &str| arguments.iter().any(|argument| argument == word);
    let value = |name: &str| {
        let found = arguments
            .iter()
            .find_map(|argument| argument.strip_prefix(name));
        found.and_then(|text| text.parse::<u32>().ok())
    };
    let done = match arguments.first().map(String::as_str) {
        Some("mrclam") => arguments.get(1).is_some_and(|directory| {
            mrclam::run(directory, !has("no-robots"), value("keyframes="))
        }),
        Some("matches") => arguments.get(1).is_some_and(|directory| {
            let file = arguments
                .iter()
                .find_map(|argument| argument.strip_prefix("g2o="));
            matches::run(directory, value("false=").unwrap_or(0), file)
        }),
        Some("team") => team::run(
            arguments
                .get(1)
                .and_then(|text| text.parse().ok())
                .unwrap_or(5),
        ),
        _ => false,
    };
    if done {
        ExitCode::SUCCESS
    } else {
        eprintln!(
            "refine mrclam DIR [no-robots] [keyframes=N] | team [RUNS] | matches DIR [false=PERCENT] [g2o=FILE]"
        );
        ExitCode::from(2)
    }
}
