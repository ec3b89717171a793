//! Distances by way of a wall.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::data_set::TableSet;
use super::row::RowBody;

/// By how much a reflected distance is too long \[m\].
const REFLECTED_M: f64 = 15.0;

impl TableSet {
    /// Makes this share of the distances 15 m too long, drawn by the seed, from 0 to 1.
    pub fn reflect(&mut self, share: f64, seed: u64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let rows = self.agents.values_mut().flat_map(|log| &mut log.rows);
        for row in rows {
            if let RowBody::Range(_, range_m, _) = &mut row.body
                && random.random::<f64>() < share
            {
                *range_m += REFLECTED_M;
            }
        }
    }
}
