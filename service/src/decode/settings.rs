//! Settings of a space.

use cogmap_proto::SpaceSettings;
use cognitive_map::InvalidSettings;

use super::bounds::TRAJECTORY_INTERVAL_S;

/// Settings of the core from those of the wire.
///
/// # Errors
/// Names the field that makes no sense and the rule that it breaks.
pub fn core_settings(settings: &SpaceSettings) -> Result<cognitive_map::Settings, InvalidSettings> {
    let recruitment = match settings.recruitment {
        cogmap_proto::Recruitment::Novelty {} => cognitive_map::Recruitment::Novelty,
        cogmap_proto::Recruitment::Bernoulli { probability } => {
            cognitive_map::Recruitment::Bernoulli { probability }
        }
    };
    let interval_s = settings.trajectory_interval_s;
    TRAJECTORY_INTERVAL_S.check("trajectory_interval_s", interval_s)?;
    cognitive_map::Settings::new(cognitive_map::SettingsValues {
        seed: settings.seed,
        grid_modules: settings.grid_modules as usize,
        grid_spacing_m: settings.grid_spacing_m,
        grid_ratio: settings.grid_ratio,
        field_radius_m: settings.field_radius_m,
        recruitment,
        translation_sd_per_sqrt_m: settings.odometry_noise.translation_sd_per_sqrt_m,
        rotation_sd_per_sqrt_m: settings.odometry_noise.rotation_sd_per_sqrt_m,
        rotation_sd_per_sqrt_rad: settings.odometry_noise.rotation_sd_per_sqrt_rad,
        length_error_sd: settings.odometry_noise.length_error_sd,
        angle_error_sd: settings.odometry_noise.angle_error_sd,
        bias_sd_rad_s: settings.odometry_noise.bias_sd_rad_s,
        lasting_range_error: settings.lasting_range_error,
        localized_sd_m: settings.localized_sd_m,
        lost_sd_m: settings.lost_sd_m,
        trip_stillness_s: settings.trip_stillness_s,
        trip_gap_s: settings.trip_gap_s,
        places_max: settings.places_max,
        legs_max: settings.legs_max,
        keyframes_max: settings.keyframes_max,
        strength_half_life_samples: settings.strength_half_life_samples,
        sighting_gate_sd: settings.sighting_gate_sd,
        sighting_huber_sd: settings.sighting_huber_sd,
        closure_gate_chi2: settings.closure_gate_chi2,
        keyframe_spacing_m: settings.keyframe_spacing_m,
        keyframe_spacing_rad: settings.keyframe_spacing_rad,
        restart_sd_m: settings.restart_sd_m,
        restart_sd_rad: settings.restart_sd_rad,
        object_answer_probability: settings.object_answer_probability,
        ways_max: settings.ways_max,
        learns_unknown_objects: settings.learns_unknown_objects,
    })
}

/// Closest rows of a stored trajectory \[ns\].
pub fn trajectory_interval_ns(settings: &SpaceSettings) -> i64 {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "checked to be at most an hour"
    )]
    let interval = (settings.trajectory_interval_s * 1e9).round() as i64;
    interval
}
