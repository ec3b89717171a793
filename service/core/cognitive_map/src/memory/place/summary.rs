//! What is known of places together: where they lie, and which of them may go first.

use super::Place;
use crate::memory::ids::PlaceId;
use crate::memory::strength::Strength;
use grid::Extent;
use state::Summary;

/// The box and the weakest of some places.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlaceSummary {
    pub(super) extent: Extent,
    /// The weakest one that nobody holds, the lowest identifier of equally weak ones; none if all
    /// are held.
    pub(super) weakest: Option<(Strength, PlaceId)>,
}

impl PlaceSummary {
    /// That of one place.
    pub(super) fn of(id: PlaceId, place: &Place, held: bool) -> Self {
        Self {
            extent: Extent::of(&place.position),
            weakest: (!held).then_some((place.strength, id)),
        }
    }
}

impl Summary for PlaceSummary {
    fn merge(&mut self, other: &Self) {
        self.extent.merge(&other.extent);
        self.weakest = match (self.weakest, other.weakest) {
            (Some(a), Some(b)) => Some(if a.0.cmp(b.0).then(a.1.cmp(&b.1)).is_le() {
                a
            } else {
                b
            }),
            (a, b) => a.or(b),
        };
    }
}
