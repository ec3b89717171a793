//! `cogmap-lab eval`: the seed paper's experiments, ours beside the paper's, and what a grid code
//! tells.

mod code;
mod object;
mod outlines;
mod patrol;
mod progress;
mod room;
mod routes;
mod scout;
mod sequences;
mod service;
mod waking;

pub(super) use object::Turns;
pub(super) use progress::Progress;
pub(super) use service::Host;

use clap::Subcommand;
use cogmap_lab::eval::Environment;

#[derive(Debug, Subcommand)]
pub(in crate::cli) enum EvalCommand {
    /// The first experiment: an empty room of 10 × 10 × 10 m, 100 steps.
    Env1(room::RoomArgs),
    /// The second experiment: a room of 15 × 15 × 15 m with 50 cubes, 1000 steps.
    Env2(room::RoomArgs),
    /// The third experiment: which of some objects of coloured voxels an end effector touches.
    Env3(object::ObjectArgs),
    /// Random outlines and solids, taught by few or many contacts: are they known again?
    Outlines(outlines::OutlinesArgs),
    /// How well a grid code tells places apart: whole, beside the place, noisy, with modules
    /// erased.
    Code(code::CodeArgs),
    /// Trips that cross themselves, and cues of a few places of them: is it told what comes next,
    /// and as likely as it is?
    Sequences(sequences::SequencesArgs),
    /// Routes in a hall, an office and a maze, through the HTTP of a service: are they found, are
    /// they the shortest, and does a robot that follows them arrive?
    Routes(routes::RoutesArgs),
    /// A robot that goes its rounds on and on, through the HTTP of a service: do its ways, its
    /// memory and the times of answers stay as they are?
    Patrol(patrol::PatrolArgs),
    /// Robots that wake up somewhere in a room that a team-mate has explored: are they found, how
    /// soon, and how far off?
    Waking(waking::WakingArgs),
}

pub(super) fn run(command: &EvalCommand) -> anyhow::Result<()> {
    match command {
        EvalCommand::Env1(args) => room::run(Environment::GridAligned, args),
        EvalCommand::Env2(args) => room::run(Environment::ObstacleRich, args),
        EvalCommand::Env3(args) => object::run(args),
        EvalCommand::Outlines(args) => outlines::run(args),
        EvalCommand::Code(args) => code::run(args),
        EvalCommand::Sequences(args) => sequences::run(args),
        EvalCommand::Routes(args) => routes::run(args),
        EvalCommand::Patrol(args) => patrol::run(args),
        EvalCommand::Waking(args) => waking::run(args),
    }
}
