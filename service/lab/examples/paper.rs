//! The seed paper's first two experiments as the paper describes them: tables on the terminal, and
//! figures in the directory that is named, if one is.
//!
//! ```sh
//! cargo run --release -p cogmap-lab --example paper -- figures
//! ```

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

use std::error::Error;
use std::path::PathBuf;

use cogmap_lab::eval::{Environment, Experiment, Protocol, Table, figures};

/// Runs of each experiment.
const RUNS: u32 = 100;

fn main() -> Result<(), Box<dyn Error>> {
    let directory = std::env::args_os().nth(1).map(PathBuf::from);
    let threads = std::thread::available_parallelism()?;
    for environment in [Environment::GridAligned, Environment::ObstacleRich] {
        let protocol = Protocol::of_paper(environment);
        let experiment = Experiment::run(&protocol, RUNS, 1, threads, &|_| {})?;
        println!("{}", Table::of(&experiment));
        if let Some(directory) = &directory {
            let directory = directory.join(environment.name());
            std::fs::create_dir_all(&directory)?;
            for figure in figures(&experiment)? {
                std::fs::write(directory.join(format!("{}.svg", figure.name)), figure.svg)?;
            }
        }
    }
    Ok(())
}
