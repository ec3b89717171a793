//! Robots that contradict themselves, and whatever else valid samples may say.

use cognitive_map::{CognitiveMap, Settings, Status};
use proptest::prelude::*;

use crate::liar::{Liar, Temper};
use crate::sound;
use random::Seeded;

/// Three labels, motions and sightings of at most 5 m, and the noise of a good sensor.
const PRECISE: Temper = Temper {
    labels: 3,
    reach_m: 5.0,
    orders: 0.2,
    is_planar: false,
    is_versatile: false,
};

/// Lets robots lie in turn, and checks the map every so many samples, and its memories at the end.
fn run(
    map: &mut CognitiveMap,
    temper: Temper,
    seed: u64,
    robots: usize,
    samples: usize,
    every: usize,
) -> Result<(), String> {
    let mut random = Seeded(seed);
    let mut liars: Vec<_> = (0..robots).map(|_| Liar::enrol(map, temper)).collect();
    for at in 0..samples {
        let events = liars[at % robots].lie(map, &mut random);
        let events = events.iter().try_for_each(sound::check_event);
        events.map_err(|what| format!("event of sample {at}: {what}"))?;
        if at % every == 0 {
            sound::check(map).map_err(|what| format!("sample {at}: {what}"))?;
        }
    }
    sound::check(map)?;
    sound::check_memory(map)
}

#[test]
fn a_robot_that_contradicts_itself_is_lost_and_its_landmarks_are_set_aside() {
    for (seed, is_planar) in [(1, true), (2, false), (3, false)] {
        let mut map = CognitiveMap::new(Settings::default());
        let temper = Temper {
            is_planar,
            ..PRECISE
        };
        run(&mut map, temper, seed, 1, 3000, 1).unwrap();
        let (id, _) = map.agents().next().unwrap();
        assert_eq!(map.status(id), Some(Status::Lost), "{seed}");
        assert_eq!(map.landmarks().count(), 0, "{seed}");
        assert_eq!(map.landmarks_after(None).count(), 0, "{seed}");
        assert!(map.landmark_by_label("post-0").is_none(), "{seed}");
    }
}

#[test]
fn the_least_and_the_largest_noise_leave_covariances_positive() {
    for (seed, orders, reach_m) in [(1, 7.0, 5.0), (2, 9.0, 1e8), (3, 9.0, 1e3)] {
        let mut map = CognitiveMap::new(Settings::default());
        let temper = Temper {
            orders,
            reach_m,
            is_versatile: true,
            labels: 8,
            ..PRECISE
        };
        run(&mut map, temper, seed, 3, 1000, 1).unwrap();
    }
}

fn tempers() -> impl Strategy<Value = Temper> {
    (1..12u32, -1.0..8.0f64, 0.0..9.0f64, any::<[bool; 2]>()).prop_map(
        |(labels, reach, orders, [is_planar, is_versatile])| Temper {
            labels,
            reach_m: 10_f64.powf(reach),
            orders,
            is_planar,
            is_versatile,
        },
    )
}

// The number of cases is that of PROPTEST_CASES, 256 where it is not set.
proptest! {
    #[test]
    fn whatever_robots_say_numbers_stay_numbers(
        temper in tempers(), seed in any::<u64>(), robots in 1..5usize, samples in 1..250usize,
    ) {
        let mut map = CognitiveMap::new(Settings::default());
        let outcome = run(&mut map, temper, seed, robots, samples, 10);
        prop_assert_eq!(outcome, Ok(()));
    }
}
