//! Forgetting: room for a new memory is made by the weakest of its kind.

use super::apply::Fold;
use crate::event::EventKind;
use crate::memory::trip::TripEnd;

impl Fold<'_> {
    /// Makes room for one more place, if there are as many as there may be: forgets the weakest
    /// that no agent holds, and where all are held, the weakest that this agent does not. Agents
    /// may have gone for good without a word, and must not take the memory with them. False when
    /// this agent holds all, or there are no more identifiers.
    pub(super) fn make_room_for_place(&mut self) -> bool {
        if !self.places.has_identifiers() {
            return false;
        }
        if self.places.len() < self.settings.places_max as usize {
            return true;
        }
        let weakest = self.places.weakest();
        let Some(place) = weakest.or_else(|| self.places.weakest_held(self.held)) else {
            return false;
        };
        let Some(forgotten) = self.places.forget(place, self.revision) else {
            return false;
        };
        self.percepts.forget(place, self.revision);
        let attachment = forgotten.attachment;
        let stays = self.ways.keep_forgotten(place, attachment, self.revision);
        if let Some(attachment) = attachment.filter(|_| !stays) {
            self.keyframes.graph.detach_place(attachment);
        }
        let position = *forgotten.position();
        self.emit(EventKind::PlaceForgotten { place, position });
        true
    }

    /// Makes room for one more leg, if there are as many as there may be: forgets the weakest trip
    /// that has ended, and where none has, the one under way that began first. That is this agent's
    /// own, which ends then, or that of an agent that may have gone for good without a word. False
    /// without any trip.
    pub(super) fn make_room_for_leg(&mut self) -> bool {
        if self.trips.legs() < self.settings.legs_max as usize {
            return true;
        }
        let weakest = self.trips.weakest();
        let Some(trip) = weakest.or_else(|| self.trips.first_under_way()) else {
            return false;
        };
        if self.agent.recorder.trip == Some(trip) {
            self.close_trip(TripEnd::Full);
        }
        let Some(forgotten) = self.trips.forget(trip, self.revision) else {
            return false;
        };
        let legs = forgotten.leg_count();
        self.emit(EventKind::TripForgotten { trip, legs });
        true
    }
}
