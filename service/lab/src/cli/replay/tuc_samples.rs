//! `cogmap-lab replay tuc --samples`: odometry and place matches as a robot would send them.

use anyhow::Context;
use cogmap_lab::tuc::{Match, Tuc};
use cogmap_proto::{
    Increment, MotionNoise, Relation, Sample, SampleBody, Sighting, SpaceSettings, StampedPose,
    StartPose, Target,
};
use nalgebra::{Isometry3, Vector2};
use serde::Serialize;
use trajectory::{Alignment, Pairs, Span, Trajectory};

use super::offline;
use super::outcome::{RobotOutcome, Timing};
use super::team_batch::TeamBatch;
use cogmap::cli::output;
use cogmap::decode::stamped_pose;

/// Name of the robot.
const ROBOT: &str = "robot";
/// Standard deviations of a match, which says no more than that two places are one \[m, rad\].
const MATCH_SD: (f64, f64) = (0.5, 0.2);

/// Errors are RMSE of position on a grid of 10 Hz, in the frame of the truth and after the best
/// rigid motion in the plane.
#[derive(Debug, Serialize)]
struct Report {
    samples: u64,
    matches: usize,
    digest: String,
    causal_ate_rmse_m: f64,
    causal_aligned_ate_rmse_m: f64,
    refined_ate_rmse_m: f64,
    refined_aligned_ate_rmse_m: f64,
    /// Normalised squared error of the position in the plane, per component, once a second; 1 is
    /// right, more is too sure.
    nees_mean: Option<f64>,
    /// Times that samples took \[ms\].
    update_ms: Option<Timing>,
}

/// Replays the set with these matches and prints the errors.
pub(super) fn run(set: &Tuc, matches: &[Match], is_json: bool) -> anyhow::Result<()> {
    let batch = TeamBatch {
        robot: ROBOT.to_owned(),
        samples: samples(set, matches),
    };
    let outcome = offline::replay(&[batch], &SpaceSettings::default())?;
    let robot = outcome
        .robots
        .get(ROBOT)
        .context("the robot left nothing")?;
    let [causal_ate_rmse_m, causal_aligned_ate_rmse_m] = errors_m(set, &robot.causal)?;
    let [refined_ate_rmse_m, refined_aligned_ate_rmse_m] = errors_m(set, &robot.refined)?;
    let report = Report {
        samples: outcome.samples,
        matches: matches.len(),
        digest: outcome.digest,
        causal_ate_rmse_m,
        causal_aligned_ate_rmse_m,
        refined_ate_rmse_m,
        refined_aligned_ate_rmse_m,
        nees_mean: nees_mean(set, robot),
        update_ms: outcome.timing,
    };
    if is_json {
        return output::json(&report);
    }
    output::line("                 plain    aligned    RMSE of position [m]")?;
    for (name, plain, aligned) in [
        ("causal", causal_ate_rmse_m, causal_aligned_ate_rmse_m),
        ("refined", refined_ate_rmse_m, refined_aligned_ate_rmse_m),
    ] {
        output::line(&format!("{name:<10}{plain:>12.4}{aligned:>11.4}"))?;
    }
    Ok(())
}

/// The start pose, a motion at each further step of odometry, and each match at the later of its
/// moments.
fn samples(set: &Tuc, matches: &[Match]) -> Vec<Sample> {
    let mut ends: Vec<(usize, usize)> = matches
        .iter()
        .map(|found| (set.step_at(found.later_ns), set.step_at(found.earlier_ns)))
        .filter(|(later, earlier)| later != earlier)
        .collect();
    ends.sort_unstable();
    let mut ends = ends.into_iter().peekable();
    let mut samples = Vec::new();
    // Number of the sample that is the motion of a step; the start pose is that of the first.
    let mut motions: Vec<u64> = Vec::new();
    for (step, odometry) in set.steps().iter().enumerate() {
        motions.push(samples.len() as u64);
        let body = if step == 0 {
            let (translation_m, rotation_xyzw) = parts(set.start());
            SampleBody::StartPose(StartPose {
                translation_m,
                rotation_xyzw,
                noise: None,
            })
        } else {
            let (translation_m, rotation_xyzw) = parts(&odometry.motion);
            let sd = &odometry.noise_sd;
            SampleBody::Increment(Increment {
                translation_m,
                rotation_xyzw,
                noise: Some(MotionNoise {
                    translation_sd_m: [sd[0], sd[1], sd[2]],
                    rotation_sd_rad: [sd[3], sd[4], sd[5]],
                }),
            })
        };
        let stamp_ns = odometry.stamp_ns;
        samples.push(Sample { stamp_ns, body });
        while let Some((_, earlier)) = ends.next_if(|(later, _)| *later == step) {
            let body = SampleBody::Sighting(Sighting {
                target: Target::OwnSample(motions[earlier]),
                relation: same_place(),
            });
            samples.push(Sample { stamp_ns, body });
        }
    }
    samples
}

/// That a place is an earlier one, and is looked at the same way.
fn same_place() -> Relation {
    Relation::Pose {
        translation_m: [0.0; 3],
        rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        noise: MotionNoise {
            translation_sd_m: [MATCH_SD.0, MATCH_SD.0, 0.0],
            rotation_sd_rad: [0.0, 0.0, MATCH_SD.1],
        },
    }
}

fn parts(pose: &Isometry3<f64>) -> ([f64; 3], [f64; 4]) {
    (pose.translation.vector.into(), pose.rotation.coords.into())
}

/// Errors of a trajectory, plain and aligned.
fn errors_m(set: &Tuc, rows: &[StampedPose]) -> anyhow::Result<[f64; 2]> {
    let estimate = Trajectory::from_poses(&rows.iter().map(stamped_pose).collect::<Vec<_>>())?;
    let spans = [estimate.span(), set.truth().span()];
    let span = Span::common(spans).context("estimate and truth have no time in common")?;
    let pairs = Pairs::on_grid(&estimate, set.truth(), span);
    let plain = pairs.errors(Alignment::None)?.rmse_m;
    Ok([plain, pairs.errors(Alignment::Planar)?.rmse_m])
}

fn nees_mean(set: &Tuc, robot: &RobotOutcome) -> Option<f64> {
    let squares = robot.beliefs.iter().filter_map(|(belief, covariance)| {
        let truth = set.truth().at(belief.stamp_ns)?;
        let believed = stamped_pose(belief).pose;
        let off = believed.rotation.inverse() * (truth - believed.translation.vector);
        let off = Vector2::new(off.x, off.y);
        let spread = covariance.matrix().fixed_view::<2, 2>(0, 0).into_owned();
        Some(off.dot(&(spread.try_inverse()? * off)) / 2.0)
    });
    let squares: Vec<f64> = squares.collect();
    (!squares.is_empty()).then(|| squares.iter().sum::<f64>() / squares.len() as f64)
}
