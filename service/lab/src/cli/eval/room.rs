//! `cogmap-lab eval env1` and `env2`.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, ValueEnum};
use cogmap_lab::eval::{
    Correct, Environment, Experiment, Explored, PAPER_P_NEW, Percept, Protocol, Report,
    SightingSettings, Table, ViewSettings, Walk, figures,
};
use cogmap_worlds::OdometryNoise;
use cognitive_map::{Recruitment, SettingsValues};
use pose_graph::g2o::write_g2o;
use trajectory::StampedPose;
use trajectory::write_tum;

use super::progress::Progress;
use cogmap::cli::output;

#[derive(Debug, Args)]
pub(in crate::cli) struct RoomArgs {
    /// When a place is recruited.
    #[arg(long, value_enum, default_value = "bernoulli")]
    recruit: Recruit,
    /// Probability of a new place at a step, with --recruit bernoulli.
    #[arg(long, default_value_t = PAPER_P_NEW, value_name = "P")]
    p_new: f64,
    /// How the agent walks.
    #[arg(long, value_enum, default_value = "pure")]
    walk: WalkKind,
    /// What the agent perceives beside its own motion.
    #[arg(long, value_enum, default_value = "none")]
    percept: PerceptKind,
    /// What corrects the pose, in a room that another agent has explored by its obstacles: four
    /// channels of levels that places remember, obstacles, or both. The walk is persistent, places
    /// are recruited where none answers, and odometry errs as in docs/accuracy.md unless it is
    /// told to err otherwise.
    #[arg(long, value_enum, conflicts_with = "percept")]
    correct: Option<CorrectKind>,
    /// Steps of the explorer, with --correct.
    #[arg(long, default_value_t = 40_000, value_name = "STEPS")]
    explorer_steps: u64,
    /// Distance over which levels change, with --correct [m].
    #[arg(long, default_value_t = 1.5, value_name = "M")]
    level_length_m: f64,
    /// Standard deviation of a level's noise as a share of the field's, with --correct.
    #[arg(long, default_value_t = 0.1, value_name = "SHARE")]
    level_noise: f64,
    /// How far obstacles are sighted [m].
    #[arg(long, default_value_t = SightingSettings::default().range_max_m, value_name = "M")]
    sighting_range_m: f64,
    /// Obstacles are sighted, and the room seen, at every step whose number divides by this.
    #[arg(long, default_value_t = SightingSettings::default().every, value_name = "STEPS")]
    sighting_every: u64,
    /// Standard deviation of a sighting's distance, as a share of it; directions have one of 1° at
    /// 0.05, and in proportion. Of a view, length of its noise as a share of its own.
    #[arg(long, default_value_t = SightingSettings::default().noise, value_name = "SHARE")]
    percept_noise: f64,
    /// Standard deviation of odometry along each axis, as a share of the step.
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    translation_noise: f64,
    /// Standard deviation from which each run's constant scale error is drawn.
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    scale_bias: f64,
    /// Standard deviation of a step's rotation about each axis [°].
    #[arg(long, default_value_t = 0.0, value_name = "DEG")]
    rotation_noise_deg: f64,
    /// Standard deviation from which each run's constant error of a step's rotation is drawn, about
    /// each axis [°].
    #[arg(long, default_value_t = 0.0, value_name = "DEG")]
    gyro_bias_deg: f64,
    /// Number of grid modules; the default of a space when absent.
    #[arg(long, value_name = "N")]
    grid_modules: Option<usize>,
    /// Spacing of the finest grid module [m]; the default of a space when absent.
    #[arg(long, value_name = "M")]
    grid_spacing_m: Option<f64>,
    /// Ratio of the spacings of neighbouring modules; the default of a space when absent.
    #[arg(long, value_name = "RATIO")]
    grid_ratio: Option<f64>,
    /// Distance at which a place's confidence is one half [m]; the default of a space when absent.
    #[arg(long, value_name = "M")]
    field_radius_m: Option<f64>,
    /// Most places in memory, for one more the weakest is forgotten; the default of a space when
    /// absent.
    #[arg(long, value_name = "N")]
    places_max: Option<u32>,
    /// Steps of 0.1 m in each run; the paper's number when absent.
    #[arg(long)]
    steps: Option<u64>,
    /// Number of runs, each with a seed of its own.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Seed of the first run: of obstacles, walk, noise and recruitment. The next run has the next.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Runs at the same time; as many as the machine has processors when absent. It changes nothing
    /// but the time that it takes.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Write figures, report, and the trajectories of the first run into this directory.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write what the first run remembers as a graph, with the revisits that are believed, in the
    /// g2o format.
    #[arg(long, value_name = "FILE")]
    export_g2o: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Recruit {
    /// At each step with a fixed probability, as in the paper.
    Bernoulli,
    /// Where no place answers.
    Novelty,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum WalkKind {
    /// Each step in a direction of its own.
    Pure,
    /// Each step nearly in the direction of the one before.
    Persistent,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum CorrectKind {
    /// Nothing.
    None,
    /// Levels, which places remember.
    Places,
    /// Obstacles, as landmarks.
    Landmarks,
    /// Both.
    All,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum PerceptKind {
    /// Nothing.
    None,
    /// Views of the room, which places remember and are recalled by. Where they resemble earlier
    /// ones they correct poses.
    Descriptor,
    /// The centres of obstacles, as landmarks, which correct poses (env2).
    Sightings,
}

pub(super) fn run(environment: Environment, args: &RoomArgs) -> anyhow::Result<()> {
    let protocol = protocol(environment, args);
    protocol.check()?;
    let threads = args
        .threads
        .or_else(|| std::thread::available_parallelism().ok())
        .unwrap_or(NonZeroUsize::MIN);
    let progress = Progress::new(protocol.steps.saturating_mul(u64::from(args.runs)), "steps");
    let walked = |steps| progress.add(steps);
    let experiment = Experiment::run(&protocol, args.runs, args.seed, threads, &walked)?;
    progress.finish();
    if let Some(directory) = &args.out {
        write(directory, &experiment)
            .with_context(|| format!("write into {}", directory.display()))?;
    }
    if let (Some(file), Some(path)) = (&args.export_g2o, experiment.path()) {
        std::fs::write(file, write_g2o(&path.experience))
            .with_context(|| format!("write {}", file.display()))?;
    }
    if args.json {
        output::json(&Report::of(&experiment))
    } else {
        Ok(output::line(Table::of(&experiment).to_string().trim_end())?)
    }
}

/// What the arguments ask for.
fn protocol(environment: Environment, args: &RoomArgs) -> Protocol {
    let paper = Protocol::of_paper(environment);
    let default = SettingsValues::default();
    Protocol {
        environment,
        steps: args.steps.unwrap_or(paper.steps),
        walk: match args.walk {
            WalkKind::Pure if args.correct.is_none() => Walk::Pure,
            _ => Walk::Persistent,
        },
        settings: SettingsValues {
            recruitment: match args.recruit {
                Recruit::Bernoulli if args.correct.is_none() => Recruitment::Bernoulli {
                    probability: args.p_new,
                },
                _ => Recruitment::Novelty,
            },
            grid_modules: args.grid_modules.unwrap_or(default.grid_modules),
            grid_spacing_m: args.grid_spacing_m.unwrap_or(default.grid_spacing_m),
            grid_ratio: args.grid_ratio.unwrap_or(default.grid_ratio),
            places_max: args.places_max.unwrap_or(default.places_max),
            field_radius_m: args.field_radius_m.unwrap_or(default.field_radius_m),
            ..default
        },
        percept: match args.percept {
            PerceptKind::None => Percept::None,
            PerceptKind::Descriptor => Percept::Descriptor(ViewSettings {
                every: args.sighting_every,
                noise: args.percept_noise,
            }),
            PerceptKind::Sightings => Percept::Sightings(SightingSettings {
                range_max_m: args.sighting_range_m,
                every: args.sighting_every,
                noise: args.percept_noise,
            }),
        },
        odometry: odometry(args),
        explored: args.correct.map(|correct| Explored {
            correct: match correct {
                CorrectKind::None => Correct::None,
                CorrectKind::Places => Correct::Places,
                CorrectKind::Landmarks => Correct::Landmarks,
                CorrectKind::All => Correct::All,
            },
            steps: args.explorer_steps,
            length_m: args.level_length_m,
            noise: args.level_noise,
        }),
    }
}

/// How odometry errs: as told, or, where it is asked what corrects it, as in the tables of
/// accuracy.
fn odometry(args: &RoomArgs) -> OdometryNoise {
    let told = OdometryNoise {
        translation_share: args.translation_noise,
        scale_bias: args.scale_bias,
        rotation_sd_rad: args.rotation_noise_deg.to_radians(),
        gyro_bias_rad: args.gyro_bias_deg.to_radians(),
    };
    if args.correct.is_none() || told != OdometryNoise::none() {
        return told;
    }
    OdometryNoise {
        translation_share: 0.05,
        scale_bias: 0.01,
        rotation_sd_rad: 0.5_f64.to_radians(),
        gyro_bias_rad: 0.02_f64.to_radians(),
    }
}

/// Writes all files of an experiment.
fn write(directory: &Path, experiment: &Experiment) -> anyhow::Result<()> {
    std::fs::create_dir_all(directory)?;
    let report = Report::of(experiment);
    let json = serde_json::to_string_pretty(&report)? + "\n";
    std::fs::write(directory.join("report.json"), json)?;
    for figure in figures(experiment)? {
        std::fs::write(directory.join(format!("{}.svg", figure.name)), figure.svg)?;
    }
    if let Some(path) = experiment.path() {
        let tum = |name: &str, poses: &[StampedPose]| {
            let file = directory.join(format!("seed-{}.{name}.tum", report.seed));
            std::fs::write(file, write_tum(poses))
        };
        tum("truth", &path.truth)?;
        tum("causal", &path.causal)?;
        tum("recalled", &path.recalled)?;
    }
    Ok(())
}
