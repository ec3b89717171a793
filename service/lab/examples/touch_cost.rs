//! What a touch costs when the orientation is known, or one of a few, by the number of objects
//! learned.
//!
//! ```sh
//! cargo run --release -p cogmap-lab --example touch_cost -- 10,30,100,300 coloured
//! cargo run --release -p cogmap-lab --example touch_cost -- 100 plain
//! cargo run --release -p cogmap-lab --example touch_cost -- 10,100 coloured 24
//! ```
//!
//! Objects are those of environment 3, put together until they have 1,000 places, each learned from
//! five touches; levels are felt with 10 % of noise, and on `plain` objects not at all. Each of 25
//! episodes is a random exploration of twelve touches from an unknown start. A touch is timed with
//! its answer, on one thread; of three runs of the same episode the least time counts, so that
//! other programs on the machine do so little.

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

use std::error::Error;
use std::time::Instant;

use cogmap_lab::objects::{EDGE_M, ExplorationNoise, Explorer, VoxelObject};
use nalgebra::Point3;
use object_recognition::{
    Contact, ModelSettings, ObjectId, ObjectLibrary, ObjectModel, Orientation, Recognition,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const PLACES: usize = 1000;
const EPISODES: usize = 25;
const TOUCHES: usize = 12;
const TOUCHES_PER_PLACE: usize = 5;
const RUNS: usize = 3;
const SEED: u64 = 1;
const NOISE: ExplorationNoise = ExplorationNoise {
    value: 0.1,
    motion: 0.0,
};

/// Whether surfaces feel of anything.
#[derive(Clone, Copy, PartialEq)]
enum World {
    Coloured,
    Plain,
}

/// The world that an argument asks for.
fn world(argument: Option<&str>) -> World {
    match argument {
        Some("plain") => World::Plain,
        _ => World::Coloured,
    }
}

/// The contacts of an exploration of an object.
fn explored(world: World, object: &VoxelObject, episode: usize) -> Vec<Contact> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    random.set_stream((1 << 50) + episode as u64);
    let mut explorer = Explorer::new(object, NOISE, random);
    let mut contacts = Vec::with_capacity(TOUCHES);
    for _ in 0..TOUCHES {
        let felt = explorer.feel();
        contacts.push(contact(world, Point3::from(felt.position_m), felt.level));
        explorer.advance();
    }
    contacts
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let counts = args.first().map_or("10,30,100,300", String::as_str);
    let world = world(args.get(1).map(String::as_str));
    let orientation = match args.get(2).map(String::as_str) {
        Some("24") => Orientation::cube(),
        _ => Orientation::Known,
    };
    println!("objects   places   touch p50 [us]   p99 [us]   max [us]   median of each touch [us]");
    for count in counts.split(',') {
        let count: u32 = count.parse()?;
        let objects: Vec<VoxelObject> = (0..count)
            .map(|number| VoxelObject::with_faces(SEED, number.into(), PLACES))
            .collect();
        let mut library = ObjectLibrary::default();
        for (number, object) in (0..count).zip(&objects) {
            library.put(ObjectId(number), learned(world, object, number));
        }
        let places: usize = library.iter().map(|(_, model)| model.places().len()).sum();
        let mut by_touch = vec![Vec::new(); TOUCHES];
        let mut right = [0_usize; TOUCHES];
        let mut sure = [0_usize; TOUCHES];
        for episode in 0..EPISODES {
            let number = episode * objects.len() / EPISODES;
            let contacts = explored(world, &objects[number], episode);
            let mut least = [f64::INFINITY; TOUCHES];
            for run in 0..RUNS {
                let mut recognition = Recognition::new(&orientation);
                for (touch, contact) in contacts.iter().enumerate() {
                    let contact = contact.clone();
                    let begin = Instant::now();
                    recognition.touch(&library, contact);
                    let posterior = recognition.posterior(&library);
                    least[touch] = least[touch].min(begin.elapsed().as_secs_f64() * 1e6);
                    let own = |entry: &&(ObjectId, f64)| entry.0.0 as usize == number;
                    if run == 0 {
                        right[touch] +=
                            usize::from(posterior.objects.first().is_some_and(|first| own(&first)));
                        let own = posterior.objects.iter().find(own);
                        sure[touch] += usize::from(own.is_some_and(|own| own.1 > 0.99));
                    }
                }
            }
            for (times, least) in by_touch.iter_mut().zip(least) {
                times.push(least);
            }
        }
        let mut all: Vec<f64> = by_touch.concat();
        let medians: Vec<f64> = by_touch
            .iter_mut()
            .map(|times| quantile(times, 0.5))
            .collect();
        println!(
            "{count:>7} {places:>8} {:>16.0} {:>10.0} {:>10.0}   {medians:.0?}",
            quantile(&mut all, 0.5),
            quantile(&mut all, 0.99),
            quantile(&mut all, 1.0),
        );
        println!("        of {EPISODES} episodes right {right:?}, sure and right {sure:?}");
    }
    Ok(())
}

fn learned(world: World, object: &VoxelObject, number: u32) -> ObjectModel {
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
            model.learn(&contact(world, face.position_m, level));
        }
    }
    model
}

fn contact(world: World, position_m: Point3<f64>, level: f64) -> Contact {
    let contact = Contact::at(position_m, 0.05 * EDGE_M);
    match world {
        World::Coloured => contact.with_level(0, level, NOISE.value),
        World::Plain => contact,
    }
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the place of a share of a length"
    )]
    let at = (values.len().saturating_sub(1) as f64 * share).round() as usize;
    values.get(at).copied().unwrap_or(0.0)
}
