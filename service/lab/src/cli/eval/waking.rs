//! `cogmap-lab eval waking`.

use std::fmt::{self, Display, Formatter};
use std::num::NonZeroUsize;

use clap::Args;
use cogmap_lab::waking::{
    CarriedProtocol, CarriedReport, FeltFields, Spread, WakingProtocol, WakingReport, run_carried,
    run_waking, time_waking,
};
use serde::Serialize;

use super::progress::Progress;
use cogmap::cli::output;
use cogmap::cli::quantile;

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
    /// Robots feel levels on four channels at every step instead of seeing anything, in smooth
    /// fields of this correlation length [m].
    #[arg(long, value_name = "M", conflicts_with_all = ["view_every", "view_noise", "view_wrong"])]
    levels_m: Option<f64>,
    /// Standard deviation of a level's noise as a share of the field's, with --levels-m.
    #[arg(
        long,
        default_value_t = 0.1,
        value_name = "SHARE",
        requires = "levels_m"
    )]
    level_noise: f64,
    /// Axes of the room along which fields change, 1 to 3, with --levels-m.
    #[arg(long, default_value_t = 3, value_name = "N", requires = "levels_m")]
    level_axes: usize,
    /// Seed of the first building: of obstacles, walks, views and noise. The next building has the
    /// next.
    #[arg(long, default_value_t = WakingProtocol::default().seed)]
    seed: u64,
    /// Buildings at the same time; as many as the machine has processors when absent. It changes
    /// nothing but the time that it takes.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Carry off robots that know where they are when they have gone their way, and see whether
    /// they notice.
    #[arg(long)]
    carried: bool,
    /// How far these go on before they are carried off [m].
    #[arg(long, default_value_t = 0.0, value_name = "M", requires = "carried")]
    stay_m: f64,
    /// How far they go after that [m]; with 0 they are not carried off.
    #[arg(long, default_value_t = 5.0, value_name = "M", requires = "carried")]
    after_m: f64,
    /// Print instead how long views or levels take to be taken in, on one thread.
    #[arg(long, conflicts_with = "carried")]
    cost: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// How long views take to be taken in \[ms\].
#[derive(Debug, Serialize)]
struct Cost {
    views: usize,
    p50: f64,
    p75: f64,
    p90: f64,
    p99: f64,
    max: f64,
}

/// A report for people.
struct Table<'a>(&'a WakingReport);

/// The same of robots that were carried off.
struct CarriedTable<'a>(&'a CarriedReport);

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
        felt: args.levels_m.map(|length_m| FeltFields {
            length_m,
            noise: args.level_noise,
            axes: args.level_axes,
        }),
        seed: args.seed,
    };
    protocol.check()?;
    let threads = args
        .threads
        .or_else(|| std::thread::available_parallelism().ok())
        .unwrap_or(NonZeroUsize::MIN);
    if args.cost {
        return cost(args, &protocol);
    }
    let progress = Progress::new(protocol.trials.into(), "robots");
    if args.carried {
        let protocol = CarriedProtocol {
            waking: protocol,
            stay_m: args.stay_m,
            after_m: args.after_m,
        };
        let report = run_carried(&protocol, threads, &|| progress.add(1))?;
        progress.finish();
        return if args.json {
            output::json(&report)
        } else {
            Ok(output::line(CarriedTable(&report).to_string().trim_end())?)
        };
    }
    let report = run_waking(&protocol, threads, &|| progress.add(1))?;
    progress.finish();
    if args.json {
        output::json(&report)
    } else {
        Ok(output::line(Table(&report).to_string().trim_end())?)
    }
}

fn cost(args: &WakingArgs, protocol: &WakingProtocol) -> anyhow::Result<()> {
    let mut took_ms = time_waking(protocol)?;
    let views = took_ms.len();
    let mut at = |share| quantile(&mut took_ms, share);
    let cost = Cost {
        views,
        p50: at(0.5),
        p75: at(0.75),
        p90: at(0.9),
        p99: at(0.99),
        max: at(1.0),
    };
    if args.json {
        return output::json(&cost);
    }
    Ok(output::line(&format!(
        "{views} percepts [ms]: p50 {:.2}, p75 {:.2}, p90 {:.2}, p99 {:.2}, max {:.2}",
        cost.p50, cost.p75, cost.p90, cost.p99, cost.max
    ))?)
}

impl Display for CarriedTable<'_> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let report = self.0;
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let rows = [
            (
                "robots that knew where they were",
                report.localized.to_string(),
            ),
            (
                "called themselves lost before, on m",
                format!("{:.0}", report.stayed_m),
            ),
            ("times", report.alarms.to_string()),
            (
                "of these more than 0.5 m off",
                report.alarms_off.to_string(),
            ),
            (
                "noticed that they were carried off",
                percent(report.noticed),
            ),
            ("back within 0.2 m after 3 m", percent(report.back)),
            (
                "called lost, then put elsewhere",
                report.false_claims.to_string(),
            ),
            (
                "localized elsewhere beyond 3 m",
                report.late_claims.to_string(),
            ),
        ];
        for (name, value) in rows {
            writeln!(formatter, "{name:<40} {value:>10}")?;
        }
        let spreads = [
            ("way until they noticed [m]", &report.noticed_m),
            ("way until they knew again [m]", &report.back_m),
            ("error then [m]", &report.error_m),
        ];
        write_spreads(formatter, &spreads)
    }
}

/// A line for each, below a head.
fn write_spreads(formatter: &mut Formatter<'_>, spreads: &[(&str, &Spread)]) -> fmt::Result {
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

impl Display for Table<'_> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let report = self.0;
        let protocol = &report.protocol;
        let within = format!("in the map within {} m at the end", report.found_m);
        let rows = [
            ("robots", protocol.trials.to_string()),
            (
                within.as_str(),
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
        write_spreads(formatter, &spreads)
    }
}
