//! How well an agent is localised.

use super::Agent;
use crate::settings::Settings;

/// From this many sightings on that were refused one after the other, an agent is not where it is
/// thought to be, whatever the covariance says.
const REFUSED_MAX: u32 = 4;

/// How well an agent is localised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Its position in `map` is known to within the space's `localized_sd_m`, and what it sees is
    /// where it should be.
    Localized,
    /// It is known less well than that, or what it sees contradicts it: its latest sightings, or
    /// many more of them than agree.
    Uncertain,
    /// It is known less well than the space's `lost_sd_m`, or not at all.
    Lost,
}

impl Status {
    /// By the standard deviation of the position, by whether its sightings contradict the estimate,
    /// and by how many of the latest were refused.
    pub(crate) fn of(
        agent: &Agent,
        position_sd_m: f64,
        is_doubted: bool,
        settings: &Settings,
    ) -> Self {
        let is_contradicted = is_doubted || agent.evidence().refused_in_a_row >= REFUSED_MAX;
        let placed = agent.placed();
        // A deviation that is not a number fails both comparisons, and so is lost.
        if placed && position_sd_m <= settings.localized_sd_m && !is_contradicted {
            Self::Localized
        } else if placed && position_sd_m <= settings.lost_sd_m {
            Self::Uncertain
        } else {
            Self::Lost
        }
    }
}
