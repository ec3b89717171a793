//! The drills: attacks and faults that take minutes, run against the binary as its users run it.
//!
//! ```text
//! make drills                     # all of them
//! make drills DRILLS="flood"      # some of them, by name
//! ```
//!
//! Each drill prints one JSON object on standard output, `{"drill", "passed", "figures"}`; progress
//! goes to standard error. The exit code is 1 if a drill failed, 2 if there is no drill of a name.

#![allow(clippy::print_stdout)] // The report is what it is for.

mod bit_flips; // one bit anywhere in a store
mod descriptors;
mod flood;
mod half_open;
mod liars; // valid samples, absurd together
mod long_answers;
mod quantile;
mod stopped_subscribers;
mod subscriber;
mod watermarks;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use serde_json::{Value, json};

/// A drill: panics when the service does not hold, returns the figures that it measured.
type Drill = fn() -> Value;

/// All drills, in the order in which they run.
const DRILLS: &[(&str, Drill)] = &[
    ("bit-flips", bit_flips::drill),
    ("liars", liars::liars),
    ("stopped-subscribers", stopped_subscribers::run),
    ("flood", flood::run),
    ("half-open", half_open::run),
    ("descriptors", descriptors::run),
    ("long-answers", long_answers::run),
];

fn main() -> ExitCode {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    if let [first, arguments @ ..] = &wanted[..]
        && first == subscriber::ARGUMENT
    {
        subscriber::run(arguments);
    }
    for name in &wanted {
        if !DRILLS.iter().any(|(drill, _)| drill == name) {
            let names: Vec<_> = DRILLS.iter().map(|(drill, _)| *drill).collect();
            eprintln!("no drill {name:?}; there are: {}", names.join(" "));
            return ExitCode::from(2);
        }
    }
    let mut failed = false;
    for (name, drill) in DRILLS {
        if !wanted.is_empty() && !wanted.iter().any(|wanted| wanted == name) {
            continue;
        }
        eprintln!("drill {name}");
        let outcome = catch_unwind(AssertUnwindSafe(drill));
        failed |= outcome.is_err();
        let passed = outcome.is_ok();
        let figures = outcome.unwrap_or(Value::Null);
        println!(
            "{}",
            json!({"drill": name, "passed": passed, "figures": figures})
        );
    }
    ExitCode::from(u8::from(failed))
}
