//! Recall by code against a scan over all places.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::by_code::CodeRecall;
use super::*;
use crate::memory::strength::Clock;
use grid::{Phase, similarity};

/// A space with places at these positions, founded by two agents in turn, one a second.
struct World {
    settings: Settings,
    modules: GridModules,
    places: PlaceMap,
}

impl World {
    fn of(positions: impl IntoIterator<Item = Point3<f64>>) -> Self {
        let settings = Settings::default();
        let mut places = PlaceMap::new(&settings);
        for (position, stamp) in positions.into_iter().zip(0u32..) {
            let (rotation, sd_m) = (UnitQuaternion::identity(), Vector3::zeros());
            let (founder, now) = (AgentId(stamp % 2), Clock::at(1, &settings));
            let place = Place::found(position, rotation, sd_m, founder, stamp.into(), now);
            places.recruit(place, 1).unwrap();
        }
        Self {
            modules: GridModules::new(&settings.grid()),
            settings,
            places,
        }
    }

    /// Forgets the places of these indices, one after the other.
    fn without(mut self, forgotten: &[prop::sample::Index]) -> Self {
        for index in forgotten {
            let left: Vec<_> = self.places.ids().collect();
            if let Some(id) = left.get(index.index(left.len().max(1))) {
                self.places.forget(*id, 2).unwrap();
            }
        }
        self
    }

    fn recall(&self, cue: &RecallCue) -> Vec<Recalled> {
        let percepts = PerceptMap::default();
        recall(cue, &self.places, &percepts, &self.modules, &self.settings)
    }

    fn rivals(&self, cue: &RecallCue, best: &Recalled) -> Option<Rivals> {
        rivals(cue, best, &self.places, &self.modules, &self.settings)
    }

    /// All places that pass the filters, by a scan.
    fn scan(&self, cue: &RecallCue) -> Vec<(PlaceId, f64)> {
        let code = cue.code.as_ref().unwrap();
        let places = self.places.iter().filter(|(_, place)| {
            cue.founder.is_none_or(|founder| place.founder() == founder)
                && cue
                    .since_ns
                    .is_none_or(|since| place.last_stamp_ns() >= since)
                && cue
                    .until_ns
                    .is_none_or(|until| place.first_stamp_ns() < until)
        });
        let mut scored: Vec<_> = places
            .map(|(id, place)| {
                (
                    id,
                    similarity::kernel(&self.modules, code, &place.code(&self.modules)),
                )
            })
            .collect();
        scored.sort_by(|a, b| b.1.total_cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
        scored
    }

    /// The code of a position, with noise \[turns\] on the phases, of the known modules.
    fn code(&self, at: &Point3<f64>, noise: &[[f64; 3]], known: &[bool]) -> PartialCode {
        let code = self.modules.code_at(at);
        let phases = code.phases().iter().zip(noise).zip(known);
        let phases = phases.map(|((phase, noise), known)| {
            known.then(|| Phase::wrap(phase.turns() + Vector3::from(*noise)))
        });
        PartialCode::new(&self.modules, phases.collect()).unwrap()
    }
}

fn cue(code: PartialCode, limit: usize) -> RecallCue {
    RecallCue {
        position: None,
        code: Some(code),
        percept: None,
        radius_m: None,
        founder: None,
        since_ns: None,
        until_ns: None,
        limit,
    }
}

/// A source of random numbers that is the same on every run.
struct Seeded(u64);

impl Seeded {
    fn uniform(&mut self) -> f64 {
        self.0 += 1;
        random::uniform(5, [0, 0, self.0])
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }

    fn vector(&mut self, sd: f64) -> [f64; 3] {
        [(); 3].map(|()| self.normal() * sd)
    }

    fn index(&mut self, len: usize) -> usize {
        let len = u32::try_from(len).unwrap();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "below len"
        )]
        let index = (self.uniform() * f64::from(len)) as usize;
        index
    }
}

