//! Path integration against closed forms.

use std::f64::consts::{FRAC_PI_2, PI};

use cognitive_map::{
    AgentId, CognitiveMap, EventKind, Motion, PoseNoise, SampleBody, Settings, StartPose, Status,
};
use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

use crate::journal::{Robot, motion, settings, sighting, start_pose};

fn new_map() -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(Settings::default());
    let robot = Robot::enrol(&mut map);
    (map, robot)
}

fn assert_near(pose: &Isometry3<f64>, position: [f64; 3], heading_rad: f64) {
    let (_, _, yaw) = pose.rotation.euler_angles();
    assert!(
        (pose.translation.vector - Vector3::from(position)).norm() < 1e-9,
        "{pose}"
    );
    let error = (yaw - heading_rad).sin().abs();
    assert!(
        error < 1e-9 && (yaw - heading_rad).cos() > 0.0,
        "{yaw} is not {heading_rad}"
    );
}

#[test]
fn straight_lines_of_either_sign_end_where_they_should() {
    for step in [0.02, -0.02] {
        for axis in 0..3 {
            let (mut map, mut robot) = new_map();
            let mut translation = [0.0; 3];
            translation[axis] = step;
            for _ in 0..500 {
                robot.go(&mut map, translation, [0.0; 3]);
            }
            let mut end = [0.0; 3];
            end[axis] = 500.0 * step;
            assert_near(&robot.pose(&map), end, 0.0);
            assert_near(map.agent(robot.id).unwrap().odometry(), end, 0.0);
            assert!((map.agent(robot.id).unwrap().travelled_m() - 10.0).abs() < 1e-9);
        }
    }
}

#[test]
fn squares_of_either_sense_close() {
    for turn in [FRAC_PI_2, -FRAC_PI_2] {
        let (mut map, mut robot) = new_map();
        for side in 1..=4 {
            robot.ahead(&mut map, 0.05, 40);
            robot.go(&mut map, [0.0; 3], [0.0, 0.0, turn]);
            let corner = [[2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.0, 0.0]][side - 1];
            let position = [corner[0], corner[1] * turn.signum(), 0.0];
            assert_near(&robot.pose(&map), position, turn * side as f64);
        }
    }
}

/// Constant speed v and turn rate ω: x = v/ω sin ωt, y = v/ω (1 − cos ωt), z = w t.
#[test]
fn helices_of_either_sense_follow_the_closed_form() {
    for omega in [0.7, -0.7] {
        let (mut map, mut robot) = new_map();
        for step in 1..=400 {
            let twist = Motion::from_velocity([1.0, 0.0, 0.2], [0.0, 0.0, omega], 0.05, None);
            robot.sample(&mut map, SampleBody::Motion(twist.unwrap()));
            let t = f64::from(step) * 0.05;
            let (sin, cos) = (omega * t).sin_cos();
            let position = [sin / omega, (1.0 - cos) / omega, 0.2 * t];
            assert_near(&robot.pose(&map), position, omega * t);
        }
    }
}

proptest! {
    /// Against the plain product of the increments; and the grid state says the same position.
    #[test]
    fn any_path_is_the_product_of_its_increments(
        start in (prop::array::uniform3(-9.0..9.0f64), prop::array::uniform3(-3.0..3.0f64)),
        steps in prop::collection::vec(
            (prop::array::uniform3(-1.0..1.0f64), prop::array::uniform3(-3.0..3.0f64)), 1..60,
        ),
    ) {
        let (mut map, mut robot) = new_map();
        robot.sample(&mut map, start_pose(start.0, start.1));
        let mut pose = Isometry3::new(start.0.into(), start.1.into());
        for (translation, turn) in steps {
            robot.go(&mut map, translation, turn);
            pose *= Isometry3::new(translation.into(), turn.into());
        }
        let estimate = robot.pose(&map);
        prop_assert!((estimate.translation.vector - pose.translation.vector).norm() < 1e-9);
        prop_assert!(estimate.rotation.angle_to(&pose.rotation) < 1e-7);
        let decoded = map.agent(robot.id).unwrap().grid().decode(map.modules());
        prop_assert!((decoded - robot.position(&map)).norm() < 1e-9);
    }
}

