//! Spaces that an earlier version has stored.

use super::*;

/// The settings of a space as they were stored before some constants became settings, and keyframes
/// had their name.
const BEFORE: &str = r#"{"seed":0,"grid_modules":6,"grid_spacing_m":1.2,"grid_ratio":1.618,
    "field_radius_m":0.25,"recruitment":{"novelty":{}},"odometry_noise":{
    "translation_sd_per_sqrt_m":0.04,"rotation_sd_per_sqrt_m":0.1,"rotation_sd_per_sqrt_rad":0.15,
    "length_error_sd":0.05,"angle_error_sd":0.1,"bias_sd_rad_s":0.004},"lasting_range_error":0.1,
    "localized_sd_m":0.5,"lost_sd_m":5.0,"trip_stillness_s":5.0,"trip_gap_s":2.0,
    "places_max":65536,"legs_max":65536,"anchors_max":65536,
    "strength_half_life_samples":1000000,"trajectory_interval_s":0.005}"#;

#[test]
fn a_space_that_was_stored_without_the_newer_settings_has_the_same_map() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let store = LocalStore::open(directory.path()).expect("the store opens");
    store
        .create_space(SPACE, BEFORE.as_bytes())
        .expect("created");
    drop(store);
    // It is found, and counts as one with the defaults.
    let engine = open(directory.path(), EngineSettings::default());
    let space = engine.space(SPACE).expect("the space is there");
    assert_eq!(*space.settings(), SpaceSettings::default());
    offer(&engine, 0, &drive());
    wait_for(|| applied(&engine) == SAMPLES);
    assert_eq!(digest(&engine), digest_of_fold());
    engine.shutdown();
}

#[test]
fn what_an_earlier_version_was_told_of_a_space_is_kept() {
    let told = BEFORE.replace("\"anchors_max\":65536", "\"anchors_max\":300");
    let settings: SpaceSettings = serde_json::from_str(&told).expect("settings");
    assert_eq!(settings.keyframes_max, 300);
    let settings = SpaceSettings {
        keyframes_max: 65_536,
        ..settings
    };
    assert_eq!(settings, SpaceSettings::default());
}
