//! What opens a checkpoint and the map's digest.

use super::CognitiveMap;
use crate::settings::{Recruitment, Settings, SettingsValues};
use state::Digest;
use state::{State, StateWriter, state_of_struct};

/// What is not in pages. It opens the map's digest, too.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) settings: u128,
    pub(super) revision: u64,
    pub(super) is_map_defined: bool,
    agents: u64,
    /// How many there have been, forgotten ones included; of trips too.
    pub(super) places: u64,
    pub(super) trips: u64,
    landmarks: u64,
    channels: u64,
}

state_of_struct!(Header {
    settings,
    revision,
    is_map_defined,
    agents,
    places,
    trips,
    landmarks,
    channels
});

impl Header {
    /// The header of a map.
    pub(super) fn of(map: &CognitiveMap) -> Self {
        Self {
            settings: digest_of(&map.settings).0,
            revision: map.revision,
            is_map_defined: map.is_map_defined,
            agents: map.agents.len() as u64,
            places: map.places.places().next_index() as u64,
            trips: map.trips.recorded() as u64,
            landmarks: map.landmarks.landmarks().len() as u64,
            channels: map.percepts.channels().len() as u64,
        }
    }
}

/// Digests settings in this order, which names each field once; the pattern of all fields does not
/// compile where one is missing.
///
/// What was a constant before it became a setting counts only where it differs from that constant,
/// so that checkpoints and digests from before still hold. A number says which it is.
macro_rules! digest_in_order {
    (@write $out:ident, $field:ident) => {
        State::write($field, &mut $out)
    };
    (@write $out:ident, $field:ident, $state:expr) => {
        State::write(&$state, &mut $out)
    };
    (
        $values:expr,
        [$($field:ident $(as $state:expr)?),+ $(,)?],
        [$($later:ident was $constant:literal),+ $(,)?] $(,)?
    ) => {{
        let SettingsValues { $($field,)+ $($later,)+ } = $values;
        let mut out = StateWriter::default();
        $(digest_in_order!(@write out, $field $(, $state)?);)+
        let later = [$((f64::from(*$later), $constant)),+];
        for (number, (value, constant)) in (0_u8..).zip(later) {
            if value.to_bits() != f64::to_bits(constant) {
                number.write(&mut out);
                value.write(&mut out);
            }
        }
        out.digest()
    }};
}

/// Digest of settings.
pub(super) fn digest_of(settings: &Settings) -> Digest {
    digest_in_order!(
        &**settings,
        [
            seed,
            grid_modules as (*grid_modules as u64),
            recruitment as probability(recruitment),
            grid_spacing_m,
            grid_ratio,
            field_radius_m,
            translation_sd_per_sqrt_m,
            rotation_sd_per_sqrt_m,
            rotation_sd_per_sqrt_rad,
            length_error_sd,
            angle_error_sd,
            bias_sd_rad_s,
            lasting_range_error,
            localized_sd_m,
            lost_sd_m,
            trip_stillness_s,
            trip_gap_s,
            places_max,
            legs_max,
            keyframes_max,
            strength_half_life_samples,
        ],
        [
            sighting_gate_sd was 4.0,
            sighting_huber_sd was 2.0,
            closure_gate_chi2 was 11.3,
            keyframe_spacing_m was 0.1,
            keyframe_spacing_rad was 0.1,
            restart_sd_m was 1.0,
            restart_sd_rad was 0.5,
            object_answer_probability was 0.995,
            ways_max was 131_072.0,
            learns_unknown_objects was 1.0,
        ],
    )
}

/// Probability of recruitment; `None` where novelty decides.
fn probability(recruitment: &Recruitment) -> Option<f64> {
    match recruitment {
        Recruitment::Novelty => None,
        Recruitment::Bernoulli { probability } => Some(*probability),
    }
}
