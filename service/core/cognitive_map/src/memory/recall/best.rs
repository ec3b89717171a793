//! The best few of many scored places.

use crate::memory::ids::PlaceId;

/// The best places so far, best first, equally good ones by identifier.
#[derive(Debug)]
pub(super) struct Best {
    limit: usize,
    ranked: Vec<(PlaceId, f64)>,
}

impl Best {
    /// None yet, and never more than `limit`.
    pub(super) fn new(limit: usize) -> Self {
        Self {
            limit,
            ranked: Vec::new(),
        }
    }

    /// The score that the next place needs at least to get among them; `floor` as long as there is
    /// room for any.
    pub(super) fn least(&self, floor: f64) -> f64 {
        match self.ranked.last() {
            Some((_, score)) if self.is_full() => score.max(floor),
            _ => floor,
        }
    }

    /// Whether there are as many as asked for.
    pub(super) fn is_full(&self) -> bool {
        self.ranked.len() >= self.limit
    }

    /// Puts a place where it belongs, if that is among the best. A place that is there stays once.
    pub(super) fn offer(&mut self, place: PlaceId, score: f64) {
        let before =
            |other: &(PlaceId, f64)| other.1 > score || (other.1 >= score && other.0 < place);
        let rank = self.ranked.partition_point(before);
        let there = self.ranked.get(rank).is_some_and(|other| other.0 == place);
        if rank < self.limit && !there {
            self.ranked.truncate(self.limit - 1);
            self.ranked.insert(rank, (place, score));
        }
    }

    /// The places with their scores, in order.
    pub(super) fn into_ranked(self) -> Vec<(PlaceId, f64)> {
        self.ranked
    }
}