#[test]
fn quaternions_stay_unit_over_a_long_way() {
    let (mut map, mut robot) = new_map();
    for _ in 0..20_000 {
        robot.go(&mut map, [0.001, 0.0, 0.0], [0.1, -0.2, 0.3]);
    }
    assert!((robot.pose(&map).rotation.norm() - 1.0).abs() < 1e-14);
}

#[test]
fn far_away_the_grid_keeps_millimetres() {
    let (mut map, mut robot) = new_map();
    robot.sample(&mut map, start_pose([1e8, -1e8, 1e8], [0.0; 3]));
    let before = map.agent(robot.id).unwrap().grid().clone();
    // A step far below the resolution of a position there, which is 1.5e-8 m.
    for _ in 0..1_000 {
        robot.go(&mut map, [1e-9, 0.0, 0.0], [0.0; 3]);
    }
    let after = map.agent(robot.id).unwrap().grid();
    for ((a, b), lattice) in before
        .modules()
        .iter()
        .zip(after.modules())
        .zip(map.modules().lattices())
    {
        let expected = lattice.phase_displacement(&Vector3::new(1e-6, 0.0, 0.0));
        assert!((b.phase.turns() - a.phase.turns() - expected).norm() < 1e-12);
    }
    assert_eq!(map.status(robot.id).unwrap(), Status::Localized);
}

/// A map whose robots' odometry has noise and no lasting errors.
fn well_calibrated() -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(settings(|values| {
        values.length_error_sd = 0.0;
        values.angle_error_sd = 0.0;
        values.bias_sd_rad_s = 0.0;
    }));
    let robot = Robot::enrol(&mut map);
    (map, robot)
}

/// Along a straight line of n steps δ with variances s²δ and r²δ per step: along it s² n δ; across
/// it s² n δ + r²δ · δ² Σ j², as the turn of each step moves all later ones sideways. A robot that
/// has only moved in its plane does not leave it.
#[test]
fn uncertainty_grows_as_the_closed_form_says() {
    let (mut map, mut robot) = well_calibrated();
    let (n, step) = (200, 0.05);
    robot.ahead(&mut map, step, n);
    let covariance = *map.covariance(robot.id).unwrap().matrix();
    let of_translation = map.settings().translation_sd_per_sqrt_m.powi(2) * step;
    let of_rotation = map.settings().rotation_sd_per_sqrt_m.powi(2) * step;
    let squares: f64 = (0..n).map(|j| (j as f64).powi(2)).sum();
    let along = of_translation * n as f64;
    let across = along + of_rotation * step * step * squares;
    let turn = of_rotation * n as f64;
    for (axis, expected) in [(0, along), (1, across), (5, turn)] {
        let relative = covariance[(axis, axis)] / expected - 1.0;
        assert!(relative.abs() < 1e-9, "axis {axis}: {relative}");
    }
    for axis in 2..5 {
        assert!(covariance[(axis, axis)].abs() < 1e-12, "axis {axis}");
    }
}

/// Over a straight way L, a relative error of lengths with deviation e adds (e L)² along it.
#[test]
fn a_lasting_error_of_lengths_grows_with_the_way() {
    let variance_along = |length_error_sd| {
        let mut map = CognitiveMap::new(settings(|values| {
            values.length_error_sd = length_error_sd;
        }));
        let mut robot = Robot::enrol(&mut map);
        robot.ahead(&mut map, 0.05, 200);
        let covariance = map.covariance(robot.id).unwrap();
        covariance.matrix()[(0, 0)]
    };
    let added = variance_along(0.03) - variance_along(0.0);
    let expected = (0.03f64 * 10.0).powi(2);
    assert!((added / expected - 1.0).abs() < 0.01, "{added}");
}

#[test]
fn noise_of_the_sample_comes_before_the_settings() {
    let (mut map, mut robot) = well_calibrated();
    let noise = PoseNoise::new([0.1, 0.2, 0.3], [0.0; 3]).unwrap();
    let step = Motion::from_increment([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], Some(noise)).unwrap();
    robot.sample(&mut map, SampleBody::Motion(step));
    let covariance = map.covariance(robot.id).unwrap();
    assert!((covariance.position_sd_m() - 0.14f64.sqrt()).abs() < 1e-12);
}

