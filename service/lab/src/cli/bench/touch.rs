//! `cogmap-lab bench touch`.

use std::time::Instant;

use clap::Args;
use cogmap::cli::{output, quantile};
use cogmap_lab::objects::{EDGE_M, ExplorationNoise, Explorer, VoxelObject};
use nalgebra::Point3;
use object_recognition::{
    Contact, ModelSettings, ObjectId, ObjectLibrary, ObjectModel, Orientation, Recognition,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::Serialize;

use super::touch_fold;

/// Places of an object, at least: those of environment 3 are put together until they have so many.
const PLACES: usize = 1000;
/// Random explorations from an unknown start.
const EPISODES: usize = 25;
/// Touches of each.
const TOUCHES: usize = 12;
/// Touches by which a place is learned.
const TOUCHES_PER_PLACE: usize = 5;
/// Runs of the same episode, of which the least time counts, so that other programs on the machine
/// disturb it little.
const RUNS: usize = 3;
const SEED: u64 = 1;
const NOISE: ExplorationNoise = ExplorationNoise {
    value: 0.1,
    motion: 0.0,
};

#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "flags of a command line")]
pub(in crate::cli) struct TouchArgs {
    /// Numbers of objects.
    #[arg(long, value_delimiter = ',', default_values_t = [10, 30, 100, 300],
        value_parser = clap::value_parser!(u32).range(1..))]
    objects: Vec<u32>,
    /// Objects feel of nothing; otherwise each place has a level, felt with 10 % of noise.
    #[arg(long)]
    plain: bool,
    /// Objects may have made one of 24 turns; otherwise their orientation is known.
    #[arg(long)]
    turned: bool,
    /// Touches are samples of an agent and go through the fold: walks and touches anywhere, on
    /// taught objects and on strangers.
    #[arg(long, conflicts_with = "plain")]
    fold: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    rows: Vec<Row>,
}

/// A touch is timed with its answer, on one thread.
#[derive(Debug, Serialize)]
struct Row {
    objects: u32,
    places: usize,
    us_p50: f64,
    us_p99: f64,
    us_max: f64,
    /// Medians of the first, the second and each further touch.
    us_p50_by_touch: Vec<f64>,
    /// Episodes after which the right object comes first, by touch.
    right: Vec<usize>,
}

pub(super) fn run(args: &TouchArgs) -> anyhow::Result<()> {
    let orientation = if args.turned {
        Orientation::cube()
    } else {
        Orientation::Known
    };
    if args.fold {
        return touch_fold::run(&args.objects, &orientation, args.json);
    }
    let mut rows = Vec::new();
    for &objects in &args.objects {
        output::progress(&format!("{objects} objects"));
        rows.push(row(args, &orientation, objects));
    }
    if args.json {
        return output::json(&Report { rows });
    }
    output::line("objects   places   touch p50 [us]   p99 [us]   max [us]   median of each touch")?;
    for row in &rows {
        output::line(&format!(
            "{:>7} {:>8} {:>16.0} {:>10.0} {:>10.0}   {:.0?}",
            row.objects, row.places, row.us_p50, row.us_p99, row.us_max, row.us_p50_by_touch
        ))?;
        let right = &row.right;
        output::line(&format!("        of {EPISODES} episodes right {right:?}"))?;
    }
    Ok(())
}

fn row(args: &TouchArgs, orientation: &Orientation, count: u32) -> Row {
    let objects = (0..count).map(|number| VoxelObject::with_faces(SEED, number.into(), PLACES));
    let objects: Vec<VoxelObject> = objects.collect();
    let mut library = ObjectLibrary::default();
    for (number, object) in (0..count).zip(&objects) {
        library.put(ObjectId(number), learned(args.plain, object, number));
    }
    library.prepare();
    let mut by_touch = vec![Vec::new(); TOUCHES];
    let mut right = vec![0; TOUCHES];
    for episode in 0..EPISODES {
        let number = episode * objects.len() / EPISODES;
        let contacts = explored(args.plain, &objects[number], episode);
        let mut least = [f64::INFINITY; TOUCHES];
        for run in 0..RUNS {
            let mut recognition = Recognition::new(orientation);
            for (touch, contact) in contacts.iter().enumerate() {
                let contact = contact.clone();
                let begin = Instant::now();
                recognition.touch(&library, contact);
                let posterior = recognition.posterior(&library);
                least[touch] = least[touch].min(begin.elapsed().as_secs_f64() * 1e6);
                let first = posterior.objects.first();
                let is_right = first.is_some_and(|(id, _)| id.0 as usize == number);
                right[touch] += usize::from(run == 0 && is_right);
            }
        }
        for (times, least) in by_touch.iter_mut().zip(least) {
            times.push(least);
        }
    }
    let mut all: Vec<f64> = by_touch.concat();
    Row {
        objects: count,
        places: library.iter().map(|(_, model)| model.places().len()).sum(),
        us_p50: quantile(&mut all, 0.5),
        us_p99: quantile(&mut all, 0.99),
        us_max: quantile(&mut all, 1.0),
        us_p50_by_touch: by_touch
            .iter_mut()
            .map(|times| quantile(times, 0.5))
            .collect(),
        right,
    }
}

/// The contacts of an exploration of an object.
fn explored(is_plain: bool, object: &VoxelObject, episode: usize) -> Vec<Contact> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    random.set_stream((1 << 50) + episode as u64);
    let mut explorer = Explorer::new(object, NOISE, random);
    let mut contacts = Vec::with_capacity(TOUCHES);
    for _ in 0..TOUCHES {
        let felt = explorer.feel();
        contacts.push(contact(is_plain, Point3::from(felt.position_m), felt.level));
        explorer.advance();
    }
    contacts
}

fn learned(is_plain: bool, object: &VoxelObject, number: u32) -> ObjectModel {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    random.set_stream((1 << 51) + u64::from(number));
    let mut model = ObjectModel::new(ModelSettings {
        spacing_m: EDGE_M / 2.0,
        ..ModelSettings::default()
    });
    for _ in 0..TOUCHES_PER_PLACE {
        for face in object.faces() {
            let error: f64 = random.sample(StandardNormal);
            let level = face.level + NOISE.value * error;
            model.learn(&contact(is_plain, face.position_m, level));
        }
    }
    model
}

fn contact(is_plain: bool, position_m: Point3<f64>, level: f64) -> Contact {
    let contact = Contact::at(position_m, 0.05 * EDGE_M);
    if is_plain {
        contact
    } else {
        contact.with_level(0, level, NOISE.value)
    }
}
