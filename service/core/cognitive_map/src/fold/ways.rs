//! Ways: what the legs add up to.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3};
use state::{CorruptState, StateWriter};

use super::apply::Fold;
use super::checkpoint::{WAY_HEAD, WAYPOINTS, WAYS, page_of};
use super::{CheckpointPage, CognitiveMap, CorruptCheckpoint};
use crate::memory::place::{Place, PlaceId};
use crate::memory::trip::{Leg, TripId};
use crate::memory::way::Traversal;

impl Fold<'_> {
    /// The way of a leg was travelled, which began at `start` in the frame of its first place.
    pub(super) fn travel(
        &mut self,
        leg: &Leg,
        start: &Isometry3<f64>,
        recorded: Option<(TripId, u32)>,
    ) {
        let (from, to) = (self.place_pose(leg.from()), self.place_pose(leg.to()));
        // A place that the agent held may have been forgotten in between, with its last way.
        let (Some(from), Some(to)) = (from, to) else {
            return;
        };
        let positions = [&from, &to].map(|end| Point3::from(end.translation.vector));
        self.end_blockages_between((leg.from(), &positions[0]), (leg.to(), &positions[1]));
        let end = to.inv_mul(self.agent.announced.in_map());
        let mut traversal = Traversal::of(leg, start, &end, self.stamp_ns);
        traversal.leg = recorded;
        self.make_room_for_way(leg.from(), leg.to());
        let poses = if leg.from() < leg.to() {
            [&from, &to]
        } else {
            [&to, &from]
        };
        self.ways.travel(&traversal, poses, self.now, self.revision);
    }

    /// Where a place is, also a forgotten one that ways lead to.
    fn place_pose(&self, place: PlaceId) -> Option<Isometry3<f64>> {
        let remembered = self.places.get(place).map(Place::pose);
        remembered.or_else(|| {
            let waypoint = self.ways.waypoint(self.ways.at(place)?)?;
            Some(*waypoint.pose())
        })
    }

    /// Makes room for the way between two places, if there is none yet and there are as many as
    /// there may be.
    fn make_room_for_way(&mut self, from: PlaceId, to: PlaceId) {
        let is_new = self.ways.between(from, to).is_none();
        if !is_new || self.ways.len() < self.settings.ways_max as usize {
            return;
        }
        for attachment in self.ways.forget_weakest(self.revision) {
            self.keyframes.graph.detach_place(attachment);
        }
    }

    /// A place turned out to lie elsewhere: so does its waypoint.
    pub(super) fn move_waypoint(&mut self, place: PlaceId, at: &Isometry3<f64>) {
        let remembered = self.places.get(place).map(Place::pose);
        let at = remembered.unwrap_or(*at);
        let waypoint = self.ways.at(place).and_then(|at| self.ways.waypoint(at));
        if waypoint.is_some_and(|waypoint| Place::is_moved(waypoint.pose(), &at)) {
            self.ways.put(place, &at, self.revision);
        }
    }
}

impl CognitiveMap {
    /// What is not in the pages of ways.
    pub(super) fn way_head(&self, since_revision: u64) -> Option<CheckpointPage> {
        // It changes only where some way does.
        let is_new = self.ways.changed_ways(since_revision).next().is_some();
        is_new.then(|| {
            let mut out = StateWriter::default();
            self.ways.write_head(&mut out);
            page_of(WAY_HEAD, 0, out)
        })
    }

    /// Reads ways and waypoints; a map in which nobody has travelled has none.
    pub(super) fn restore_ways(
        &mut self,
        mut pages: BTreeMap<(u8, u32), Vec<u8>>,
    ) -> Result<(), CorruptCheckpoint> {
        let damaged = |kind, index| CorruptCheckpoint::DamagedPage { kind, index };
        let Some(head) = pages.remove(&(WAY_HEAD, 0)) else {
            let left = pages.keys().next();
            return left.map_or(Ok(()), |&(kind, index)| Err(damaged(kind, index)));
        };
        let mut expected = 0;
        for ((kind, index), bytes) in pages {
            expected = if index == 0 { 0 } else { expected };
            let restored = match kind {
                WAYS if index == expected => self.ways.push_ways(&bytes, self.revision),
                WAYPOINTS if index == expected => self.ways.push_waypoints(&bytes, self.revision),
                _ => Err(CorruptState::Invalid),
            };
            restored.map_err(|_| damaged(kind, index))?;
            expected += 1;
        }
        let restored = self.ways.restore(&head, self.revision);
        restored.map_err(|_| CorruptCheckpoint::DigestMismatch)
    }
}