#[test]
fn an_agent_becomes_uncertain_and_then_lost() {
    let (mut map, mut robot) = new_map();
    let mut seen = Vec::new();
    for _ in 0..400 {
        robot.ahead(&mut map, 0.5, 1);
        let status = map.status(robot.id).unwrap();
        if seen.last() != Some(&status) {
            seen.push(status);
        }
    }
    assert_eq!(seen, [Status::Localized, Status::Uncertain, Status::Lost]);
}

/// Standard deviations of the position and of the heading.
fn sd(map: &CognitiveMap, robot: &Robot) -> (f64, f64) {
    let covariance = map.covariance(robot.id).unwrap();
    (
        covariance.position_sd_m(),
        covariance.matrix()[(5, 5)].sqrt(),
    )
}

/// Who knows that samples are lost does not claim to know where the robot went with them.
#[test]
fn where_lost_samples_led_is_not_known() {
    let after = |lost: u64, step_m: f64, turn_rad: f64| {
        let (mut map, mut robot) = new_map();
        robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
        for _ in 0..19 {
            robot.go(&mut map, [step_m, 0.0, 0.0], [0.0, 0.0, turn_rad]);
        }
        robot.seq += lost;
        robot.go(&mut map, [step_m, 0.0, 0.0], [0.0, 0.0, turn_rad]);
        (map.status(robot.id).unwrap(), sd(&map, &robot))
    };
    let (status, (without_m, without_rad)) = after(0, 0.1, 0.0);
    assert_eq!(status, Status::Localized);
    // Ten lost steps of 0.1 m, whichever way.
    let (status, (some_m, some_rad)) = after(10, 0.1, 0.0);
    assert_eq!(status, Status::Uncertain);
    assert!((0.9..2.0).contains(&some_m), "{some_m} after {without_m}");
    assert!(some_rad < without_rad + 0.05, "it never turned: {some_rad}");
    let (status, _) = after(3000, 0.1, 0.0);
    assert_eq!(status, Status::Lost);
    let (mut map, mut robot) = new_map();
    robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
    // What is lost once more is no less far for what was lost before.
    for lost in [40, 40] {
        robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
        robot.ahead(&mut map, 0.1, 19);
        robot.seq += lost;
        robot.ahead(&mut map, 0.1, 1);
        let (now_m, _) = sd(&map, &robot);
        assert!(now_m > 3.0, "{now_m}");
    }
    // One that turns on the spot is where it was, and heads anywhere.
    let (_, (still_m, any_rad)) = after(100, 0.0, 0.1);
    assert!(any_rad > 2.5 && still_m < 0.1, "{still_m} {any_rad}");
    // One that has not moved has not moved.
    let (stood, stood_still) = (after(3000, 0.0, 0.0), after(0, 0.0, 0.0));
    assert_eq!(stood, stood_still);
}

/// A landmark that it knows tells a robot where it came to meanwhile.
#[test]
fn a_landmark_tells_where_lost_samples_led() {
    // Some metres, and so far that it may be anywhere.
    for (lost, to_m) in [(20, 3.9), (400, 12.0)] {
        let (mut map, mut robot) = new_map();
        robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
        let posts = [
            ("gate", [5.0, 3.0]),
            ("post", [5.0, -3.0]),
            ("pole", [2.0, 4.0]),
        ];
        let look = |map: &mut CognitiveMap, robot: &mut Robot, from_m: f64| {
            for (label, at) in posts {
                robot.sample(map, sighting(label, [at[0] - from_m, at[1], 0.0], 0.05));
            }
        };
        look(&mut map, &mut robot, 0.0);
        robot.ahead(&mut map, 0.1, 19);
        robot.seq += lost;
        for _ in 0..5 {
            look(&mut map, &mut robot, to_m);
            robot.go(&mut map, [0.0; 3], [0.0; 3]);
        }
        let at = map.agent(robot.id).unwrap().pose().translation.vector;
        assert!(
            (at - Vector3::new(to_m, 0.0, 0.0)).norm() < 0.2,
            "{lost}: {at}"
        );
        assert_eq!(map.status(robot.id), Some(Status::Localized), "{lost}");
    }
}

