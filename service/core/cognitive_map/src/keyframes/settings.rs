//! How much of the past is kept.

use crate::settings::Settings;

/// Limits of a chronicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeyframeSettings {
    /// Anchors at most. An anchor with a motion takes about 600 bytes.
    pub anchors_max: u32,
    /// Sightings at most. One takes about 220 bytes.
    pub sightings_max: u32,
    /// Ties at most: start poses and matches. One takes about 250 bytes.
    pub ties_max: u32,
}

impl KeyframeSettings {
    /// Those of a space: for each anchor two sightings and half a tie.
    pub(crate) fn of(settings: &Settings) -> Self {
        let anchors_max = settings.anchors_max;
        Self {
            anchors_max,
            sightings_max: anchors_max.saturating_mul(2),
            ties_max: anchors_max / 2,
        }
    }
}

impl Default for KeyframeSettings {
    fn default() -> Self {
        Self {
            anchors_max: 65_536,
            sightings_max: 131_072,
            ties_max: 32_768,
        }
    }
}
