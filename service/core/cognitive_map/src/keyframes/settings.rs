//! Limits of the keyframe graph.

use crate::settings::Settings;

/// Limits of a keyframe graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeyframeSettings {
    /// Keyframes at most. A keyframe with a motion takes about 600 bytes.
    pub keyframes_max: u32,
    /// Sightings at most. One takes about 220 bytes.
    pub sightings_max: u32,
    /// Constraints at most: start poses and loop closures. One takes about 250 bytes.
    pub constraints_max: u32,
}

impl KeyframeSettings {
    /// The limits of a space: for each keyframe two sightings and half a constraint.
    pub(crate) fn of(settings: &Settings) -> Self {
        let keyframes_max = settings.anchors_max;
        Self {
            keyframes_max,
            sightings_max: keyframes_max.saturating_mul(2),
            constraints_max: keyframes_max / 2,
        }
    }
}

impl Default for KeyframeSettings {
    fn default() -> Self {
        Self {
            keyframes_max: 65_536,
            sightings_max: 131_072,
            constraints_max: 32_768,
        }
    }
}
