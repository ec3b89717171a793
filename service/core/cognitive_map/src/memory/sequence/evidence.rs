//! What an element of a sequence says about each place.

use crate::memory::ids::PlaceId;

/// How much likelier each place makes an element of a sequence than a place drawn at random does.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Evidence {
    /// By place.
    ratios: Vec<(PlaceId, f64)>,
    /// Of all other places.
    floor: f64,
}

impl Evidence {
    /// Of an element that is one of `candidates`, each with its weight, unless it is wrong, which
    /// it is with probability `error_rate`: then it is any of `n_places`. Without candidates it
    /// says nothing.
    ///
    /// ```text
    /// P(element | place) / P(element) = (1 − ε) N w(place) / Σ w + ε
    /// ```
    pub(crate) fn new(
        candidates: impl IntoIterator<Item = (PlaceId, f64)>,
        error_rate: f64,
        n_places: usize,
    ) -> Self {
        let mut ratios: Vec<_> = candidates.into_iter().collect();
        ratios.retain(|(_, weight)| *weight > 0.0);
        ratios.sort_unstable_by_key(|(place, _)| *place);
        ratios.dedup_by_key(|(place, _)| *place);
        let sum: f64 = ratios.iter().map(|(_, weight)| weight).sum();
        let factor = (1.0 - error_rate) * n_places as f64 / sum;
        // No numbers, or none that can be divided by.
        if !(factor.is_finite() && factor > 0.0) {
            let (ratios, floor) = (Vec::new(), 1.0);
            return Self { ratios, floor };
        }
        for (_, ratio) in &mut ratios {
            *ratio = *ratio * factor + error_rate;
        }
        Self {
            ratios,
            floor: error_rate,
        }
    }

    /// The places that it speaks for.
    pub(super) fn places(&self) -> impl Iterator<Item = PlaceId> {
        self.ratios.iter().map(|(place, _)| *place)
    }

    /// How much it speaks for a place.
    pub(super) fn of(&self, place: PlaceId) -> f64 {
        let rank = self
            .ratios
            .binary_search_by_key(&place, |(place, _)| *place);
        rank.map_or(self.floor, |rank| self.ratios[rank].1)
    }

    /// How much it speaks for any place that it does not know.
    pub(super) fn floor(&self) -> f64 {
        self.floor
    }
}
