//! The command line.

mod bench;
mod eval;
mod replay;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use cogmap::cli::{help, output};
use cogmap_lab::eval::InvalidProtocol;
use cogmap_lab::eval::object::InvalidObjectProtocol;
use cogmap_lab::touch::InvalidTouchProtocol;
use cogmap_lab::waking::InvalidWaking;

/// cogmap's laboratory: recorded data sets, the seed paper's experiments, benchmarks.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Send a recorded data set through the map and measure the error.
    #[command(subcommand)]
    Replay(replay::ReplayCommand),
    /// Run the seed paper's experiments: tables and figures, ours beside the paper's.
    #[command(subcommand)]
    Eval(eval::EvalCommand),
    /// Measure speed, each figure beside its yardstick.
    #[command(subcommand)]
    Bench(bench::BenchCommand),
}

/// Runs the command that the arguments name. 0: done, 1: failed, 2: wrong usage.
pub(crate) fn main() -> ExitCode {
    let arguments = help::plain(Cli::command()).get_matches();
    let cli = Cli::from_arg_matches(&arguments).unwrap_or_else(|error| error.exit());
    let result = match cli.command {
        Command::Replay(command) => replay::run(&command),
        Command::Eval(command) => eval::run(&command),
        Command::Bench(command) => bench::run(&command),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::complain("cogmap-lab", &error);
            let wrong_usage = error.is::<InvalidProtocol>()
                || error.is::<InvalidObjectProtocol>()
                || error.is::<InvalidTouchProtocol>()
                || error.is::<InvalidWaking>();
            ExitCode::from(if wrong_usage { 2 } else { 1 })
        }
    }
}
