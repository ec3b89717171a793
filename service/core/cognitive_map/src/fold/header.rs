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

/// Digest of settings.
pub(super) fn digest_of(settings: &Settings) -> Digest {
    // Taken apart, so that a new field cannot be forgotten here.
    let SettingsValues {
        seed,
        grid_modules,
        grid_spacing_m,
        grid_ratio,
        field_radius_m,
        recruitment,
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
        sighting_gate_sd,
        sighting_huber_sd,
        closure_gate_chi2,
        keyframe_spacing_m,
        keyframe_spacing_rad,
        restart_sd_m,
        restart_sd_rad,
        object_answer_probability,
    } = &**settings;
    let mut out = StateWriter::default();
    seed.write(&mut out);
    (*grid_modules as u64).write(&mut out);
    let probability = match recruitment {
        Recruitment::Novelty => None,
        Recruitment::Bernoulli { probability } => Some(*probability),
    };
    probability.write(&mut out);
    for value in [
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
    ] {
        value.write(&mut out);
    }
    for value in [
        places_max,
        legs_max,
        keyframes_max,
        strength_half_life_samples,
    ] {
        value.write(&mut out);
    }
    // What was a constant before it became a setting counts only where it differs from that
    // constant, so that checkpoints and digests from before still hold. A number says which it is.
    let later = [
        (sighting_gate_sd, 4.0),
        (sighting_huber_sd, 2.0),
        (closure_gate_chi2, 11.3),
        (keyframe_spacing_m, 0.1),
        (keyframe_spacing_rad, 0.1),
        (restart_sd_m, 1.0),
        (restart_sd_rad, 0.5),
        (object_answer_probability, 0.995),
    ];
    for (number, (value, constant)) in (0_u8..).zip(later) {
        if value.to_bits() != f64::to_bits(constant) {
            number.write(&mut out);
            value.write(&mut out);
        }
    }
    out.digest()
}
