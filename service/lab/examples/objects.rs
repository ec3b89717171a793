//! Objects by touch: the seed paper's third experiment, or a set of touches, from the command line.
//!
//! ```sh
//! cargo run --release -p cogmap-lab --example objects -- env3 2 none 1000
//! cargo run --release -p cogmap-lab --example objects -- touch data/thing_a 2 0.5 20 trials.csv
//! ```

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use cogmap_lab::eval::object::{
    Normals, ObjectExperiment, ObjectProtocol, ObjectReport, ObjectTable, Rotate,
};
use cogmap_lab::touch::{TouchExperiment, TouchNoise, TouchProtocol, TouchReport, TouchSet};

/// The turns that an argument asks for.
fn rotate(argument: Option<&str>) -> Rotate {
    match argument {
        Some("24") => Rotate::Cube,
        Some("so3") => Rotate::Free,
        _ => Rotate::None,
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default: f64| -> Result<f64, Box<dyn Error>> {
        Ok(args.get(at).map_or(Ok(default), |text| text.parse())?)
    };
    let threads = std::thread::available_parallelism()?;
    let begin = Instant::now();
    let clock = || begin.elapsed().as_secs_f64();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "numbers from the command line"
    )]
    let count = |number: f64| number as u32;
    match args.first().map(String::as_str) {
        Some("env3") => {
            let rotate = rotate(args.get(2).map(String::as_str));
            let protocol = ObjectProtocol {
                rotate,
                normals: if rotate == Rotate::Free {
                    Normals::Told
                } else {
                    Normals::Untold
                },
                trials: count(number(3, 1000.0)?),
                seed: u64::from(count(number(4, 1.0)?)),
                ..ObjectProtocol::of_paper(count(number(1, 3.0)?))
            };
            let experiment = ObjectExperiment::run(&protocol, threads, &|_| {}, &clock)?;
            let report = ObjectReport::of(&experiment);
            println!("{}", ObjectTable(std::slice::from_ref(&report)));
            println!("places {:.0}", report.places_per_object);
            println!("live objects {:.2?}", report.live_objects);
            println!("live hypotheses {:.1?}", report.live_hypotheses);
            println!("first choice {:.3?}", report.top1_after);
        }
        Some("touch") => {
            let set = TouchSet::load(Path::new(args.get(1).map_or(".", String::as_str)))?;
            let protocol = TouchProtocol {
                noise: TouchNoise {
                    position_sd_m: number(2, 2.0)? * 1e-3,
                    level_sd: number(3, 0.5)?,
                },
                rotate: Rotate::None,
                is_reach_told: false,
                trials: count(number(4, 20.0)?),
                touches_max: 12,
                sure: 0.998,
                seed: 1,
            };
            let experiment = TouchExperiment::run(&set, &protocol, threads, &|_| {}, &clock)?;
            println!("{}", TouchReport::of(&experiment));
            if let Some(file) = args.get(5) {
                std::fs::write(file, experiment.csv())?;
            }
        }
        _ => return Err("env3 or touch?".into()),
    }
    Ok(())
}
