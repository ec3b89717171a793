//! What another map has had is taken in.

use super::CognitiveMap;
use crate::input::{RememberedPlace, RememberedWay, Remembrance};
use crate::memory::place::{Place, PlaceId};
use crate::memory::strength::Clock;

impl CognitiveMap {
    /// Takes in a place or a way. Who founded a place must have been enrolled before it, and the
    /// places of a way must have come before the way, but for those that the other map has
    /// forgotten. What is there already, or exceeds a budget, has no effect.
    pub(super) fn remember(&mut self, remembrance: &Remembrance) {
        match remembrance {
            Remembrance::Place(place) => self.remember_place(place),
            Remembrance::Way(way) => self.remember_way(way),
        }
    }

    fn remember_place(&mut self, was: &RememberedPlace) {
        let is_new = was.place.0 as usize >= self.places.places().next_index();
        let has_room = self.places.len() < self.settings.places_max as usize;
        let is_founded = self.agent(was.founder).is_some();
        if !is_new || !has_room || !is_founded || was.place.0 == u32::MAX {
            return;
        }
        self.revision += 1;
        // Nobody is to define the frame anew: the places lie in it.
        self.is_map_defined = true;
        let place = Place::remembered(was, Clock::at(self.revision, &self.settings));
        self.places.skip_to(was.place.0 as usize);
        self.places.recruit(place, self.revision);
    }

    fn remember_way(&mut self, was: &RememberedWay) {
        let [first, second] = was.ends;
        let is_new = first < second && self.ways.between(first, second).is_none();
        let has_room = self.ways.len() < self.settings.ways_max as usize;
        // A number beyond all places is that of a place which the other map has forgotten.
        let is_known = |place: PlaceId| {
            self.place(place).is_some()
                || self.is_forgotten_place(place)
                || place.0 as usize >= self.places.places().next_index()
        };
        if !is_new || !has_room || second.0 == u32::MAX || !was.ends.into_iter().all(is_known) {
            return;
        }
        self.revision += 1;
        self.is_map_defined = true;
        // No place to come gets the number of a forgotten one.
        self.places.skip_to(second.0 as usize + 1);
        let now = Clock::at(self.revision, &self.settings);
        let places = was.ends.map(|end| self.places.get(end).map(Place::pose));
        let mut was = was.clone();
        for (pose, place) in was.poses.iter_mut().zip(places) {
            *pose = place.unwrap_or(*pose);
        }
        self.ways.remember(&was, now, self.revision);
    }
}
