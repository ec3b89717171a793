//! What places remember of a channel of levels.

use crate::memory::ids::PlaceId;
use state::{CorruptState, Moments, SparseVec};

/// Places per page.
const PAGE: usize = 64;

/// What all places remember of the channel.
#[derive(Clone, Debug, Default)]
pub(super) struct LevelMemory {
    traces: SparseVec<Moments, PAGE>,
}

impl LevelMemory {
    /// What places remember, by the identifier of the place.
    pub(super) fn traces(&self) -> &SparseVec<Moments, PAGE> {
        &self.traces
    }

    /// The places that remember something.
    pub(super) fn places(&self) -> impl Iterator<Item = PlaceId> {
        self.traces.iter().map(|(place, _)| id_of(place))
    }

    /// What a place remembers.
    pub(super) fn get(&self, place: PlaceId) -> Option<&Moments> {
        self.traces.get(place.0 as usize)
    }

    /// Strengthens the association of a place and a level.
    pub(super) fn strengthen(&mut self, place: PlaceId, value: f64, weight: f64, revision: u64) {
        let place = place.0 as usize;
        if let Some(levels) = self.traces.get_mut(place, revision) {
            levels.add(value, weight);
            return;
        }
        let mut levels = Moments::default();
        levels.add(value, weight);
        self.traces.insert(place, levels, revision);
    }

    /// Forgets what a place remembers.
    pub(super) fn forget(&mut self, place: PlaceId, revision: u64) {
        self.traces.remove(place.0 as usize, revision);
    }

    /// How likely each place makes a level: the density of a normal distribution there, as a part
    /// of the highest that there could be. `sd_floor` is the least deviation.
    ///
    /// ```text
    /// likelihood = (floor / σ) exp(−(x − μ)² / (2 σ²)),   σ = max(deviation, floor)
    /// ```
    pub(super) fn likelihoods(
        &self,
        value: f64,
        sd_floor: f64,
    ) -> impl Iterator<Item = (PlaceId, f64)> {
        self.traces.iter().map(move |(place, levels)| {
            let sd = levels.sd().max(sd_floor);
            let deviations = (value - levels.mean()) / sd;
            let likelihood = sd_floor / sd * (-0.5 * deviations * deviations).exp();
            (id_of(place), likelihood)
        })
    }

    /// Adds a checkpoint's page.
    pub(super) fn restore_page(
        &mut self,
        page: usize,
        bytes: &[u8],
        revision: u64,
    ) -> Result<(), CorruptState> {
        self.traces.restore_page(page, bytes, revision)
    }
}

/// The place of an index, which is its identifier; a checkpoint's page index leaves no room for
/// more.
fn id_of(index: usize) -> PlaceId {
    PlaceId(u32::try_from(index).expect("places have identifiers of 32 bits"))
}

/// The largest level that places remember, in either direction: no unit makes larger ones, and a
/// program's largest float, sent for "nothing", is beyond it.
pub(super) const LEVEL_MAX: f64 = 1e30;

/// Distance of a level from what is expected, in deviations; `sd_floor` is the least deviation.
pub(super) fn surprise(levels: &Moments, value: f64, sd_floor: f64) -> f64 {
    (value - levels.mean()).abs() / levels.sd().max(sd_floor)
}
