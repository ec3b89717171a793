//! Robots that wake up in a room that was explored.
//!
//! ```text
//! cargo run --release -p cogmap-lab --example waking -- \
//!     [trials=N] [per=N] [rooms=N] [explorer=N] [travel=CM] [seed=N] [cost]
//!     [carried] [stay=M] [after=M]
//! ```
//!
//! `cost` tells instead how long a view takes to be taken in. `carried` robots go on for `stay`
//! when they know where they are, are carried off then, and go on for `after`.

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

use std::error::Error;
use std::num::NonZeroUsize;

use cogmap_lab::waking::{CarriedProtocol, WakingProtocol, run_carried, run_waking, time_waking};

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
    if arguments.iter().any(|text| text == "cost") {
        let took_ms = time_waking(&protocol)?;
        let at = |percent: usize| took_ms[(took_ms.len() - 1) * percent / 100];
        println!("{} views [ms]:", took_ms.len());
        for percent in [50, 75, 90, 99, 100] {
            println!("{percent:4} %  {:8.2}", at(percent));
        }
        return Ok(());
    }
    if arguments.iter().any(|text| text == "carried") {
        let protocol = CarriedProtocol {
            waking: protocol,
            stay_m: number("stay=", 0)?.into(),
            after_m: number("after=", 5)?.into(),
        };
        let report = run_carried(&protocol, NonZeroUsize::MIN, &|| {})?;
        println!("{report:#?}");
        return Ok(());
    }
    let report = run_waking(&protocol, NonZeroUsize::MIN, &|| {})?;
    println!("{report:#?}");
    Ok(())
}
