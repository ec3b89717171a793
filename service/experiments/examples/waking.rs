//! Robots that wake up in a room that was explored.
//!
//! ```text
//! cargo run --release -p cogmap-experiments --example waking -- [trials=N] [per=N] [rooms=N] [explorer=N] [travel=CM] [seed=N]
//! ```

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

use std::error::Error;
use std::num::NonZeroUsize;

use cogmap_experiments::waking::{WakingProtocol, run_waking};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |name: &str, default: u32| {
        let value = arguments.iter().find_map(|text| text.strip_prefix(name));
        value.map_or(Ok(default), str::parse)
    };
    let defaults = WakingProtocol::default();
    let protocol = WakingProtocol {
        trials: number("trials=", defaults.trials)?,
        trials_per_building: number("per=", defaults.trials_per_building)?,
        rooms: number("rooms=", defaults.rooms)?,
        explorer_steps: number("explorer=", defaults.explorer_steps)?,
        travel_m: f64::from(number("travel=", 300)?) / 100.0,
        seed: number("seed=", 1)?.into(),
        ..defaults
    };
    let report = run_waking(&protocol, NonZeroUsize::MIN, &|| {})?;
    println!("{report:#?}");
    Ok(())
}
