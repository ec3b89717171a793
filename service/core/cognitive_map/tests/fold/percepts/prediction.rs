//! What places predict.

use super::*;

#[test]
fn at_a_learned_place_what_was_learned_is_predicted() {
    let (mut map, mut robot) = at_first_place();
    for step in 0..5u8 {
        let value = f64::from(step);
        robot.sample(&mut map, level("touch", value, [0.0; 3]));
        robot.sample(&mut map, level("touch", value + 1.0, [0.0; 3]));
        robot.sample(&mut map, descriptor("camera", &axis(step.into())));
        robot.ahead(&mut map, 0.5, 1);
    }
    // From the place ahead of the last one that felt something, where nothing is known.
    assert!(predict(&map, &robot, 0.0, None).is_empty());
    for back in 1..=5u32 {
        let place = 5 - back;
        let percepts = predict(&map, &robot, -0.5 * f64::from(back), None);
        let learned: Vec<_> = percepts.iter().map(|p| p.remembered.clone()).collect();
        assert_eq!(learned, remembered(&map, place));
        let (mean, sd) = mean_and_sd(&learned[0]);
        assert!((mean - f64::from(place) - 0.5).abs() < 1e-12 && (sd - 0.5).abs() < 1e-12);
        assert_eq!(direction(&learned[1]), axis(place as usize));
        assert!(percepts.iter().all(|p| (p.confidence - 1.0).abs() < 1e-9));

        let touch = predict(&map, &robot, -0.5 * f64::from(back), Some(&label("touch")));
        assert_eq!(touch, percepts[..1]);
    }
    assert!(predict(&map, &robot, -0.5, Some(&label("smell"))).is_empty());
    assert!(
        predict(&map, &robot, 9.0, None).is_empty(),
        "no place answers there"
    );
    // A quarter of a metre and a bit off, the place does not answer any more.
    assert_eq!(predict(&map, &robot, -2.74, None).len(), 2);
    assert!(predict(&map, &robot, -2.76, None).is_empty());
}

#[test]
fn prediction_goes_where_motion_would_lead() {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    robot.sample(&mut map, start_pose([1.0, -2.0, 0.5], [0.1, -0.4, 2.0]));
    let (go, turn) = ([0.7, -0.2, 0.1], [0.3, 0.2, -0.9]);
    let question = motion(go, turn, PoseNoise::none());
    let predicted = map
        .predict(robot.id, &question, &Vector3::zeros(), None)
        .unwrap();
    let before = map.digest();
    assert_eq!(predicted.place, None);
    assert_eq!(map.digest(), before, "asking changes nothing");
    robot.go(&mut map, go, turn);
    assert_eq!(predicted.pose, robot.pose(&map));

    let question = motion([0.0; 3], [0.0; 3], PoseNoise::none());
    let here = map
        .predict(robot.id, &question, &Vector3::zeros(), None)
        .unwrap();
    assert_eq!(here.place, Some((PlaceId(0), 1.0)));
    assert_eq!(
        map.predict(AgentId(7), &question, &Vector3::zeros(), None),
        None
    );
    let lost = Robot::enrol(&mut map);
    assert_eq!(
        map.predict(lost.id, &question, &Vector3::zeros(), None),
        None
    );
}

#[test]
fn a_sensor_feels_where_it_is() {
    let (mut map, mut robot) = at_first_place();
    robot.sample(&mut map, level("touch", 4.0, [0.0; 3]));
    robot.sample(&mut map, descriptor("camera", &axis(0)));
    robot.go(
        &mut map,
        [0.0, 2.0, 0.0],
        [0.0, 0.0, -std::f64::consts::FRAC_PI_2],
    );
    // It looks back along −y; the arm reaches over the first place from a metre before it.
    let ahead = motion([1.0, 0.0, 0.0], [0.0; 3], PoseNoise::none());
    let reach = |arm_m: f64| {
        let arm = Vector3::new(arm_m, 0.0, 0.0);
        map.predict(robot.id, &ahead, &arm, None).unwrap().percepts
    };
    let percepts = reach(1.0);
    assert_eq!(percepts.len(), 1, "the camera is not there");
    assert_eq!(mean_and_sd(&percepts[0].remembered), (4.0, 0.0));
    assert!(reach(0.5).is_empty());
}

#[test]
fn an_uncertain_motion_predicts_with_less_confidence() {
    let (mut map, mut robot) = at_first_place();
    robot.sample(&mut map, level("touch", 4.0, [0.0; 3]));
    robot.ahead(&mut map, 1.0, 1);
    let confidence = |sd_m: f64, sd_rad: f64, arm_m: f64| {
        let noise = PoseNoise::new([sd_m; 3], [sd_rad; 3]).unwrap();
        let back = motion([-1.0 - arm_m, 0.0, 0.0], [0.0; 3], noise);
        let arm = Vector3::new(arm_m, 0.0, 0.0);
        let percepts = map.predict(robot.id, &back, &arm, None).unwrap().percepts;
        percepts[0].confidence
    };
    assert!((confidence(0.0, 0.0, 0.0) - 1.0).abs() < 1e-9);
    // E[2^(−‖ε‖²/r²)] = (1 + 2 ln2 σ²/r²)^(−3/2), and 2 ln2 σ²/r² = 1 here.
    let sd_m = 0.25 / (2.0 * std::f64::consts::LN_2).sqrt();
    assert!((confidence(sd_m, 0.0, 0.0) - 2.0f64.powf(-1.5)).abs() < 1e-9);
    // A turn moves the end of an arm along two axes.
    assert!((confidence(0.0, 0.1, 0.0) - 1.0).abs() < 1e-9);
    assert!((confidence(0.0, sd_m, 1.0) - 0.5).abs() < 1e-9);
}
