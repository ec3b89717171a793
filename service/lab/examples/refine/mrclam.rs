//! A data set of five robots.

use std::path::Path;
use std::time::Instant;

use cogmap_lab::mrclam::Mrclam;
use cogmap_worlds::robot_name;
use cognitive_map::Sample;
use trajectory::Alignment;

use crate::lived::Lived;

/// Prints the errors; answers whether the set could be read.
pub(crate) fn run(directory: &str, sees_robots: bool, keyframes_max: Option<u32>) -> bool {
    let Ok(set) = Mrclam::load(Path::new(directory)) else {
        return false;
    };
    let mut lived = Lived::new(keyframes_max);
    for &robot in set.robots().keys() {
        lived.enrol(robot, robot_name(robot));
    }
    for entry in set.team_readings() {
        if let Ok(sample) = Sample::try_from(&entry.reading) {
            lived.sample(entry.robot, &sample, sees_robots);
        }
    }
    let begin = Instant::now();
    let refined = lived.graph.refine();
    let seconds = begin.elapsed().as_secs_f64();
    let truths = set
        .robots()
        .iter()
        .map(|(&robot, log)| (robot, log.truth_trajectory()))
        .collect();
    let means = lived.compare(&refined, &truths, set.span(), Alignment::Planar);
    let mut times_s = lived.times_s.clone();
    times_s.sort_by(f64::total_cmp);
    println!(
        "mean: causal {:.4} m, aligned {:.4} m; refined {:.4} m, aligned {:.4} m",
        means[0], means[1], means[2], means[3]
    );
    println!(
        "{} keyframes, {} sightings; {} steps in {seconds:.2} s, chi2 {:.0} from {:.0}; us a sample: p50 {:.2}, p99 {:.2}, max {:.0}",
        lived.graph.n_keyframes(),
        lived.graph.n_sightings(),
        refined.relaxed.n_steps,
        refined.relaxed.chi_squared,
        refined.relaxed.chi_squared_at_start,
        times_s[times_s.len() / 2] * 1e6,
        times_s[times_s.len() * 99 / 100] * 1e6,
        times_s[times_s.len() - 1] * 1e6,
    );
    true
}
