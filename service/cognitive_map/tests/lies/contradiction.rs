//! One robot that contradicts itself.

use cognitive_map::{CognitiveMap, Settings};

use crate::liar::{Liar, Temper};
use crate::seeded::Seeded;
use crate::sound;

/// One robot, three labels, motions and sightings of at most 5 m, stated noise that is physical.
const MODEST: Temper = Temper {
    labels: 3,
    reach_m: 5.0,
    orders: 1.0,
    is_planar: true,
    is_versatile: false,
};

fn run(temper: Temper, seed: u64, robots: usize, samples: usize) -> Result<(), String> {
    let mut random = Seeded(seed);
    let mut map = CognitiveMap::new(Settings::default());
    let mut liars: Vec<_> = (0..robots).map(|_| Liar::enrol(&mut map, temper)).collect();
    for at in 0..samples {
        let events = liars[at % robots].lie(&mut map, &mut random);
        let events = events.iter().try_for_each(sound::check_event);
        events.and_then(|()| sound::check(&map)).map_err(|what| format!("sample {at}: {what}"))?;
    }
    sound::check_memory(&map)
}

#[test]
fn survey() {
    for (name, temper, robots) in [
        ("modest", MODEST, 1),
        ("modest 3d", Temper { is_planar: false, ..MODEST }, 1),
        ("spread", Temper { orders: 7.0, ..MODEST }, 1),
        ("far", Temper { orders: 9.0, reach_m: 1e8, is_planar: false, ..MODEST }, 1),
        ("versatile", Temper { is_versatile: true, ..MODEST }, 3),
        ("all", Temper { orders: 9.0, reach_m: 1e8, is_versatile: true, is_planar: false, labels: 8 }, 3),
        ("near exact", Temper { orders: 7.0, is_versatile: true, is_planar: false, labels: 8, reach_m: 5.0 }, 3),
    ] {
        for seed in 1..4 {
            let outcome = run(temper, seed, robots, 3000);
            eprintln!("{name} {seed}: {}", outcome.map_or_else(|e| e.chars().take(200).collect(), |()| "ok".to_string()));
        }
    }
}
