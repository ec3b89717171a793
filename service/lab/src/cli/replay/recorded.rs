//! A recording straight into the experience map: what `g2o`, `tuc` and `victoria` have in common.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, ensure};
use clap::Args;
use cogmap_lab::mapping::{self, CausalRun, Consistency, Recording, Refined};
use nalgebra::{Isometry3, Vector3};
use pose_graph::Innovation;
use trajectory::write_tum;
use trajectory::{Alignment, Pairs, Span, StampedPose, Trajectory};

use super::recorded_report::{Closures, ConsistencyReport, Report, UpdateMs};
use crate::cli::eval::Progress;
use cogmap::cli::output;

/// What is written and printed.
#[derive(Debug, Args)]
pub(super) struct RecordedArgs {
    /// Leave out the causal run: only the whole map is relaxed, and matches are judged by one
    /// another alone.
    #[arg(long)]
    no_causal: bool,
    /// Write `causal.tum` and `refined.tum` into this directory.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Draw the paths, seen from above, as `paths.svg` beside them.
    #[arg(long, requires = "out")]
    plot: bool,
    /// Print one JSON object.
    #[arg(long)]
    pub(super) json: bool,
}

/// What is known of where the robot was.
#[derive(Debug)]
pub(super) enum Truth<'a> {
    /// Nothing.
    Unknown,
    /// Positions of poses, by their steps, in the frame of the first pose or in that of the file.
    OfPoses(Vec<Option<Vector3<f64>>>),
    /// Positions over time, in the frame in which the recording begins.
    OverTime(&'a Trajectory),
}

/// A recording and what surrounds it.
#[derive(Debug)]
pub(super) struct Case<'a> {
    /// Title of the figure.
    pub(super) title: String,
    pub(super) recording: &'a Recording,
    pub(super) truth: Truth<'a>,
    pub(super) alignment: Alignment,
    /// Whether stamps are times.
    pub(super) has_time: bool,
    /// Share of the matches that are false, if that is known.
    pub(super) false_share: Option<f64>,
}

/// The causal run and its times.
struct Causal<'a> {
    run: CausalRun<'a>,
    update_ms: Vec<f64>,
    nees: Consistency,
}

pub(super) fn run(case: &Case<'_>, args: &RecordedArgs) -> anyhow::Result<()> {
    let causal = (!args.no_causal).then(|| causal(case));
    let verdict = causal.as_ref().map(|causal| causal.run.verdict());
    let begin = Instant::now();
    let refined = Refined::of(case.recording, verdict.as_ref());
    let batch_s = begin.elapsed().as_secs_f64();
    let causal_poses = causal.as_ref().map(|causal| causal.run.poses());
    let mut all = refined.poses.iter().chain(causal_poses.unwrap_or_default());
    ensure!(
        all.all(|pose| pose.translation.vector.iter().all(|x| x.is_finite())),
        "the map is not finite: lengths or information are too large"
    );
    if let Some(directory) = &args.out {
        write(directory, case, causal_poses, &refined, args.plot)
            .with_context(|| format!("write into {}", directory.display()))?;
    }
    let report = report(case, causal.as_ref(), &refined, batch_s);
    if args.json {
        output::json(&report)
    } else {
        report.print()
    }
}

/// Lets the recording arrive pose by pose.
fn causal<'a>(case: &'a Case<'_>) -> Causal<'a> {
    let n = case.recording.steps.len();
    let progress = Progress::new(n as u64, "poses");
    let mut causal = Causal {
        run: CausalRun::new(case.recording),
        update_ms: Vec::with_capacity(n),
        nees: Consistency::default(),
    };
    loop {
        let begin = Instant::now();
        let Some(pose) = causal.run.step() else { break };
        causal.update_ms.push(begin.elapsed().as_secs_f64() * 1e3);
        let step = &case.recording.steps[causal.run.poses().len() - 1];
        if let Truth::OverTime(truth) = case.truth
            && !step.is_held
            && let Some(error) = truth
                .at(step.stamp_ns)
                .and_then(|truth| normalised(&causal.run, &pose, &truth))
        {
            causal.nees.add(error);
        }
        progress.add(1);
    }
    progress.finish();
    causal
}

