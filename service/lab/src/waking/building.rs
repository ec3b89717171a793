//! Rooms that look alike.

use nalgebra::Vector3;
use rand::{Rng, RngExt};

use cogmap_worlds::Scenery;

/// Numbers of a view.
const VIEW_NUMBERS: usize = 64;
/// Rooms stand so far apart \[m\]: nobody goes from one to another.
const APART_M: f64 = 100.0;
/// From this height on each room has a look of its own, as a share of its edge.
const OWN_LOOK: f64 = 0.6;

/// Rooms that look alike up to a height, and different above.
#[derive(Clone, Debug)]
pub struct Building {
    shared: Scenery,
    own: Vec<Scenery>,
    side_m: f64,
}

impl Building {
    /// So many rooms of a seed.
    pub fn new(seed: u64, rooms: u32, side_m: f64) -> Self {
        let own = (1..=u64::from(rooms)).map(|room| {
            let seed = seed.wrapping_mul(1_000_003).wrapping_add(room);
            Scenery::new(seed, VIEW_NUMBERS)
        });
        Self {
            shared: Scenery::new(seed, VIEW_NUMBERS),
            own: own.collect(),
            side_m,
        }
    }

    /// Where a room's corner is in the map \[m\].
    pub fn corner_m(&self, room: usize) -> Vector3<f64> {
        Vector3::new(APART_M * room as f64, 0.0, 0.0)
    }

    /// Height from which on a room is told from the others \[m\]; 0 where there is but one.
    pub fn told_from_m(&self) -> f64 {
        if self.own.len() > 1 {
            OWN_LOOK * self.side_m
        } else {
            0.0
        }
    }

    /// The view from a position in a room \[m\], with noise of a length that is on average `noise`
    /// of the view's; `wrong` says with what probability it is one of somewhere else.
    pub fn view(
        &self,
        room: usize,
        from_m: &Vector3<f64>,
        noise: f64,
        wrong: f64,
        random: &mut impl Rng,
    ) -> Vec<f32> {
        let is_wrong = random.random_bool(wrong);
        let elsewhere = Vector3::from_fn(|_, _| random.random_range(1e3..1e4));
        let from_m = if is_wrong { &elsewhere } else { from_m };
        let is_own = self.own.len() > 1 && from_m.z >= self.told_from_m();
        let scenery = match self.own.get(room) {
            Some(own) if is_own => own,
            _ => &self.shared,
        };
        scenery.view(from_m, noise, random)
    }
}
