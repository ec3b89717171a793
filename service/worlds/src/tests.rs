//! Whole teams, as a user sees them.

use nalgebra::Point3;

use super::DeadReckoning;
use super::*;
use crate::reading::{ReadingBody, ReadingTarget};

fn team(settings: TeamSettings) -> Team {
    Team::new(ObstacleWorld::new(5), settings).unwrap()
}

fn exact_sensor() -> Sensor {
    Sensor {
        range_sd_m: 0.0,
        bearing_sd_rad: 0.0,
        ..Sensor::default()
    }
}

#[test]
fn perfect_odometry_leads_back_to_the_truth() {
    let odometry = OdometryNoise::none();
    let mut team = team(TeamSettings {
        n_robots: 3,
        odometry,
        ..TeamSettings::default()
    });
    let mut reckonings = vec![DeadReckoning::default(); 3];
    let (mut n_left, mut n_right) = (0, 0);
    for _ in 0..10_000 {
        for (tick, reckoning) in team.tick().iter().zip(&mut reckonings) {
            for reading in &tick.readings {
                reckoning.apply(reading).unwrap();
                if let ReadingBody::Velocity { angular_rad_s, .. } = &reading.body {
                    n_left += i32::from(angular_rad_s[2] > 0.1);
                    n_right += i32::from(angular_rad_s[2] < -0.1);
                }
            }
            let (truth, pose) = (&tick.truth.pose, reckoning.pose());
            assert!((truth.translation.vector - pose.translation.vector).norm() < 1e-9);
            assert!(truth.rotation.angle_to(&pose.rotation) < 1e-6);
        }
    }
    assert!(
        n_left > 5_000 && n_right > 5_000,
        "{n_left} left, {n_right} right"
    );
}

#[test]
fn default_odometry_drifts_by_metres_not_by_rooms() {
    let mut team = team(TeamSettings {
        n_robots: 20,
        ..TeamSettings::default()
    });
    let mut reckonings = vec![DeadReckoning::default(); 20];
    let mut errors_m = Vec::new();
    for _ in 0..=1000 {
        errors_m.clear();
        for (tick, reckoning) in team.tick().iter().zip(&mut reckonings) {
            for reading in &tick.readings {
                reckoning.apply(reading).unwrap();
            }
            let truth = tick.truth.pose.translation.vector;
            errors_m.push((truth - reckoning.pose().translation.vector).norm());
        }
    }
    let mean_m = errors_m.iter().sum::<f64>() / 20.0;
    assert!((0.2..3.0).contains(&mean_m), "{mean_m} m after 100 m");
}

#[test]
fn exact_sightings_point_at_their_targets() {
    let mut team = team(TeamSettings {
        n_robots: 4,
        beacon_sensor: exact_sensor(),
        robot_sensor: Some(exact_sensor()),
        ..TeamSettings::default()
    });
    let beacons = team.world().beacons().to_vec();
    let (mut n_beacons, mut n_robots) = (0, 0);
    for _ in 0..2000 {
        let ticks = team.tick();
        for tick in &ticks {
            for reading in &tick.readings {
                assert_eq!(reading.stamp_ns, tick.truth.stamp_ns);
                let ReadingBody::Sighting {
                    target,
                    range_m,
                    azimuth_rad,
                    elevation_rad,
                    ..
                } = &reading.body
                else {
                    continue;
                };
                let expected = match target {
                    ReadingTarget::Landmark(label) => {
                        n_beacons += 1;
                        beacons
                            .iter()
                            .find(|b| b.label == *label)
                            .unwrap()
                            .position_m
                    }
                    ReadingTarget::Robot(name) => {
                        n_robots += 1;
                        assert_ne!(*name, format!("robot{}", tick.robot));
                        let other = ticks.iter().find(|t| format!("robot{}", t.robot) == *name);
                        other.unwrap().truth.pose.translation.vector
                    }
                };
                let (sin, cos) = azimuth_rad.sin_cos();
                let (up, flat) = elevation_rad.sin_cos();
                let seen = Point3::new(cos * flat, sin * flat, up) * *range_m;
                let found = tick.truth.pose * seen;
                assert!((found.coords - expected).norm() < 1e-9);
                assert!(*range_m <= 5.0);
            }
        }
    }
    assert!(
        n_beacons > 500,
        "{n_beacons} sightings of beacons in 8000 robot ticks"
    );
    assert!(
        n_robots > 50,
        "{n_robots} sightings of robots in 8000 robot ticks"
    );
}

