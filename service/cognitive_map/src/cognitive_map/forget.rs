//! Forgetting: room for a new memory is made by the weakest of its kind.

use super::fold::Fold;
use crate::event::EventKind;
use crate::trip::TripEnd;

impl Fold<'_> {
    /// Makes room for one more place: forgets the weakest that no agent holds, if there are as many as
    /// there may be. False when all are held, or there are no more identifiers.
    pub(super) fn make_room_for_place(&mut self) -> bool {
        if !self.places.has_identifiers() {
            return false;
        }
        if self.places.len() < self.settings.places_max as usize {
            return true;
        }
        let Some(place) = self.places.weakest() else {
            return false;
        };
        let Some(forgotten) = self.places.forget(place, self.revision) else {
            return false;
        };
        self.percepts.forget(place, self.revision);
        let position = *forgotten.position();
        self.emit(EventKind::PlaceForgotten { place, position });
        true
    }

    /// Makes room for one more leg: forgets the weakest trip, if there are as many legs as there may be.
    ///
    /// A trip under way is never forgotten. Where no other is left, the agent's own ends and goes, and
    /// the leg begins another one. False when even so there is no room: other agents' trips take all.
    pub(super) fn make_room_for_leg(&mut self) -> bool {
        if self.trips.legs() < self.settings.legs_max as usize {
            return true;
        }
        if self.trips.weakest().is_none() {
            self.close_trip(TripEnd::Full);
        }
        let Some(trip) = self.trips.weakest() else {
            return false;
        };
        let Some(forgotten) = self.trips.forget(trip, self.revision) else {
            return false;
        };
        let legs = forgotten.leg_count();
        self.emit(EventKind::TripForgotten { trip, legs });
        true
    }
}
