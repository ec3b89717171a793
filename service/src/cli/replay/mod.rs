//! `cogmap replay`: a recorded data set through the map, and the error of what comes out.

mod mrclam;
mod mrclam_report;
mod offline;
mod online;
mod outcome;
mod readings;

use clap::Subcommand;

pub(super) use readings::sample_of;

#[derive(Debug, Subcommand)]
pub(in crate::cli) enum ReplayCommand {
    /// A set in the format of UTIAS MRCLAM: odometry as motion, measurements as sightings.
    Mrclam(mrclam::MrclamArgs),
}

pub(super) fn run(command: &ReplayCommand) -> anyhow::Result<()> {
    match command {
        ReplayCommand::Mrclam(args) => mrclam::run(args),
    }
}