/// Clouds of places: in a box, on a plane, on a coarse lattice (equal positions and equal
/// distances), in a far corner of the world, in one heap.
fn clouds() -> impl Strategy<Value = Vec<Point3<f64>>> {
    let unit = prop::array::uniform3(-1.0..1.0f64);
    let shape = prop::sample::select(vec![
        ([1.0, 1.0, 1.0], 0.0, 0.0),
        ([8.0, 8.0, 8.0], 0.0, 0.0),
        ([30.0, 30.0, 0.0], 0.0, 0.0),
        ([2.0, 2.0, 2.0], 0.5, 0.0),
        ([5.0, 5.0, 1.0], 0.0, 4e4),
        ([0.1, 0.1, 0.1], 0.0, -300.0),
        ([9e4, 2.0, 2.0], 0.0, 0.0),
    ]);
    (prop::collection::vec(unit, 1..300), shape).prop_map(|(units, (half, step, shift))| {
        let place = |unit: [f64; 3]| {
            let at = Vector3::from(unit).component_mul(&Vector3::from(half));
            let at = if step > 0.0 {
                at.map(|x| (x / step).round() * step)
            } else {
                at
            };
            Point3::from(at.add_scalar(shift))
        };
        units.into_iter().map(place).collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn equals_the_exhaustive_scan(
        positions in clouds(),
        chosen in any::<prop::sample::Index>(),
        shift in prop::array::uniform3(-1.0..1.0f64),
        reach_m in prop::sample::select(vec![0.0, 0.05, 0.2, 5.0]),
        noise in prop::array::uniform6(prop::array::uniform3(-1.0..1.0f64)),
        sd in prop::sample::select(vec![0.0, 0.02, 0.08, 0.5]),
        known in prop::array::uniform6(prop::bool::weighted(0.8)),
        limit in prop::sample::select(vec![1usize, 1, 2, 5, 40, 1000]),
        founder in prop::option::weighted(0.3, 0u32..3),
        since_ns in prop::option::weighted(0.3, 0i64..300),
        until_ns in prop::option::weighted(0.3, 0i64..300),
        forgotten in prop::collection::vec(any::<prop::sample::Index>(), 0..200),
    ) {
        prop_assume!(known.contains(&true));
        let at = chosen.get(&positions) + Vector3::from(shift) * reach_m;
        let world = World::of(positions).without(&forgotten);
        let code = world.code(&at, &noise.map(|noise| noise.map(|x| x * sd)), &known);
        let cue = RecallCue {
            founder: founder.map(AgentId),
            since_ns,
            until_ns,
            ..cue(code, limit)
        };
        let scan = world.scan(&cue);
        let recalled = world.recall(&cue);
        let found: Vec<_> = recalled.iter().map(|r| (r.place, r.cosine.unwrap())).collect();
        prop_assert_eq!(&found[..], &scan[..limit.min(scan.len())]);

        let Some(best) = recalled.first() else { return Ok(()) };
        let position = |id| *world.places.get(id).unwrap().position();
        let here = position(best.place);
        let mut elsewhere = scan.iter().filter(|(id, cosine)| {
            *cosine >= scan[0].1 - 0.05 && (position(*id) - here).norm() > 0.25
        });
        let count = elsewhere.clone().count();
        let expected = elsewhere.next().map(|&(place, cosine)| Rivals {
            count,
            place,
            cosine,
            distance_m: (position(place) - here).norm(),
        });
        prop_assert_eq!(world.rivals(&cue, best), expected);
    }
}

/// A hundred thousand places in a cube of 15 m, about as close as the rule of novelty lets them be.
fn crowded() -> (World, Vec<Point3<f64>>) {
    let mut random = Seeded(1);
    let positions: Vec<_> = (0..47_u32.pow(3))
        .map(|cell| {
            let at = [cell % 47, cell / 47 % 47, cell / 47 / 47].map(f64::from);
            let shift = [(); 3].map(|()| random.uniform() * 0.06);
            Point3::from(Vector3::from(at) * 0.32 + Vector3::from(shift))
        })
        .collect();
    (World::of(positions.iter().copied()), positions)
}

const WHOLE: [bool; 6] = [true; 6];

#[test]
fn the_right_place_of_a_hundred_thousand_wins_by_a_damaged_code() {
    let (world, positions) = crowded();
    let mut random = Seeded(1 << 32);
    let still = [[0.0; 3]; 6];
    let mut right = 0;
    for _ in 0..1000 {
        let id = random.index(positions.len());
        let noise = still.map(|_| random.vector(0.05));
        let best = world.recall(&cue(world.code(&positions[id], &noise, &WHOLE), 1))[0];
        right += u32::from(best.place.0 as usize == id);
    }
    assert!(right >= 990, "{right} of 1000 right with 5 % noise");
    for first in 0..6 {
        for second in 0..first {
            let mut known = WHOLE;
            (known[first], known[second]) = (false, false);
            for _ in 0..20 {
                let id = random.index(positions.len());
                let best = world.recall(&cue(world.code(&positions[id], &still, &known), 1))[0];
                assert_eq!(best.place.0 as usize, id, "without {first} and {second}");
            }
        }
    }
}

/// Work is counted in places that are looked at, so that the test does not depend on the machine.
#[test]
fn the_work_does_not_grow_with_the_number_of_places() {
    let (crowded, positions) = crowded();
    let few = World::of(positions.iter().copied().take(2000));
    let mut looked_at = [0, 0];
    let mut random = Seeded(1 << 33);
    for _ in 0..300 {
        let id = random.index(2000);
        let at = positions[id] + Vector3::from(random.vector(0.05));
        for (world, count) in [&few, &crowded].into_iter().zip(&mut looked_at) {
            let cue = cue(world.code(&at, &[[0.0; 3]; 6], &WHOLE), 1);
            let asked = Asked {
                cue: &cue,
                places: &world.places,
                modules: &world.modules,
                settings: &world.settings,
            };
            let recall = CodeRecall::new(&asked, cue.code.as_ref().unwrap());
            let mut best = 0.85_f64;
            let searched = recall.search(best, |place, _| {
                *count += 1;
                best = best.max(recall.cue.kernel_at(place.position(), 0.0).unwrap());
                best
            });
            assert!(searched);
        }
    }
    assert!(looked_at[1] < 300 * 10, "{looked_at:?}");
    assert!(looked_at[1] < 2 * looked_at[0], "{looked_at:?}");
}

#[test]
fn two_places_with_one_code_are_rivals() {
    // One known module: its lattice repeats one basis vector on.
    let modules = GridModules::new(&Settings::default().grid());
    let here = Point3::new(0.3, -0.2, 0.1);
    let there = here + modules.lattices()[5].basis().column(0);
    let world = World::of([here, there, Point3::new(0.5, 0.9, 0.0)]);
    let alone = [false, false, false, false, false, true];
    let ambiguous = cue(world.code(&here, &[[0.0; 3]; 6], &alone), 1);
    let best = world.recall(&ambiguous)[0];
    let rivals = world.rivals(&ambiguous, &best).unwrap();
    assert_eq!(rivals.count, 1);
    let spacing_m = modules.lattices()[5].spacing_m();
    assert!((rivals.distance_m - spacing_m).abs() < 1e-9, "{rivals:?}");
    let whole = cue(world.code(&here, &[[0.0; 3]; 6], &WHOLE), 1);
    let best = world.recall(&whole)[0];
    assert_eq!(
        (best.place, world.rivals(&whole, &best)),
        (PlaceId(0), None)
    );
}
