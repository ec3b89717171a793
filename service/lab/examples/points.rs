//! Recognition of point clouds: `points DIR [--contacts independent|walk|policy] [--told yes|no]
//! [--learned N] [--noise-mm X] [--noise-deg X] [--trials N] [--leave-out N] [--looks K,K,…]
//! [--seed N]`; one JSON object on stdout.

#![expect(clippy::print_stdout, reason = "the report is what it is run for")]

use std::path::Path;
use std::time::Instant;

use cogmap_lab::points::{Cloud, Exploration, PointsSettings, run};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("which folder?")?;
    let mut settings = PointsSettings::default();
    while let Some(option) = arguments.next() {
        let value = arguments.next().ok_or("an option has a value")?;
        match option.as_str() {
            "--contacts" => {
                settings.exploration = match value.as_str() {
                    "independent" => Exploration::Independent,
                    "walk" => Exploration::Walk,
                    "policy" => Exploration::Policy,
                    _ => return Err("independent, walk or policy".into()),
                }
            }
            "--told" => settings.is_reach_told = value == "yes",
            "--learned" => settings.learned = value.parse()?,
            "--noise-mm" => settings.noise_m = value.parse::<f64>()? / 1e3,
            "--noise-deg" => settings.noise_rad = value.parse::<f64>()?.to_radians(),
            "--trials" => settings.trials = value.parse()?,
            "--leave-out" => settings.leave_out = value.parse()?,
            "--looks" => {
                settings.looks = value.split(',').map(str::parse).collect::<Result<_, _>>()?;
            }
            "--seed" => settings.seed = value.parse()?,
            _ => return Err(format!("no option {option}").into()),
        }
    }
    let clouds = Cloud::load(Path::new(&folder))?;
    let start = Instant::now();
    let report = run(&clouds, &settings, &|| start.elapsed(), &mut |done, of| {
        if done % 39 == 0 {
            eprintln!(
                "{done} of {of} trials, {:.0} s",
                start.elapsed().as_secs_f64()
            );
        }
    });
    println!("{}", serde_json::to_string_pretty(&report)?);
    Ok(())
}
