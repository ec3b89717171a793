//! Descriptors alone: how well an agent knows where it is, and was, from views of places where it
//! has been before.
//!
//! ```text
//! cargo run --release -p cogmap-lab --example revisits -- \
//!     [runs=N] [seed=N] [steps=N] [every=N] [noise=PERCENT] [pure] [g2o=FILE]
//! ```
//!
//! `g2o` writes the graph of the first run, with the revisits that are believed, beside its true
//! positions.

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

use std::error::Error;
use std::num::NonZeroUsize;

use cogmap_lab::eval::{Environment, Experiment, Percept, Protocol, Report, ViewSettings, Walk};
use cogmap_worlds::OdometryNoise;
use cognitive_map::Recruitment;
use pose_graph::g2o::write_g2o;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().find_map(|text| text.strip_prefix(name));
    let number = |name: &str, default: u64| match value(name) {
        Some(text) => text.parse(),
        None => Ok(default),
    };
    let mut protocol = Protocol::of_paper(Environment::ObstacleRich);
    protocol.settings.recruitment = Recruitment::Novelty;
    protocol.walk = if arguments.iter().any(|text| text == "pure") {
        Walk::Pure
    } else {
        Walk::Persistent
    };
    protocol.steps = number("steps=", 1000)?;
    protocol.percept = Percept::Descriptor(ViewSettings {
        every: number("every=", 5)?,
        noise: number("noise=", 5)? as f64 / 100.0,
    });
    protocol.odometry = OdometryNoise {
        translation_share: 0.05,
        scale_bias: 0.01,
        rotation_sd_rad: 0.5_f64.to_radians(),
        gyro_bias_rad: 0.02_f64.to_radians(),
    };
    let runs = number("runs=", 20)?;
    let first = number("seed=", 1)?;
    let threads = NonZeroUsize::MIN;
    println!("seed  dead reckoning  causal  refined [m]  closures");
    for seed in first..first + runs {
        let experiment = Experiment::run(&protocol, 1, seed, threads, &|_| {})?;
        let report = Report::of(&experiment);
        let of = |name| report.mean(name).unwrap_or(f64::NAN);
        println!(
            "{seed:4}  {:14.3}  {:6.3}  {:7.3}  {:12}",
            of("dead_reckoning_ate_rmse_m"),
            of("causal_ate_rmse_m"),
            of("refined_ate_rmse_m"),
            of("closures"),
        );
        let file = value("g2o=").filter(|_| seed == first);
        if let (Some(file), Some(path)) = (file, experiment.path()) {
            std::fs::write(file, write_g2o(&path.experience))?;
        }
    }
    Ok(())
}