/// The newest position's error in standard deviations, along the axes x and y of the body.
fn normalised(
    run: &CausalRun<'_>,
    pose: &Isometry3<f64>,
    truth: &Vector3<f64>,
) -> Option<Innovation> {
    let covariance = run.newest_covariance()?;
    let planar = covariance.matrix().fixed_view::<2, 2>(0, 0).into_owned();
    let apart = pose
        .rotation
        .inverse_transform_vector(&(truth - pose.translation.vector));
    let error = apart.fixed_rows::<2>(0).into_owned();
    let squared = error.dot(&planar.cholesky()?.solve(&error));
    Some(Innovation {
        squared,
        degrees: 2,
    })
}

fn report(case: &Case<'_>, causal: Option<&Causal<'_>>, refined: &Refined, batch_s: f64) -> Report {
    let errors = |poses: Option<&[Isometry3<f64>]>| {
        poses.map_or([None, None], |poses| {
            [Alignment::None, case.alignment].map(|alignment| error_m(case, poses, alignment))
        })
    };
    let [causal_ate, causal_aligned] = errors(causal.map(|causal| causal.run.poses()));
    let [refined_ate, refined_aligned] = errors(Some(&refined.poses));
    let nis = causal.map(|causal| causal.run.consistency(&refined.verdict));
    let nees = causal.map(|causal| causal.nees);
    let stamps = || case.recording.steps.iter().map(|step| step.stamp_ns);
    let lasted = stamps().max().zip(stamps().min());
    let lasted_s = lasted.map(|(last, first)| last.saturating_sub(first) as f64 * 1e-9);
    let worked_s = causal.map(|causal| causal.update_ms.iter().sum::<f64>() * 1e-3);
    Report {
        digest: refined.digest.to_string(),
        poses: refined.poses.len(),
        landmarks: refined.landmarks.len(),
        links: refined.n_links,
        closures: Closures {
            accepted: refined.verdict.n_accepted(),
            rejected: refined.verdict.n_rejected(),
        },
        false_share: case.false_share,
        chi2_half: 0.5 * refined.chi_squared,
        chi2_half_of_all: refined.chi_squared_of_all.map(|chi2| 0.5 * chi2),
        chi2_half_causal: causal.map(|causal| 0.5 * causal.run.chi_squared()),
        causal_ate_rmse_m: causal_ate,
        causal_aligned_ate_rmse_m: causal_aligned,
        refined_ate_rmse_m: refined_ate,
        refined_aligned_ate_rmse_m: refined_aligned,
        update_ms: causal.map(|causal| UpdateMs::of(&causal.update_ms)),
        judgements: causal.map(|causal| causal.run.n_judgements()),
        batch_s,
        real_time_factor: lasted_s
            .zip(worked_s)
            .filter(|(_, worked_s)| case.has_time && *worked_s > 0.0)
            .map(|(lasted_s, worked_s)| lasted_s / worked_s),
        consistency: ConsistencyReport {
            nis_per_degree: nis.and_then(|nis| nis.per_degree()),
            nis_count: nis.map_or(0, |nis| nis.n),
            nees_per_degree: nees.and_then(|nees| nees.per_degree()),
            nees_count: nees.map_or(0, |nees| nees.n),
        },
    }
}

/// RMSE of position: over time on a grid of 10 Hz, or over the poses of which the position is
/// known.
fn error_m(case: &Case<'_>, poses: &[Isometry3<f64>], alignment: Alignment) -> Option<f64> {
    let errors = match &case.truth {
        Truth::Unknown => return None,
        Truth::OverTime(truth) => {
            let estimate = Trajectory::from_poses(&stamped(case, poses)).ok()?;
            let span = Span::common([estimate.span(), truth.span()])?;
            Pairs::on_grid(&estimate, truth, span).errors(alignment)
        }
        Truth::OfPoses(_) => {
            let (estimate, truth) = pairs(case, poses);
            Pairs::by_index(estimate, truth).ok()?.errors(alignment)
        }
    };
    errors.ok().map(|errors| errors.rmse_m)
}