#[test]
fn one_seed_one_stream_and_one_more_robot_changes_nothing() {
    let settings = TeamSettings {
        seed: 9,
        n_robots: 2,
        ..TeamSettings::default()
    };
    let mut same = [team(settings.clone()), team(settings.clone())];
    let mut larger = team(TeamSettings {
        n_robots: 3,
        ..settings.clone()
    });
    let mut other = team(TeamSettings {
        seed: 10,
        ..settings.clone()
    });
    let mut exact = team(TeamSettings {
        odometry: OdometryNoise::none(),
        ..settings
    });
    for tick in 0..200 {
        let expected = same[0].tick();
        assert_eq!(expected, same[1].tick());
        assert_eq!(expected, larger.tick()[..2]);
        assert_ne!(expected, other.tick());
        for (noisy, exact) in expected.iter().zip(exact.tick()) {
            assert_eq!(noisy.truth, exact.truth);
            assert_eq!(tick == 0, noisy.readings[0] == exact.readings[0]);
        }
    }
}

#[test]
fn stamps_follow_the_epoch_and_the_rate() {
    let epoch_ns = 1_700_000_000_000_000_001;
    let mut team = team(TeamSettings {
        rate_hz: 30.0,
        epoch_ns,
        ..TeamSettings::default()
    });
    let mut stamps = Vec::new();
    let mut duration_s = 0.0;
    for _ in 0..=90 {
        let tick = team.tick().remove(0);
        stamps.push(tick.truth.stamp_ns);
        if let ReadingBody::Velocity {
            duration_s: d,
            linear_m_s,
            ..
        } = tick.readings[0].body
        {
            duration_s += d;
            assert!(linear_m_s[0] < 4.5, "steps of 0.1 m at 30 Hz make 3 m/s");
        }
    }
    assert_eq!(
        stamps[..3],
        [epoch_ns, epoch_ns + 33_333_333, epoch_ns + 66_666_667]
    );
    assert_eq!(stamps[90], epoch_ns + 3_000_000_000);
    assert!((duration_s - 3.0).abs() < 1e-12);
}

#[test]
fn robots_that_are_told_nothing_get_no_start_pose() {
    let untold = TeamSettings {
        start: StartKnowledge::Untold,
        ..TeamSettings::default()
    };
    let mut ticks = [team(TeamSettings::default()), team(untold)].map(|mut team| team.tick());
    let told = ticks[0][0].readings.remove(0);
    assert!(matches!(
        told.body,
        ReadingBody::StartPose { translation_m, .. }
            if nalgebra::Vector3::from(translation_m) == ObstacleWorld::new(5).centre_m()
    ));
    assert_eq!(ticks[0], ticks[1]);
}

#[test]
fn senseless_settings_are_refused() {
    let refused = |settings| Team::new(ObstacleWorld::new(1), settings).err();
    for rate_hz in [0.0, -1.0, f64::NAN, 1e6] {
        let settings = TeamSettings {
            rate_hz,
            ..TeamSettings::default()
        };
        assert_eq!(refused(settings), Some(InvalidTeam::Rate));
    }
    let beacon_sensor = Sensor {
        report_probability: 1.5,
        ..Sensor::default()
    };
    let settings = TeamSettings {
        beacon_sensor,
        ..TeamSettings::default()
    };
    assert_eq!(refused(settings), Some(InvalidTeam::Sensor(InvalidSensor)));
    let odometry = OdometryNoise {
        scale_bias: -1.0,
        ..OdometryNoise::default()
    };
    let settings = TeamSettings {
        odometry,
        ..TeamSettings::default()
    };
    assert_eq!(refused(settings), Some(InvalidTeam::Noise(InvalidNoise)));
    let crowd = TeamSettings {
        n_robots: 100_000,
        ..TeamSettings::default()
    };
    assert!(matches!(refused(crowd), Some(InvalidTeam::NoRoom { .. })));
}
