//! The command line.

mod bench;
mod check_config;
mod demo;
mod duration;
mod eval;
mod export;
mod help;
mod output;
mod replay;
mod serve;
mod store;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use cogmap_experiments::eval::InvalidProtocol;
use cogmap_experiments::eval::object::InvalidObjectProtocol;
use cogmap_experiments::touch::InvalidTouchProtocol;
use cogmap_experiments::waking::InvalidWaking;

use crate::config::{Config, ConfigError};

/// cogmap: a shared spatial memory for robot teams.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the service.
    Serve(ConfigArgs),
    /// Run the service with a simulated team of robots, and sum up at the end.
    Demo(demo::DemoArgs),
    /// Check the settings and print the effective ones.
    CheckConfig(ConfigArgs),
    /// Write what a store holds: the journal as JSON lines, a trajectory as TUM.
    #[command(subcommand)]
    Export(export::ExportCommand),
    /// Verify or repair a store.
    #[command(subcommand)]
    Store(store::StoreCommand),
    /// Copy a store, also while the service runs on it; all that was acknowledged before is in the copy.
    Backup(store::BackupArgs),
    /// Make a store from a backup, into a directory that is empty or absent.
    Restore(store::BackupArgs),
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

/// Where the settings come from.
#[derive(Debug, Args)]
struct ConfigArgs {
    /// Settings file (TOML).
    #[arg(long, env = "COGMAP_CONFIG", value_name = "FILE")]
    config: Option<PathBuf>,
    /// One setting, over file and environment; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Address of the HTTP interface; short for --set http.listen=…
    #[arg(long, value_name = "ADDRESS:PORT")]
    http: Option<String>,
    /// Endpoint that Zenoh listens on; short for --set zenoh.listen=…
    #[arg(long, value_name = "ENDPOINT")]
    zenoh: Option<String>,
    /// Directory of the store; short for --set store.directory=…
    #[arg(long, value_name = "DIR")]
    data_dir: Option<PathBuf>,
}

impl ConfigArgs {
    fn load(&self) -> Result<Config, ConfigError> {
        let mut overrides = Vec::new();
        let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
        if let Some(http) = &self.http {
            overrides.push(format!("http.listen={}", quoted(http)));
        }
        if let Some(zenoh) = &self.zenoh {
            overrides.push(format!("zenoh.listen=[{}]", quoted(zenoh)));
        }
        if let Some(directory) = &self.data_dir {
            let directory = directory.display().to_string();
            overrides.push(format!("store.directory={}", quoted(&directory)));
        }
        // What is said at length comes last and holds.
        overrides.extend(self.set.iter().cloned());
        Config::load(self.config.as_deref(), &overrides)
    }
}

/// Runs the command that the arguments name. 0: done, 1: failed, 2: wrong usage.
pub fn main() -> ExitCode {
    let arguments = help::plain(Cli::command()).get_matches();
    let cli = Cli::from_arg_matches(&arguments).unwrap_or_else(|error| error.exit());
    let result = match cli.command {
        Command::Serve(args) => serve::run(&args),
        Command::Demo(args) => demo::run(&args),
        Command::CheckConfig(args) => check_config::run(&args),
        Command::Export(command) => export::run(&command),
        Command::Store(command) => store::run(&command),
        Command::Backup(args) => store::backup(&args),
        Command::Restore(args) => store::restore(&args),
        Command::Replay(command) => replay::run(&command),
        Command::Eval(command) => eval::run(&command),
        Command::Bench(command) => bench::run(&command),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::complain(&error);
            let wrong_usage = error.is::<ConfigError>()
                || error.is::<InvalidProtocol>()
                || error.is::<InvalidObjectProtocol>()
                || error.is::<InvalidTouchProtocol>()
                || error.is::<InvalidWaking>();
            ExitCode::from(if wrong_usage { 2 } else { 1 })
        }
    }
}
