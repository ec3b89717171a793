//! Relaxes pose graphs: χ²/2 and seconds of each file named.
//!
//! ```sh
//! cargo run --release -p cogmap-experiments --example relax -- sphere2500.g2o
//! ```

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use cogmap_experiments::g2o::PoseGraph;
use cognitive_map::experience::{RelaxationSettings, Start};

fn main() -> Result<(), Box<dyn Error>> {
    for path in std::env::args_os().skip(1).map(PathBuf::from) {
        let graph = PoseGraph::load(&path)?;
        let (map, _) = graph.experience_map();
        let settings = RelaxationSettings {
            start: Start::RotationFirst,
            ..RelaxationSettings::default()
        };
        let (mut best, mut report) = (f64::MAX, None);
        for _ in 0..3 {
            let mut map = map.clone();
            let begin = Instant::now();
            report = Some(map.relax(&settings));
            best = best.min(begin.elapsed().as_secs_f64());
        }
        let report = report.expect("three runs were made");
        println!(
            "{}: chi2/2 {:.5} -> {:.5}, {} steps, converged {}, undetermined {}, {best:.4} s",
            path.display(),
            0.5 * report.chi_squared_at_start,
            0.5 * report.chi_squared,
            report.n_steps,
            report.has_converged,
            report.n_undetermined,
        );
    }
    Ok(())
}
