//! A simulated team.

use std::collections::BTreeMap;

use cogmap_worlds::robot_name;
use cogmap_worlds::{ObstacleWorld, Sensor, Team, TeamSettings};
use cognitive_map::Sample;
use trajectory::{Alignment, Span, StampedPose, Trajectory};

use crate::lived::Lived;

/// Ticks of a run.
const TICKS: u32 = 2000;

/// Prints the errors of some runs; answers whether there were any.
pub(crate) fn run(runs: u64) -> bool {
    let mut sums = [0.0; 4];
    for seed in 1..=runs {
        let settings = TeamSettings {
            seed,
            n_robots: 3,
            robot_sensor: Some(Sensor::default()),
            ..TeamSettings::default()
        };
        let Ok(mut team) = Team::new(ObstacleWorld::new(seed), settings) else {
            return false;
        };
        let mut lived = Lived::new(None);
        for robot in 1..=3 {
            lived.enrol(robot, robot_name(robot));
        }
        let mut truths: BTreeMap<u32, Vec<StampedPose>> = BTreeMap::new();
        for _ in 0..TICKS {
            for tick in team.tick() {
                truths.entry(tick.robot).or_default().push(tick.truth);
                for reading in &tick.readings {
                    if let Ok(sample) = Sample::try_from(reading) {
                        lived.sample(tick.robot, &sample, true);
                    }
                }
            }
        }
        let Ok(truths) = truths
            .iter()
            .map(|(&robot, poses)| Ok((robot, Trajectory::from_poses(poses)?)))
            .collect::<Result<BTreeMap<u32, Trajectory>, trajectory::InvalidTrajectory>>()
        else {
            return false;
        };
        let span = truths[&1].span();
        let Some(span) = Span::common([span]) else {
            return false;
        };
        let refined = lived.graph.refine();
        let means = lived.compare(&refined, &truths, span, Alignment::Spatial);
        println!(
            "seed {seed}: causal {:.4} m, refined {:.4} m",
            means[0], means[2]
        );
        for (sum, mean) in sums.iter_mut().zip(means) {
            *sum += mean;
        }
    }
    let [causal, causal_aligned, refined, refined_aligned] = sums.map(|sum| sum / runs as f64);
    println!(
        "mean: causal {causal:.4} m, aligned {causal_aligned:.4} m; refined {refined:.4} m, aligned {refined_aligned:.4} m"
    );
    runs > 0
}