/// Estimated and true positions, as far as these are known.
fn pairs(case: &Case<'_>, poses: &[Isometry3<f64>]) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    match &case.truth {
        Truth::Unknown => (Vec::new(), Vec::new()),
        Truth::OfPoses(truth) => {
            // A reference that begins at its origin is in the frame of its first pose, any other in
            // that of the file.
            let begins_at_origin = truth[0].is_some_and(|first| first.norm() < 1e-9);
            let frame = if begins_at_origin {
                poses[0].inverse()
            } else {
                Isometry3::identity()
            };
            let known = poses.iter().zip(truth);
            known
                .filter_map(|(pose, truth)| Some(((frame * pose).translation.vector, (*truth)?)))
                .unzip()
        }
        Truth::OverTime(truth) => {
            let known = poses.iter().zip(&case.recording.steps);
            known
                .filter_map(|(pose, step)| {
                    Some((pose.translation.vector, truth.at(step.stamp_ns)?))
                })
                .unzip()
        }
    }
}

fn stamped(case: &Case<'_>, poses: &[Isometry3<f64>]) -> Vec<StampedPose> {
    let steps = case.recording.steps.iter();
    let rows = steps.zip(poses).map(|(step, pose)| StampedPose {
        stamp_ns: step.stamp_ns,
        pose: *pose,
    });
    rows.collect()
}

/// Writes the trajectories, and the figure if it is asked for.
fn write(
    directory: &Path,
    case: &Case<'_>,
    causal: Option<&[Isometry3<f64>]>,
    refined: &Refined,
    is_drawn: bool,
) -> anyhow::Result<()> {
    std::fs::create_dir_all(directory)?;
    let tum = |name: &str, poses: &[Isometry3<f64>]| {
        std::fs::write(directory.join(name), write_tum(&stamped(case, poses)))
    };
    if let Some(causal) = causal {
        tum("causal.tum", causal)?;
    }
    tum("refined.tum", &refined.poses)?;
    if is_drawn {
        let figure = figure(case, causal, refined)?;
        std::fs::write(directory.join("paths.svg"), figure)?;
    }
    Ok(())
}

/// The motion that moves poses to where they fit the truth best.
fn fitted(case: &Case<'_>, poses: &[Isometry3<f64>]) -> Isometry3<f64> {
    let (estimate, truth) = pairs(case, poses);
    let (unmoved, truth_frame) = match &case.truth {
        Truth::OfPoses(truth) if truth[0].is_some_and(|first| first.norm() < 1e-9) => {
            (poses[0].inverse(), true)
        }
        truth => (Isometry3::identity(), !matches!(truth, Truth::Unknown)),
    };
    let motion = if truth_frame {
        case.alignment.fit(&estimate, &truth)
    } else {
        Isometry3::identity()
    };
    motion * unmoved
}

/// The paths in the frame of the truth, each moved to where it fits best, or as they are where
/// there is none.
fn figure(
    case: &Case<'_>,
    causal: Option<&[Isometry3<f64>]>,
    refined: &Refined,
) -> anyhow::Result<String> {
    let path = |label: &str, positions_m: Vec<Vector3<f64>>| mapping::Path {
        label: label.to_owned(),
        positions_m,
    };
    let positions = |poses: &[Isometry3<f64>]| -> Vec<Vector3<f64>> {
        let motion = fitted(case, poses);
        let moved = poses.iter().map(|pose| (motion * pose).translation.vector);
        moved.collect()
    };
    let mut paths = Vec::new();
    if let Some(causal) = causal {
        paths.push(path("causal", positions(causal)));
    }
    paths.push(path("refined", positions(&refined.poses)));
    let yardstick = match &case.truth {
        Truth::Unknown => None,
        Truth::OfPoses(truth) => Some(path("reference", truth.iter().flatten().copied().collect())),
        Truth::OverTime(truth) => {
            let positions = truth.positions().iter().map(|at| at.position_m);
            Some(path("truth", positions.collect()))
        }
    };
    let motion = fitted(case, &refined.poses);
    let moved = refined
        .landmarks
        .iter()
        .map(|point| (motion * point).coords);
    let landmarks: Vec<Vector3<f64>> = moved.collect();
    let subtitle = format!(
        "{} poses, {} matches held, {} left out, seen from above{}",
        refined.poses.len(),
        refined.verdict.n_accepted(),
        refined.verdict.n_rejected(),
        if yardstick.is_some() {
            ", each path moved to where it fits best"
        } else {
            ""
        }
    );
    Ok(mapping::figure(
        &case.title,
        &subtitle,
        &paths,
        yardstick.as_ref(),
        &landmarks,
    )?
    .svg)
}
