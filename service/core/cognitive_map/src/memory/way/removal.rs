//! Forgetting of ways and of the places at their ends.

use std::collections::BTreeSet;

use super::bridge::Detour;
use super::{WayMap, tuning};
use crate::memory::ids::PlaceId;

impl WayMap {
    /// A place is forgotten. Where ways lead to it, it stays as a waypoint that goes with the past
    /// by this attachment, which is then this map's; answers whether it does.
    pub(crate) fn keep_forgotten(
        &mut self,
        place: PlaceId,
        attachment: Option<u32>,
        revision: u64,
    ) -> bool {
        let number = self.at(place);
        let waypoint = number.and_then(|number| self.waypoints.get_mut(number, revision));
        waypoint.is_some_and(|waypoint| {
            waypoint.attachment = attachment;
            true
        })
    }

    /// Makes room for one more way: forgets the weakest that is no bridge, by
    /// [`detour`](Self::detour). A bridge is spared and comes into question again once all others
    /// have. Where no way is found that is none, the weakest goes whose search was given up, and
    /// without one the weakest. Answers the attachments of waypoints that went with it.
    pub(crate) fn forget_weakest(&mut self, revision: u64) -> Vec<u32> {
        if self.is_forest {
            let weakest = self.summaries.of_all();
            return weakest.map_or_else(Vec::new, |weakest| self.remove(weakest.way, revision));
        }
        let mut edges = tuning::BRIDGE_EDGES_MAX;
        let mut examined = BTreeSet::new();
        let (mut weakest, mut undecided) = (None, None);
        while edges > 0
            && examined.len() < self.len()
            && let Some(candidate) = self.summaries.of_all()
        {
            let number = candidate.way;
            if !examined.insert(number) {
                // Others were spared before it, and may be no bridges any more.
                edges -= 1;
                self.spare(number, revision);
                continue;
            }
            weakest = weakest.or(Some(number));
            match self.detour(number, &mut edges) {
                Detour::Exists => return self.remove(number, revision),
                Detour::None => self.spare(number, revision),
                Detour::Unknown => {
                    undecided = undecided.or(Some(number));
                    self.spare(number, revision);
                }
            }
        }
        self.is_forest = undecided.is_none() && examined.len() == self.len();
        match undecided.or(weakest) {
            Some(number) => self.remove(number, revision),
            None => Vec::new(),
        }
    }

    /// Puts a way behind all that have not been spared as often.
    fn spare(&mut self, number: u32, revision: u64) {
        if let Some(way) = self.ways.get_mut(number, revision) {
            way.spared = way.spared.saturating_add(1);
            self.spared_max = self.spared_max.max(way.spared);
        }
        self.summarise(number);
    }

    /// Removes a way, and the waypoints that no other way leads to; answers their attachments.
    fn remove(&mut self, number: u32, revision: u64) -> Vec<u32> {
        let Some(way) = self.ways.remove(number, revision) else {
            return Vec::new();
        };
        self.summarise(number);
        let mut attachments = Vec::new();
        for k in [0, 1] {
            let (at, place) = (way.waypoints[k], way.ends[k]);
            let Some(waypoint) = self.waypoints.get_mut(at, revision) else {
                continue;
            };
            if let Ok(rank) = waypoint.rank(way.ends[1 - k]) {
                waypoint.edges.remove(rank);
            }
            if waypoint.edges.is_empty() {
                attachments.extend(waypoint.attachment);
                self.waypoints.remove(at, revision);
                self.of_place.remove(place.0 as usize, revision);
            }
        }
        attachments
    }
}
