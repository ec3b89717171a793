//! Views that are alike over tens of metres.

use cognitive_map::{CognitiveMap, Motion, PoseNoise, SampleBody, Settings};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use random::Seeded;

use crate::journal::{Robot, descriptor, start_pose};

/// Edge of the block round which a robot goes, and its step \[m\].
const EDGE_M: f64 = 300.0;
const STEP_M: f64 = 6.0;
/// Distance over which what is seen changes \[m\].
const CHANGES_M: f64 = 40.0;

/// A view of a smooth field of 32 numbers.
fn view(at: &Vector2<f64>, waves: &[(Vector2<f64>, f64)], random: &mut Seeded) -> Vec<f32> {
    let number = |&(wave, shift): &(Vector2<f64>, f64)| {
        let seen = (wave.dot(at) / CHANGES_M + shift).cos() + 0.1 * random.normal();
        #[expect(clippy::cast_possible_truncation, reason = "a view is no exact number")]
        let seen = seen as f32;
        seen
    };
    waves.iter().map(number).collect()
}

/// The map of a robot that goes round the block again and again, and how far off it is \[m\].
fn round(has_views: bool) -> (CognitiveMap, f64) {
    let mut random = Seeded(5);
    let mut wave = || {
        let wave = Vector2::new(random.normal(), random.normal());
        (wave, std::f64::consts::TAU * random.uniform())
    };
    let waves: Vec<(Vector2<f64>, f64)> = (0..32).map(|_| wave()).collect();
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
    let (mut at, mut heading_rad) = (Vector2::zeros(), 0.0_f64);
    let noise = PoseNoise::new([0.05, 0.05, 0.0], [0.0, 0.0, 0.01]).unwrap();
    for step in 1..=600 {
        let is_corner = f64::from(step) * STEP_M % EDGE_M == 0.0;
        let turn_rad = f64::from(u8::from(is_corner)) * std::f64::consts::FRAC_PI_2;
        at += STEP_M * Vector2::new(heading_rad.cos(), heading_rad.sin());
        heading_rad += turn_rad;
        let read_rad = turn_rad + 0.01 * random.normal();
        let read = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), read_rad);
        let motion = Motion::from_increment([STEP_M, 0.0, 0.0], read.coords.into(), Some(noise));
        robot.sample(&mut map, SampleBody::Motion(motion.unwrap()));
        let seen = view(&at, &waves, &mut random);
        if has_views {
            robot.sample(&mut map, descriptor("radio", &seen));
        }
    }
    let off_m = (robot.pose(&map).translation.vector.xy() - at).norm();
    (map, off_m)
}

#[test]
fn views_that_are_alike_over_tens_of_metres_make_nothing_worse() {
    let (map, off_m) = round(true);
    let channel = map.view_channels().next().unwrap();
    let learned = channel.learned.expect("views that say something");
    assert!(learned.range_m > 16.0 && learned.is_coarse, "{learned:?}");
    assert!(learned.information_nats > 0.5, "{learned:?}");
    let (_, without_m) = round(false);
    assert!(off_m < without_m + 1.0, "{off_m} {without_m}");
}
