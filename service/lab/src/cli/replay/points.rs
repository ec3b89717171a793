//! `cogmap-lab replay points`.

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use cogmap_lab::points::{self, Cloud, Exploration, PointsSettings};

use crate::cli::eval::Progress;
use cogmap::cli::output;

/// Metres in a millimetre.
const M_PER_MM: f64 = 1e-3;

#[derive(Debug, Args)]
pub(in crate::cli) struct PointsArgs {
    /// Directory with one file an object, `<name>.csv`, of the columns `x,y,z,nx,ny,nz` [m].
    directory: PathBuf,
    /// How contacts come about.
    #[arg(long, value_enum, default_value = "independent")]
    contacts: Contacts,
    /// Contacts say whether they were drawn from the whole surface or asked for, as those of a
    /// question over HTTP may; otherwise they count as found, as those of an agent do.
    #[arg(long)]
    told: bool,
    /// Contacts by which each object is learned.
    #[arg(long, default_value_t = 1000, value_name = "N")]
    learned: usize,
    /// Standard deviation of a contact's position along each axis [mm].
    #[arg(long, default_value_t = 2.0, value_name = "MM")]
    noise_mm: f64,
    /// Standard deviation of a normal about each axis [°].
    #[arg(long, default_value_t = 2.0, value_name = "DEG")]
    noise_deg: f64,
    /// Explorations of each object.
    #[arg(long, default_value_t = 10)]
    trials: usize,
    /// Objects that are left out at a time, until each was left out once, to see whether they are
    /// called unknown; none when 0.
    #[arg(long, default_value_t = 0, value_name = "N")]
    leave_out: usize,
    /// Numbers of contacts after which is looked, with commas between; the last ends an
    /// exploration.
    #[arg(long, value_delimiter = ',', value_name = "N",
        default_values_t = PointsSettings::default().looks)]
    looks: Vec<usize>,
    /// Seed of what is learned, contacts, poses and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// How contacts come about.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Contacts {
    /// Anywhere on the surface, each independent of the others.
    Independent,
    /// Along a blind random walk on the surface.
    Walk,
    /// Where the recogniser asks for them.
    Policy,
}

pub(super) fn run(args: &PointsArgs) -> anyhow::Result<()> {
    let settings = PointsSettings {
        exploration: match args.contacts {
            Contacts::Independent => Exploration::Independent,
            Contacts::Walk => Exploration::Walk,
            Contacts::Policy => Exploration::Policy,
        },
        is_reach_told: args.told,
        learned: args.learned,
        noise_m: args.noise_mm * M_PER_MM,
        noise_rad: args.noise_deg.to_radians(),
        trials: args.trials,
        leave_out: args.leave_out,
        looks: args.looks.clone(),
        seed: args.seed,
    };
    let clouds = Cloud::load(&args.directory)?;
    let begin = Instant::now();
    let mut progress: Option<(Progress, usize)> = None;
    let report = points::run(&clouds, &settings, &|| begin.elapsed(), &mut |done, of| {
        let (bar, before) =
            progress.get_or_insert_with(|| (Progress::new(of as u64, "explorations"), 0));
        bar.add(done.saturating_sub(*before) as u64);
        *before = done;
    });
    if let Some((bar, _)) = progress {
        bar.finish();
    }
    if args.json {
        return output::json(&report);
    }
    output::line(&format!(
        "{} objects, {} explorations, {:.0} places an object",
        report.objects, report.trials, report.places_mean
    ))?;
    output::line(&format!(
        "\n{:>8} {:>22}",
        "contacts", "right first choices [%]"
    ))?;
    for (contacts, share) in &report.top1_after {
        output::line(&format!("{contacts:>8} {:>22.1}", 100.0 * share))?;
    }
    Ok(())
}
