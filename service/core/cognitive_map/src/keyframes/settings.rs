//! Limits of the keyframe graph, and what a space sets of it.

use super::tuning::REFUTED_PER_GATE;
use crate::estimator::{LastingErrors, Parameters};
use crate::settings::Settings;

/// Part of the spacing of keyframes up to which a sighting is attached to the latest one: where
/// little is seen, keyframes lie a whole spacing apart, and where much is seen, a fifth. Its motion
/// since that keyframe is kept, so nothing is lost by a wider spacing but density.
const ATTACHED_PER_SPACING: f64 = 5.0;

/// Limits of a keyframe graph, and what a space sets of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyframeSettings {
    /// Keyframes at most. A keyframe with a motion takes about 600 bytes.
    pub keyframes_max: u32,
    /// Sightings at most. One takes about 220 bytes.
    pub sightings_max: u32,
    /// Constraints at most: start poses and loop closures. One takes about 250 bytes.
    pub constraints_max: u32,
    /// Motion after which a keyframe is added in any case \[m, rad\]: poses between two are
    /// interpolated.
    pub spacing: (f64, f64),
    /// Squared Mahalanobis distance up to which a closure agrees with the map or with another
    /// closure.
    pub closure_gate_chi2: f64,
    /// Standard deviations of odometry's lasting errors: of lengths, of angles, of the bias about
    /// each axis \[1, 1, rad/s\], of the veer \[rad/m\]. That of the veer does not count here: the
    /// graph has a fixed one.
    pub calibration_sd: LastingErrors,
}

impl KeyframeSettings {
    /// Those of a space: for each keyframe two sightings and half a constraint.
    pub(crate) fn of(settings: &Settings) -> Self {
        let keyframes_max = settings.keyframes_max;
        Self {
            keyframes_max,
            sightings_max: keyframes_max.saturating_mul(2),
            constraints_max: keyframes_max / 2,
            spacing: (settings.keyframe_spacing_m, settings.keyframe_spacing_rad),
            closure_gate_chi2: settings.closure_gate_chi2,
            calibration_sd: Parameters::of(settings).calibration_sd(),
        }
    }

    /// Motion since a keyframe up to which sightings are attached to it \[m, rad\].
    pub(super) fn attached_within(&self) -> (f64, f64) {
        let (length_m, angle_rad) = self.spacing;
        (
            length_m / ATTACHED_PER_SPACING,
            angle_rad / ATTACHED_PER_SPACING,
        )
    }

    /// Squared Mahalanobis distance after a relaxation from which a closure is rejected.
    pub(super) fn refuted_chi2(&self) -> f64 {
        REFUTED_PER_GATE * self.closure_gate_chi2
    }
}

impl Default for KeyframeSettings {
    fn default() -> Self {
        Self::of(&Settings::default())
    }
}
