//! What places remember of a channel of levels.

use crate::memory::ids::PlaceId;
use nalgebra::Vector3;
use place_filter::Trace;
use state::{CorruptState, Moments, SparseVec, state_of_struct};

/// Places per page.
const PAGE: usize = 64;

/// What a place remembers of the channel.
#[derive(Clone, Debug)]
pub(crate) struct LevelTrace {
    /// The levels that were sensed while it answered.
    pub(crate) levels: Moments,
    /// The same for who finds out where it is by them.
    pub(crate) felt: Trace,
    /// Latest stamp of one of them \[ns\].
    pub(crate) last_stamp_ns: i64,
}

state_of_struct!(LevelTrace {
    levels,
    felt,
    last_stamp_ns
});

/// A level that was sensed while a place answered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sensed {
    /// The place.
    pub(crate) place: PlaceId,
    /// Its confidence.
    pub(crate) weight: f64,
    /// The level.
    pub(crate) value: f64,
    /// Where it was sensed, from the place \[m\].
    pub(crate) offset_m: Vector3<f64>,
    /// Variance of that along an axis \[m²\].
    pub(crate) spread_m2: f64,
    /// The agent.
    pub(crate) agent: u32,
    /// When \[ns\].
    pub(crate) stamp_ns: i64,
}

/// What all places remember of the channel.
#[derive(Clone, Debug, Default)]
pub(super) struct LevelMemory {
    traces: SparseVec<LevelTrace, PAGE>,
}

impl LevelMemory {
    /// What places remember, by the identifier of the place.
    pub(super) fn traces(&self) -> &SparseVec<LevelTrace, PAGE> {
        &self.traces
    }

    /// The places that remember something.
    pub(super) fn places(&self) -> impl Iterator<Item = PlaceId> {
        self.traces.iter().map(|(place, _)| id_of(place))
    }

    /// What a place remembers.
    pub(super) fn get(&self, place: PlaceId) -> Option<&LevelTrace> {
        self.traces.get(place.0 as usize)
    }

    /// Strengthens the association of a place and a level. One that is not usual on the channel
    /// tells nobody where it is.
    pub(super) fn strengthen(&mut self, sensed: &Sensed, is_usual: bool, revision: u64) {
        let place = sensed.place.0 as usize;
        let (value, weight) = (sensed.value, sensed.weight);
        let (offset_m, spread_m2) = (sensed.offset_m, sensed.spread_m2);
        if let Some(trace) = self.traces.get_mut(place, revision) {
            trace.levels.add(value, weight);
            if is_usual {
                trace.felt.learn(value, offset_m, spread_m2, sensed.agent);
            }
            // The clocks of two agents may differ, so a later one may carry an earlier stamp.
            trace.last_stamp_ns = trace.last_stamp_ns.max(sensed.stamp_ns);
            return;
        }
        let mut levels = Moments::default();
        levels.add(value, weight);
        let felt = if is_usual {
            Trace::new(value, offset_m, spread_m2, sensed.agent)
        } else {
            Trace::unknown(offset_m, spread_m2, sensed.agent)
        };
        let trace = LevelTrace {
            levels,
            felt,
            last_stamp_ns: sensed.stamp_ns,
        };
        self.traces.insert(place, trace, revision);
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
        self.traces.iter().map(move |(place, trace)| {
            let levels = &trace.levels;
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

/// Distance of a level from what is expected, in deviations; `sd_floor` is the least deviation.
pub(super) fn surprise(levels: &Moments, value: f64, sd_floor: f64) -> f64 {
    (value - levels.mean()).abs() / levels.sd().max(sd_floor)
}