#[test]
fn latest_movements_are_told() {
    let (mut map, mut robot) = new_map();
    let agent = |map: &CognitiveMap| {
        let agent = map.agent(AgentId(0)).unwrap();
        (agent.displacement_m(), agent.octant(), agent.turning_rad())
    };
    assert_eq!(agent(&map), (0.0, None, 0.0));
    robot.go(&mut map, [3.0, 4.0, 0.0], [0.0; 3]);
    assert_eq!(agent(&map), (5.0, Some(1), 0.0));
    // Standing still is no movement.
    robot.go(&mut map, [0.0; 3], [0.0, 0.0, PI]);
    assert_eq!(agent(&map), (5.0, Some(1), 0.0));
    robot.go(&mut map, [3.0, 4.0, -1e-9], [0.0; 3]);
    let (displacement_m, octant, turning_rad) = agent(&map);
    assert!((displacement_m - 5.0).abs() < 1e-12 && (turning_rad - PI).abs() < 1e-6);
    assert_eq!(octant, Some(7), "back and down");
}

#[test]
fn the_first_to_move_defines_the_frame() {
    let (mut map, mut first) = new_map();
    let mut second = Robot::enrol(&mut map);
    second.go(&mut map, [1.0, 0.0, 0.0], [0.0; 3]);
    first.go(&mut map, [1.0, 0.0, 0.0], [0.0; 3]);
    let agent = |robot: &Robot| map.agent(robot.id).unwrap();
    assert!(agent(&second).placed());
    assert!(!agent(&first).placed());
    assert_eq!(second.position(&map), Point3::new(1.0, 0.0, 0.0));
    assert_eq!(map.status(second.id), Some(Status::Localized));
    assert_eq!(map.status(first.id), Some(Status::Lost));
}

#[test]
fn an_unplaced_agent_leaves_no_trace_until_it_is_placed() {
    let (mut map, mut first) = new_map();
    first.ahead(&mut map, 0.1, 10);
    let (places, trips) = (map.place_count(), map.trip_count());
    let mut late = Robot::enrol(&mut map);
    let mut events = late.sample(&mut map, motion([0.1, 0.0, 0.0], [0.0; 3]));
    events.extend(late.ahead(&mut map, 0.1, 30));
    events.extend(late.sample(&mut map, sighting("dock", [1.0, 0.0, 0.0], 0.1)));
    assert_eq!(events, [EventKind::SessionStarted { session: 1 }]);
    assert_eq!(
        (map.place_count(), map.trip_count(), map.landmark_count()),
        (places, trips, 0)
    );
    let agent = map.agent(late.id).unwrap();
    assert_eq!((agent.place(), agent.trip()), (None, None));
    assert!(
        (agent.pose().translation.x - 3.1).abs() < 1e-9,
        "it counts from identity"
    );

    late.sample(&mut map, start_pose([50.0, 0.0, 0.0], [0.0; 3]));
    late.ahead(&mut map, 0.1, 30);
    assert!(map.agent(late.id).unwrap().placed());
    assert!((late.position(&map).x - 53.0).abs() < 1e-9);
    assert!(map.place_count() > places && map.trip_count() > trips);
}

#[test]
fn a_start_pose_moves_pose_grid_and_uncertainty() {
    let (mut map, mut robot) = new_map();
    robot.ahead(&mut map, 0.5, 100);
    let noise = PoseNoise::new([0.3, 0.0, 0.4], [0.0; 3]).unwrap();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let start = StartPose::new([7.0, -3.0, 1.0], [0.0, 0.0, half, half], noise).unwrap();
    robot.sample(&mut map, SampleBody::StartPose(start));
    assert_near(&robot.pose(&map), [7.0, -3.0, 1.0], FRAC_PI_2);
    let agent = map.agent(robot.id).unwrap();
    assert!((agent.grid().decode(map.modules()) - robot.position(&map)).norm() < 1e-9);
    let covariance = map.covariance(robot.id).unwrap();
    assert!((covariance.position_sd_m() - 0.5).abs() < 1e-12);
    assert!(
        (agent.odometry().translation.x - 50.0).abs() < 1e-9,
        "odometry is smooth"
    );
}

