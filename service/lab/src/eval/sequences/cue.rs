//! Cues, and an exhaustive comparison with all trips.

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::SequenceProtocol;

/// A cue and what came next.
#[derive(Clone, Debug)]
pub struct Cue {
    /// The places, some of them wrong.
    pub places: Vec<u64>,
    /// What came next; `None` at the end of a trip, and where nobody travelled this.
    pub next: Option<u64>,
    /// Whether a comparison with all trips leaves one place only that may come next.
    pub is_unique: bool,
}

/// Draws cues from trips.
#[derive(Debug)]
pub struct Cues<'a> {
    protocol: &'a SequenceProtocol,
    trips: &'a [Vec<u64>],
    places: Vec<u64>,
    random: ChaCha8Rng,
}

impl<'a> Cues<'a> {
    /// From trips, each the places that it led through.
    pub fn new(protocol: &'a SequenceProtocol, trips: &'a [Vec<u64>]) -> Self {
        let mut places = trips.concat();
        places.sort_unstable();
        places.dedup();
        Self {
            protocol,
            trips,
            places,
            random: ChaCha8Rng::seed_from_u64(protocol.seed.wrapping_add(1)),
        }
    }

    /// Number of places that some trip leads through.
    pub fn n_places(&self) -> usize {
        self.places.len()
    }

    fn any_place(&mut self) -> u64 {
        self.places.choose(&mut self.random).copied().unwrap_or(0)
    }

    /// The next cue.
    pub fn draw(&mut self) -> Cue {
        let length = self.protocol.length as usize;
        if self.random.random_bool(self.protocol.none) {
            let places = (0..length).map(|_| self.any_place()).collect();
            return self.cue(places, None);
        }
        let n_positions: usize = self.trips.iter().map(Vec::len).sum();
        let mut position = self.random.random_range(0..n_positions);
        let mut trips = self.trips.iter();
        let trip = trips.find(|trip| {
            let is_here = position < trip.len();
            position -= if is_here { 0 } else { trip.len() };
            is_here
        });
        let trip: &[u64] = trip.map_or(&[], Vec::as_slice);
        let first = (position + 1).saturating_sub(length);
        let travelled = trip[first..=position].to_vec();
        let noisy = travelled.into_iter().map(|place| {
            let is_wrong = self.random.random_bool(self.protocol.error_rate);
            if is_wrong { self.any_place() } else { place }
        });
        let places = noisy.collect();
        self.cue(places, trip.get(position + 1).copied())
    }

    fn cue(&self, places: Vec<u64>, next: Option<u64>) -> Cue {
        let is_unique = self.is_unique(&places);
        Cue {
            places,
            next,
            is_unique,
        }
    }

    /// Whether the parts of trips with the fewest wrong places are all followed by the same place.
    fn is_unique(&self, cue: &[u64]) -> bool {
        let mut fewest = cue.len();
        let mut followers: Vec<Option<u64>> = Vec::new();
        for trip in self.trips {
            for end in 0..trip.len() {
                let pairs = cue.iter().rev().zip(trip[..=end].iter().rev());
                let right = pairs.filter(|(a, b)| a == b).count();
                let wrong = cue.len() - right;
                if wrong < fewest {
                    (fewest, followers) = (wrong, Vec::new());
                }
                if wrong == fewest && right > 0 {
                    followers.push(trip.get(end + 1).copied());
                }
            }
        }
        followers.dedup();
        followers.len() == 1
    }
}
