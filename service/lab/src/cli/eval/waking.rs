//! `cogmap-lab eval waking`.

use std::fmt::{self, Display, Formatter};
use std::num::NonZeroUsize;

use clap::Args;
use cogmap_lab::waking::{WakingProtocol, WakingReport, run_waking};

use super::progress::Progress;
use cogmap::cli::output;

#[derive(Debug, Args)]
pub(in crate::cli) struct WakingArgs {
    /// Robots that wake up.
    #[arg(long, default_value_t = WakingProtocol::default().trials, value_name = "N")]
    trials: u32,
    /// Of these, in one and the same building; each building is explored anew.
    #[arg(long, default_value_t = WakingProtocol::default().trials_per_building, value_name = "N")]
    trials_per_building: u32,
    /// Rooms of a building, 1 to 8, which look alike up to three fifths of their height. In
    /// several, robots wake up below 55 % of it.
    #[arg(long, default_value_t = WakingProtocol::default().rooms, value_name = "N")]
    rooms: u32,
    /// Steps of 0.1 m that the explorer makes in each room.
    #[arg(long, default_value_t = WakingProtocol::default().explorer_steps, value_name = "N")]
    explorer_steps: u32,
    /// How far a robot goes [m].
    #[arg(long, default_value_t = WakingProtocol::default().travel_m, value_name = "M")]
    travel_m: f64,
    /// The room is seen at every step whose number divides by this.
    #[arg(long, default_value_t = WakingProtocol::default().view_every, value_name = "STEPS")]
    view_every: u32,
    /// Length of a view's noise, as a share of the view's own.
    #[arg(long, default_value_t = WakingProtocol::default().view_noise, value_name = "SHARE")]
    view_noise: f64,
    /// Share of views that show something else.
    #[arg(long, default_value_t = WakingProtocol::default().view_wrong, value_name = "SHARE")]
    view_wrong: f64,
    /// Seed of the first building: of obstacles, walks, views and noise. The next building has the
    /// next.
    #[arg(long, default_value_t = WakingProtocol::default().seed)]
    seed: u64,
    /// Buildings at the same time; as many as the machine has processors when absent. It changes
    /// nothing but the time that it takes.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// A report for people.
struct Table<'a>(&'a WakingReport);

pub(super) fn run(args: &WakingArgs) -> anyhow::Result<()> {
    let protocol = WakingProtocol {
        trials: args.trials,
        trials_per_building: args.trials_per_building,
        rooms: args.rooms,
        explorer_steps: args.explorer_steps,
        travel_m: args.travel_m,
        view_every: args.view_every,
        view_noise: args.view_noise,
        view_wrong: args.view_wrong,
        seed: args.seed,
    };
    protocol.check()?;
    let threads = args
        .threads
        .or_else(|| std::thread::available_parallelism().ok())
        .unwrap_or(NonZeroUsize::MIN);
    let progress = Progress::new(protocol.trials.into(), "robots");
    let report = run_waking(&protocol, threads, &|| progress.add(1))?;
    progress.finish();
    if args.json {
        output::json(&report)
    } else {
        Ok(output::line(Table(&report).to_string().trim_end())?)
    }
}

impl Display for Table<'_> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let report = self.0;
        let protocol = &report.protocol;
        let rows = [
            ("robots", protocol.trials.to_string()),
            (
                "in the map within 0.2 m at the end",
                format!("{:.1} %", 100.0 * report.relocalised),
            ),
            (
                "ever put more than 0.5 m off",
                report.false_claims.to_string(),
            ),
            (
                "put into a room before it could be told",
                report.early_claims.to_string(),
            ),
            ("not put into the map", report.uncertain.to_string()),
        ];
        for (name, value) in rows {
            writeln!(formatter, "{name:<40} {value:>10}")?;
        }
        let spreads = [
            ("way until put into the map [m]", &report.travel_m),
            ("error at the end [m]", &report.error_m),
            ("turn at the end [rad]", &report.turn_rad),
        ];
        writeln!(
            formatter,
            "{:<40} {:>10} {:>10} {:>10}",
            "", "p50", "p90", "max"
        )?;
        for (name, spread) in spreads {
            write!(formatter, "{name:<40}")?;
            for value in [spread.p50, spread.p90, spread.max] {
                let value = value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"));
                write!(formatter, " {value:>10}")?;
            }
            writeln!(formatter)?;
        }
        Ok(())
    }
}