#[test]
fn a_session_goes_on_where_the_one_before_ended() {
    let (mut map, mut robot) = new_map();
    robot.ahead(&mut map, 0.1, 20);
    let before = robot.pose(&map);
    let sd_m = map.covariance(robot.id).unwrap().position_sd_m();
    (robot.session, robot.seq, robot.stamp_ns) = (2, 0, 0);
    robot.go(&mut map, [0.0; 3], [0.0; 3]);
    let agent = map.agent(robot.id).unwrap();
    assert_eq!(*agent.pose(), before);
    assert_eq!(*agent.odometry(), Isometry3::identity());
    assert_eq!((agent.session(), agent.next_seq()), (2, 1));
    let expected = (sd_m * sd_m + 3.0).sqrt();
    assert!(
        (map.covariance(robot.id).unwrap().position_sd_m() - expected).abs() < 1e-9,
        "a metre per axis"
    );
    assert_eq!(map.status(robot.id), Some(Status::Uncertain));
    assert!(agent.travelled_m() < f64::MIN_POSITIVE);
}

#[test]
fn a_thousand_agents_do_not_disturb_each_other() {
    let mut map = CognitiveMap::new(settings(|values| {
        values.grid_modules = 2;
        values.places_max = 100_000;
    }));
    let mut robots: Vec<_> = (0..1_000).map(|_| Robot::enrol(&mut map)).collect();
    for round in 0..12 {
        for (row, robot) in robots.iter_mut().enumerate() {
            let body = if round == 0 {
                start_pose([0.0, row as f64, 0.0], [0.0; 3])
            } else {
                motion([0.1, 0.0, 0.0], [0.0; 3])
            };
            robot.sample(&mut map, body);
        }
    }
    for (row, robot) in robots.iter().enumerate() {
        let end = Point3::new(1.1, row as f64, 0.0);
        assert!((robot.position(&map) - end).norm() < 1e-9);
    }
    assert_eq!(
        map.place_count() % 1_000,
        0,
        "everybody founds the same places"
    );
    assert_eq!(map.trip_count(), 1_000);
}

/// A gyroscope drifts while the robot stands, and no less while it drives.
#[test]
fn what_is_read_at_a_stand_straightens_the_way() {
    let bias_rad_s = 0.006;
    for sense in [1.0, -1.0] {
        // Ten motions a second.
        let turn = [0.0, 0.0, sense * bias_rad_s * 0.1];
        let errors = [0, 600].map(|n_stood| {
            let (mut map, mut robot) = new_map();
            robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
            for _ in 0..n_stood {
                robot.sample(&mut map, motion([0.0; 3], turn));
            }
            for _ in 0..300 {
                robot.sample(&mut map, motion([0.1, 0.0, 0.0], turn));
            }
            robot.position(&map).y.abs()
        });
        // Thirty metres with a bias of 0.006 rad/s end 2.7 m beside the straight way.
        assert!(errors[0] > 2.5 && errors[1] < 0.3, "{errors:?}");
    }
}

/// Who tells that there is no gyroscope with a bias is taken at the word of the odometry.
#[test]
fn without_a_bias_a_slow_turn_on_the_spot_is_one() {
    let mut map = CognitiveMap::new(settings(|settings| settings.bias_sd_rad_s = 0.0));
    let mut robot = Robot::enrol(&mut map);
    for _ in 0..200 {
        robot.sample(&mut map, motion([0.0; 3], [0.0, 0.0, 0.0006]));
    }
    robot.sample(&mut map, motion([0.5, 0.0, 0.0], [0.0; 3]));
    let (_, _, yaw) = robot.pose(&map).rotation.euler_angles();
    assert!((yaw - 0.12).abs() < 1e-9, "{yaw}");
}
