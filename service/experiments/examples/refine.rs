//! The past, smoothed: causal and refined errors of a data set or of a simulated team.
//!
//! ```text
//! cargo run --release -p cogmap-experiments --example refine -- mrclam DIR [no-robots] [anchors=N]
//! cargo run --release -p cogmap-experiments --example refine -- team [RUNS]
//! ```

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

#[path = "refine/lived.rs"]
mod lived;
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
        Some("mrclam") => arguments
            .get(1)
            .is_some_and(|directory| mrclam::run(directory, !has("no-robots"), value("anchors="))),
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
        eprintln!("refine mrclam DIR [no-robots] [anchors=N] | team [RUNS]");
        ExitCode::from(2)
    }
}
