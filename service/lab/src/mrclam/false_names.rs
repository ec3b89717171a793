//! Sightings under another name, as when a barcode is misread.

use std::collections::BTreeSet;

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::data_set::Mrclam;

impl Mrclam {
    /// Gives this share of the sightings, from 0 to 1, the name of another subject that is seen in
    /// the set, drawn by the seed. Nobody sees itself.
    pub fn confuse(&mut self, share: f64, seed: u64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let logs = self.robots().values();
        let seen = logs.flat_map(|log| log.measurements.iter().map(|seen| seen.subject));
        let subjects: BTreeSet<u32> = seen.collect();
        for (&robot, log) in self.robots_mut() {
            for seen in &mut log.measurements {
                if random.random::<f64>() >= share {
                    continue;
                }
                let is_other = |subject: &u32| *subject != robot && *subject != seen.subject;
                let others: Vec<u32> = subjects.iter().copied().filter(is_other).collect();
                seen.subject = others.choose(&mut random).copied().unwrap_or(seen.subject);
            }
        }
    }
}
