//! Walks over a lattice.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::SequenceProtocol;

/// Probability of a turn at a place.
const TURN: f64 = 0.3;

/// The places of each trip, as column and row: each walk begins anywhere, mostly goes straight on,
/// and never turns back at once but in a corner.
pub fn walks(protocol: &SequenceProtocol) -> Vec<Vec<[i32; 2]>> {
    let mut random = ChaCha8Rng::seed_from_u64(protocol.seed);
    let edge = i32::try_from(protocol.edge).unwrap_or(i32::MAX);
    let is_inside = |at: [i32; 2]| at.iter().all(|along| (0..edge).contains(along));
    let walk = |_| {
        let mut at = [(); 2].map(|()| random.random_range(0..edge));
        let mut heading = [[1, 0], [0, 1], [-1, 0], [0, -1]][random.random_range(0..4)];
        let mut walk = vec![at];
        for _ in 0..protocol.legs {
            let sides = [[-heading[1], heading[0]], [heading[1], -heading[0]]];
            let side = sides[random.random_range(0..2)];
            let other = [-side[0], -side[1]];
            let back = [-heading[0], -heading[1]];
            let wanted = if random.random_bool(TURN) {
                [side, heading, other, back]
            } else {
                [heading, side, other, back]
            };
            let to = |way: [i32; 2]| [at[0] + way[0], at[1] + way[1]];
            heading = wanted
                .into_iter()
                .find(|way| is_inside(to(*way)))
                .unwrap_or(back);
            at = to(heading);
            walk.push(at);
        }
        walk
    };
    (0..protocol.trips).map(walk).collect()
}
