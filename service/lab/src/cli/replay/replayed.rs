//! A recording through the fold: in the core, or in a service.

use std::path::Path;

use anyhow::Context;

use cogmap::cli::output;
use cogmap::decode::stamped_pose;
use cogmap_lab::paths;
use nalgebra::Vector3;
use trajectory::{StampedPose, write_tum};

use super::arguments::ReplayArgs;
use super::case::Case;
use super::outcome::Outcome;
use super::report::Report;
use super::setting::settings;
use super::team::Team;
use super::{offline, online};

impl Case {
    /// Replays it, and writes what is asked for.
    pub(super) fn run(&self, args: &ReplayArgs) -> anyhow::Result<Report> {
        self.outcomes(args).map(|(report, _)| report)
    }

    /// The same, with what came out of each space.
    pub(super) fn outcomes(&self, args: &ReplayArgs) -> anyhow::Result<(Report, Vec<Outcome>)> {
        let settings = settings(&args.setting).map_err(anyhow::Error::msg)?;
        let mut outcomes = Vec::with_capacity(self.teams.len());
        for team in &self.teams {
            let outcome = match (&args.connect, &args.http) {
                (Some(endpoint), Some(http)) => {
                    let service = online::Target {
                        endpoint,
                        http,
                        token: args.token.as_deref(),
                        space: &team.space,
                    };
                    online::replay(&team.batches, &settings, &service)?
                }
                _ => offline::replay(&team.batches, &settings)?,
            };
            if let Some(directory) = &args.out {
                write(directory, team, &outcome, args.plot)
                    .with_context(|| format!("write into {}", directory.display()))?;
            }
            outcomes.push(outcome);
        }
        Ok((Report::of(self, &outcomes, &args.setting), outcomes))
    }

    /// Replays it and prints the errors.
    pub(super) fn show(&self, args: &ReplayArgs) -> anyhow::Result<()> {
        let report = self.run(args)?;
        if args.json {
            output::json(&report)
        } else {
            report.print()
        }
    }
}

/// Writes the trajectories, and the figures if they are asked for.
fn write(directory: &Path, team: &Team, outcome: &Outcome, is_drawn: bool) -> anyhow::Result<()> {
    std::fs::create_dir_all(directory)?;
    let poses = |rows: &[cogmap_proto::StampedPose]| rows.iter().map(stamped_pose).collect();
    for (robot, came_out) in &outcome.robots {
        let causal: Vec<StampedPose> = poses(&came_out.causal);
        let refined: Vec<StampedPose> = poses(&came_out.refined);
        for (kind, rows) in [("causal", &causal), ("refined", &refined)] {
            let file = directory.join(format!("{robot}.{kind}.tum"));
            std::fs::write(file, write_tum(rows))?;
        }
        let Some(known) = team.robots.get(robot).filter(|_| is_drawn) else {
            continue;
        };
        let path = |label: &str, positions_m: Vec<Vector3<f64>>| paths::Path {
            label: label.to_owned(),
            positions_m,
        };
        let of_poses = |label: &str, poses: &[StampedPose]| {
            let positions = poses.iter().map(|row| row.pose.translation.vector);
            path(label, positions.collect())
        };
        let drawn = [
            of_poses("dead reckoning", &known.reckoned),
            of_poses("causal", &causal),
            of_poses("refined", &refined),
        ];
        let truth = known.truth.as_ref().map(|truth| {
            let positions = truth.positions().iter().map(|row| row.position_m);
            path("truth", positions.collect())
        });
        let subtitle = "as estimated, in the frame of the map, seen from above";
        let figure = paths::figure(robot, subtitle, &drawn, truth.as_ref(), &[])?;
        std::fs::write(directory.join(format!("{robot}.paths.svg")), figure.svg)?;
    }
    Ok(())
}
