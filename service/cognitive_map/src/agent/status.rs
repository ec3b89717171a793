//! How well an agent is localised.

use crate::settings::Settings;

/// How well an agent is localised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Its position in `map` is known to within the space's `localized_sd_m`.
    Localized,
    /// It is known less well than that.
    Uncertain,
    /// It is known less well than the space's `lost_sd_m`, or not at all.
    Lost,
}

impl Status {
    /// By the standard deviation of the position.
    pub(super) fn of(placed: bool, position_sd_m: f64, settings: &Settings) -> Self {
        // A deviation that is not a number fails both comparisons, and so is lost.
        if placed && position_sd_m <= settings.localized_sd_m {
            Self::Localized
        } else if placed && position_sd_m <= settings.lost_sd_m {
            Self::Uncertain
        } else {
            Self::Lost
        }
    }
}
