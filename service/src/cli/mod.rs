//! The command line.

mod check_config;
mod demo;
pub mod duration;
mod export;
mod free_port;
pub mod help;
mod import;
pub mod output;
mod quantile;
mod serve;
mod store;

pub use free_port::free_port;
pub use quantile::quantile;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};

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
    Demo(Box<demo::DemoArgs>),
    /// Check the settings and print the effective ones.
    CheckConfig(ConfigArgs),
    /// Write what a store holds: the journal as JSON lines, a trajectory as TUM.
    #[command(subcommand)]
    Export(export::ExportCommand),
    /// Make a space of the JSON export of a map: its places and ways, and the names of its agents.
    Import(import::ImportArgs),
    /// Verify or repair a store.
    #[command(subcommand)]
    Store(store::StoreCommand),
    /// Copy a store, also while the service runs on it; all that was acknowledged before is in the
    /// copy.
    Backup(store::BackupArgs),
    /// Make a store from a backup, into a directory that is empty or absent.
    Restore(store::BackupArgs),
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
        self.load_over(toml::Table::new())
    }

    /// The settings, over other defaults for some keys.
    fn load_over(&self, defaults: toml::Table) -> Result<Config, ConfigError> {
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
        Config::load_over(defaults, self.config.as_deref(), &overrides)
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
        Command::Import(args) => import::run(&args),
        Command::Store(command) => store::run(&command),
        Command::Backup(args) => store::backup(&args),
        Command::Restore(args) => store::restore(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::complain("cogmap", &error);
            let wrong_usage = error.is::<ConfigError>();
            ExitCode::from(if wrong_usage { 2 } else { 1 })
        }
    }
}
