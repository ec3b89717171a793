//! `cogmap-lab bench`: speed, each figure beside its yardstick from the same run.

mod descriptors;
mod http;
mod ingest;
mod life;
mod live;
mod load;
mod recall;
mod route;
mod step;
mod teach;
mod touch;
mod touch_fold;
mod views;

pub(super) use ingest::Bench;

use clap::Subcommand;

#[derive(Debug, Subcommand)]
pub(in crate::cli) enum BenchCommand {
    /// A motion step through the map, at different numbers of places.
    Step(step::StepArgs),
    /// Recall of places by a grid code, at different numbers of places.
    Recall(recall::RecallArgs),
    /// Recall of places by a descriptor, at different numbers of places.
    Descriptors(descriptors::DescriptorsArgs),
    /// A view of a robot that knows where it is and of one that does not, at different numbers of
    /// earlier views.
    Views(views::ViewsArgs),
    /// Routes over ways, at different numbers of places.
    Route(route::RouteArgs),
    /// A touch and its answer, at different numbers of objects.
    Touch(touch::TouchArgs),
    /// Objects that are taught: the pause of the map, and what is computed beside it.
    Teach(teach::TeachArgs),
    /// Memory and cost of a sample as a team goes on and on.
    Life(life::LifeArgs),
    /// Samples that become durable, beside the raw rate of the same messages.
    Ingest(ingest::IngestArgs),
    /// Answers to "where is this agent" while samples come in, beside a bare handler.
    Http(http::HttpArgs),
    /// Publishes samples for the other benchmarks, from a process of its own.
    #[command(hide = true)]
    Load(load::LoadArgs),
}

pub(super) fn run(command: &BenchCommand) -> anyhow::Result<()> {
    match command {
        BenchCommand::Step(args) => step::run(args),
        BenchCommand::Recall(args) => recall::run(args),
        BenchCommand::Descriptors(args) => descriptors::run(args),
        BenchCommand::Views(args) => views::run(args),
        BenchCommand::Route(args) => route::run(args),
        BenchCommand::Touch(args) => touch::run(args),
        BenchCommand::Teach(args) => teach::run(args),
        BenchCommand::Life(args) => life::run(args),
        BenchCommand::Ingest(args) => match args.live {
            Some(live_streams) => live::run(args, live_streams.get()),
            None => ingest::run(args),
        },
        BenchCommand::Http(args) => http::run(args),
        BenchCommand::Load(args) => load::run(args),
    }
}
