//! `cogmap-lab replay`: a recorded data set through the map, and the error of what comes out.

mod arguments;
mod case;
mod columns;
mod csv;
mod csv_waking;
mod errors;
mod g2o;
mod known;
mod measured;
mod mrclam;
mod offline;
mod online;
mod outcome;
mod points;
mod position_claims;
mod real;
mod real_report;
mod recording;
mod replayed;
mod report;
mod room;
mod scoring;
mod sequence_recall;
mod sequences;
mod set_kind;
mod setting;
mod team;
mod touch;
mod tuc;
mod victoria;

use clap::Subcommand;

#[derive(Debug, Subcommand)]
pub(in crate::cli) enum ReplayCommand {
    /// A set in the format of UTIAS MRCLAM: odometry as motion, measurements as sightings.
    Mrclam(mrclam::MrclamArgs),
    /// A pose graph: relaxed as a whole, or sent pose by pose.
    G2o(g2o::G2oArgs),
    /// A set in the format of TUC: odometry, and place matches of which many are false.
    Tuc(tuc::TucArgs),
    /// Victoria Park as text: odometry as motion, trees as landmarks.
    Victoria(victoria::VictoriaArgs),
    /// Simulated robots on wheels in rooms with landmarks, with sensors as good as one likes: are
    /// covariances honest?
    Room(room::RoomArgs),
    /// Tables of motion, levels, views and ranges of robots, with their truth.
    Csv(csv::CsvArgs),
    /// Tables with views: one agent's way is remembered, and the others are told where they are by
    /// their last views.
    Sequences(sequences::SequencesArgs),
    /// All sets of such tables in a directory, each as it can be measured by what it holds: errors,
    /// and how often what was claimed is right.
    Real(real::RealArgs),
    /// Objects as touches, a place and a level each: learned, and touched again with noise.
    Touch(touch::TouchArgs),
    /// Objects as points with normals: learned from some, and recognised from others in any pose.
    Points(points::PointsArgs),
}

pub(super) fn run(command: &ReplayCommand) -> anyhow::Result<()> {
    match command {
        ReplayCommand::Mrclam(args) => mrclam::run(args),
        ReplayCommand::G2o(args) => g2o::run(args),
        ReplayCommand::Tuc(args) => tuc::run(args),
        ReplayCommand::Victoria(args) => victoria::run(args),
        ReplayCommand::Room(args) => room::run(args),
        ReplayCommand::Csv(args) => csv::run(args),
        ReplayCommand::Sequences(args) => sequences::run(args),
        ReplayCommand::Real(args) => real::run(args),
        ReplayCommand::Touch(args) => touch::run(args),
        ReplayCommand::Points(args) => points::run(args),
    }
}
