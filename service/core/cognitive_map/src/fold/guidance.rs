//! Instructions: blockages, routes that agents follow, pinned trips.

use std::sync::Arc;

use nalgebra::Point3;
use state::StateWriter;

use super::apply::Fold;
use super::checkpoint::{GUIDANCE, page_of};
use super::{CheckpointPage, CognitiveMap, CorruptCheckpoint};
use crate::event::Event;
use crate::guidance::Guidance;
use crate::input::{AgentId, Instruction};
use crate::memory::blockage::Blockage;
use crate::memory::ids::TripId;
use crate::memory::place::PlaceId;

impl CognitiveMap {
    /// Applies an instruction that is next in line.
    pub(super) fn instruct(
        &mut self,
        number: u64,
        instruction: &Instruction,
        events: &mut Vec<Event>,
    ) {
        if number != self.guidance.instructions {
            return;
        }
        self.revision += 1;
        let revision = self.revision;
        let guidance = Arc::make_mut(&mut self.guidance);
        guidance.instructions += 1;
        guidance.touch(revision);
        match instruction {
            Instruction::Block(blockage) => {
                if guidance.block(*blockage) {
                    self.lead_around(blockage, events);
                }
            }
            Instruction::Unblock(id) => guidance.unblock_one(*id),
            Instruction::Follow(agent, errand) => self.set_out(*agent, errand, events),
            Instruction::StopFollowing(agent) => guidance.set_followed(*agent, None),
            Instruction::Pin(trip) => {
                if self.can_pin(*trip) {
                    self.trips.pin(*trip, true);
                }
            }
            Instruction::Unpin(trip) => self.trips.pin(*trip, false),
        }
    }

    /// Whether there is room to pin a trip: pinned ones have at most half the budget of legs.
    pub fn can_pin(&self, trip: TripId) -> bool {
        let Some(legs) = self.trips.get(trip).map(crate::Trip::leg_count) else {
            return false;
        };
        let pinned = self.trips.pinned().filter(|pinned| *pinned != trip);
        let pinned = pinned.filter_map(|pinned| Some(self.trips.get(pinned)?.leg_count()));
        2 * (legs + pinned.sum::<usize>()) <= self.settings.legs_max as usize
    }

    /// Whether a trip is never to be forgotten.
    pub fn is_pinned(&self, trip: TripId) -> bool {
        self.trips.is_pinned(trip)
    }

    /// The blockages, by number.
    pub fn blockages(&self) -> &[Blockage] {
        self.guidance.blockages()
    }

    /// Instructions so far: the number of the next one.
    pub fn instructions(&self) -> u64 {
        self.guidance.instructions
    }
}

impl Fold<'_> {
    /// Ends the blockages whose time has come.
    pub(super) fn end_blockages_by(&mut self, stamp_ns: i64) {
        let over = |blockage: &Blockage| blockage.until_ns.is_some_and(|until| until <= stamp_ns);
        self.end_blockages(over);
    }

    /// Ends the blockages across which somebody has travelled.
    pub(super) fn end_blockages_between(
        &mut self,
        from: (PlaceId, &Point3<f64>),
        to: (PlaceId, &Point3<f64>),
    ) {
        self.end_blockages(|blockage| blockage.blocked.blocks(from, to));
    }

    fn end_blockages(&mut self, ends: impl Fn(&Blockage) -> bool) {
        if self.guidance.blockages().iter().any(&ends) {
            let guidance = Arc::make_mut(self.guidance);
            guidance.unblock(ends);
            guidance.touch(self.revision);
        }
    }
}

impl CognitiveMap {
    /// What instructions have said that still holds.
    pub(super) fn write_guidance(&self, out: &mut StateWriter) {
        self.guidance.write(self.trips.pinned(), out);
    }

    /// The page of guidance, if it changed.
    pub(super) fn guidance_page(&self, since_revision: u64) -> Option<CheckpointPage> {
        self.guidance.changed_since(since_revision).then(|| {
            let mut out = StateWriter::default();
            self.write_guidance(&mut out);
            page_of(GUIDANCE, 0, out)
        })
    }

    /// Reads guidance, once trips are there; a map in which nobody has said anything has none.
    pub(super) fn restore_guidance(
        &mut self,
        page: Option<&[u8]>,
    ) -> Result<(), CorruptCheckpoint> {
        let Some(bytes) = page else { return Ok(()) };
        let damaged = CorruptCheckpoint::DamagedPage {
            kind: GUIDANCE,
            index: 0,
        };
        let (guidance, pinned) = Guidance::read(bytes).map_err(|_| damaged)?;
        let is_agent = |agent: AgentId| (agent.0 as usize) < self.agents.len();
        let mut followed = guidance.all_followed();
        if !followed.all(|(agent, _)| is_agent(agent)) {
            return Err(damaged);
        }
        drop(followed);
        for trip in pinned {
            self.trips.pin(trip, true);
        }
        self.guidance = Arc::new(guidance);
        Ok(())
    }
}
