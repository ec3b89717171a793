//! What places remember of a channel of levels.

use super::moments::Moments;
use super::slots::Slots;
use crate::paged::PagedVec;
use crate::place::PlaceId;
use crate::state::{CorruptState, state_of_struct};

/// Traces per page.
pub(super) const PAGE: usize = 64;

/// What a place remembers of the channel.
#[derive(Clone, Debug)]
pub(crate) struct LevelTrace {
    pub(super) place: PlaceId,
    pub(super) levels: Moments,
}

state_of_struct!(LevelTrace { place, levels });

/// What all places remember of the channel, in the order in which they first did.
#[derive(Clone, Debug, Default)]
pub(super) struct LevelMemory {
    traces: PagedVec<LevelTrace, PAGE>,
    slots: Slots,
}

impl LevelMemory {
    /// The traces.
    pub(super) fn traces(&self) -> &PagedVec<LevelTrace, PAGE> {
        &self.traces
    }

    /// What a place remembers.
    pub(super) fn get(&self, place: PlaceId) -> Option<&LevelTrace> {
        self.traces.get(self.slots.get(place)?)
    }

    /// Strengthens the association of a place and a level. Of more than `traces_max` places nothing
    /// is remembered.
    pub(super) fn strengthen(
        &mut self,
        place: PlaceId,
        value: f64,
        weight: f64,
        traces_max: usize,
        revision: u64,
    ) -> bool {
        let slot = self.slots.get(place);
        if let Some(trace) = slot.and_then(|slot| self.traces.get_mut(slot, revision)) {
            trace.levels.add(value, weight);
            return true;
        }
        let Some(slot) = next_slot(self.traces.len(), traces_max) else {
            return false;
        };
        let mut levels = Moments::default();
        levels.add(value, weight);
        self.traces.push(LevelTrace { place, levels }, revision);
        self.slots.set(place, slot);
        true
    }

    /// How likely each place makes a level: the density of a normal distribution there, as a part of
    /// the highest that there could be. `sd_floor` is the least deviation.
    ///
    /// ```text
    /// likelihood = (floor / σ) exp(−(x − μ)² / (2 σ²)),   σ = max(deviation, floor)
    /// ```
    pub(super) fn likelihoods(
        &self,
        value: f64,
        sd_floor: f64,
    ) -> impl Iterator<Item = (PlaceId, f64)> {
        self.traces.iter().map(move |trace| {
            let sd = trace.levels.sd().max(sd_floor);
            let deviations = (value - trace.levels.mean()) / sd;
            let likelihood = sd_floor / sd * (-0.5 * deviations * deviations).exp();
            (trace.place, likelihood)
        })
    }

    /// Appends a checkpoint's page. A place that comes twice is refused.
    pub(super) fn push_page(&mut self, bytes: &[u8], revision: u64) -> Result<(), CorruptState> {
        let start = self.traces.len();
        self.traces.push_page(bytes, revision)?;
        for (slot, trace) in (start..).zip(self.traces.iter_from(start)) {
            let slot = next_slot(slot, usize::MAX).ok_or(CorruptState::Invalid)?;
            if self.slots.get(trace.place).is_some() {
                return Err(CorruptState::Invalid);
            }
            self.slots.set(trace.place, slot);
        }
        Ok(())
    }
}

/// The slot after `len` others, if there may be one.
pub(super) fn next_slot(len: usize, slots_max: usize) -> Option<u32> {
    let slot = u32::try_from(len).ok().filter(|&slot| slot < u32::MAX);
    slot.filter(|_| len < slots_max)
}

/// The largest level that places remember, in either direction. Squares of deviations of larger ones
/// would leave the numbers.
pub(super) const LEVEL_MAX: f64 = 1e100;

impl LevelTrace {
    /// Distance of a level from what is expected, in deviations; `sd_floor` is the least deviation.
    pub(super) fn surprise(&self, value: f64, sd_floor: f64) -> f64 {
        (value - self.levels.mean()).abs() / self.levels.sd().max(sd_floor)
    }
}
