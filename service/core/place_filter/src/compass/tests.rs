//! Laws of compasses: what turns with a robot is found, what does not is not.

use std::f64::consts::{PI, TAU};

use super::*;

/// An agent that has taught nothing.
const OTHER: u32 = 1_000_000;

/// Teaches a compass by agents that walk and turn; a level is that of a heading, a stretch and a
/// step. Headings are those of an agent in a hall, or in a lane where all walk the same way.
fn taught(is_lane: bool, stretches: u32, level: impl Fn(f64, u32, u32) -> f64) -> Compass {
    let mut compass = Compass::default();
    teach(&mut compass, is_lane, stretches, level);
    compass
}

fn teach(
    compass: &mut Compass,
    is_lane: bool,
    stretches: u32,
    level: impl Fn(f64, u32, u32) -> f64,
) {
    for stretch in 0..stretches {
        let mut agent = HeadingSenses::default();
        for step in 0..20 {
            let turn = 2.4 * f64::from(stretch) + 0.1 * f64::from(step);
            let heading_rad = if is_lane { 0.6 * turn.sin() } else { turn };
            let at = Vector3::new(0.5 * f64::from(step), 0.0, 0.0);
            let level = level(heading_rad, stretch, step);
            if let Some(ended) = agent.teach((0, level), heading_rad, &at) {
                compass.learn(stretch, &ended);
            }
        }
    }
}

/// A number that looks like one drawn from −1 to 1.
fn drawn(stretch: u32, step: u32) -> f64 {
    let number = f64::from(stretch * 7919 + step * 104_729);
    2.0 * (number.sin() * 43_758.545_3).rem_euclid(1.0) - 1.0
}

/// An angle within half a turn of zero.
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

fn assert_told(compass: &Compass, level: impl Fn(f64) -> f64) {
    let model = compass.tells(OTHER).expect("a compass");
    for heading in [-3.0, -1.0, 0.0, 0.5, 2.0, 40.0] {
        let off = wrapped(model.heading_rad(level(heading)) - heading);
        assert!(off.abs() < 0.05, "{off} at {heading}");
    }
}

#[test]
fn angles_of_either_sense_and_unit_tell_the_heading() {
    let same = |heading: f64| heading;
    assert_told(&taught(false, 30, |h, _, _| same(h)), same);
    let wrapped_left = |heading: f64| wrapped(heading + 0.7);
    assert_told(&taught(false, 30, |h, _, _| wrapped_left(h)), wrapped_left);
    let nautical = |heading: f64| (90.0 - heading.to_degrees()).rem_euclid(360.0);
    assert_told(&taught(false, 30, |h, _, _| nautical(h)), nautical);
    let left = |heading: f64| heading.to_degrees() - 1000.0;
    assert_told(&taught(false, 30, |h, _, _| left(h)), left);
    let right = |heading: f64| 5.0 - heading;
    assert_told(&taught(false, 30, |h, _, _| right(h)), right);
}

#[test]
fn what_lasts_of_an_error_is_told_from_noise() {
    let compass = taught(false, 200, |heading, stretch, step| {
        heading + 0.35 * drawn(stretch, 1000) + 0.17 * drawn(stretch, step)
    });
    let model = compass.tells(OTHER).expect("a compass");
    // Deviations of uniform numbers within ±0.35 and ±0.17.
    let (lasting, noise) = (0.35 / 3.0_f64.sqrt(), 0.17 / 3.0_f64.sqrt());
    let (found, whole) = (model.lasting_rad2().sqrt(), model.variance_rad2().sqrt());
    assert!(
        (found / lasting - 1.0).abs() < 0.25,
        "{found} for {lasting}"
    );
    let expected = lasting.hypot(noise);
    assert!(
        (whole / expected - 1.0).abs() < 0.25,
        "{whole} for {expected}"
    );
}

#[test]
fn what_does_not_turn_with_the_agent_tells_nothing() {
    let constant = taught(false, 60, |_, _, _| 0.3);
    assert_eq!(constant.tells(OTHER), None);
    let field = taught(false, 60, |_, stretch, step| {
        40.0 + 10.0 * drawn(stretch, step)
    });
    assert_eq!(field.tells(OTHER), None);
    let of_place = taught(false, 60, |_, stretch, step| {
        drawn(stretch, 5000) + 0.1 * f64::from(step)
    });
    assert_eq!(of_place.tells(OTHER), None);
    let since_power_on = taught(false, 60, |heading, stretch, _| {
        heading + PI * drawn(stretch, 2000)
    });
    assert_eq!(since_power_on.tells(OTHER), None);
}

#[test]
fn in_a_lane_a_constant_level_is_no_compass_and_a_good_compass_is_one() {
    let constant = taught(true, 60, |_, stretch, step| 0.02 * drawn(stretch, step));
    assert_eq!(constant.tells(OTHER), None);
    let good = taught(true, 60, |heading, stretch, step| {
        heading + 0.02 * drawn(stretch, step)
    });
    assert!(good.tells(OTHER).is_some());
}

#[test]
fn few_stretches_or_an_agent_at_rest_teach_nothing() {
    assert_eq!(taught(false, 5, |heading, _, _| heading).tells(OTHER), None);
    let mut agent = HeadingSenses::default();
    for step in 0..100_000 {
        let heading = 0.1 * f64::from(step);
        assert_eq!(agent.teach((0, heading), heading, &Vector3::zeros()), None);
    }
}

#[test]
fn a_compass_that_is_exchanged_is_learned_anew() {
    let mut compass = taught(false, 60, |heading, _, _| heading);
    teach(&mut compass, false, 400, |heading, _, _| heading + 1.5);
    assert_told(&compass, |heading| heading + 1.5);
}

#[test]
fn channels_beyond_the_bound_wait_for_nobody() {
    let mut agent = HeadingSenses::default();
    let mut ended = Vec::new();
    for step in 0..20 {
        let at = Vector3::new(0.5 * f64::from(step), 0.0, 0.0);
        for channel in 0..100 {
            ended.extend(agent.teach((channel, 0.0), 0.0, &at));
        }
    }
    assert_eq!(ended.len(), tuning::CHANNELS_MAX);
}

#[test]
fn a_session_counts_as_one_however_long_it_is() {
    let mut compass = Compass::default();
    let session = |compass: &mut Compass, agent: u32, steps: u32| {
        let mut senses = HeadingSenses::default();
        for step in 0..steps {
            let heading = f64::from(agent) + 0.1 * f64::from(step);
            let at = Vector3::new(f64::from(step), 0.0, 0.0);
            if let Some(ended) = senses.teach((0, heading + 0.4), heading, &at) {
                compass.learn(agent, &ended);
            }
        }
    };
    session(&mut compass, 7, 10_000);
    assert_eq!(compass.tells(7), None);
    // One agent alone teaches what is true of itself.
    for _ in 0..20 {
        session(&mut compass, 7, 20);
    }
    assert!(compass.tells(7).is_some());
    assert_eq!(compass.tells(OTHER), None);
    session(&mut compass, 8, 20);
    assert!(compass.tells(OTHER).is_some());
}

#[test]
fn a_sentinel_is_no_compass() {
    for sentinel in [0.0, 1e20, 9.2e18, -1e29, f64::MAX] {
        let level = taught(false, 60, |_, _, _| sentinel);
        assert_eq!(level.tells(OTHER), None, "{sentinel}");
    }
    // Nor where all look exactly the same way.
    let mut compass = Compass::default();
    for agent in 0..60 {
        let mut senses = HeadingSenses::default();
        for step in 0..20 {
            let at = Vector3::new(f64::from(step), 0.0, 0.0);
            if let Some(ended) = senses.teach((0, 0.0), 0.0, &at) {
                compass.learn(agent, &ended);
            }
        }
    }
    assert_eq!(compass.tells(OTHER), None);
}

#[test]
fn the_turn_of_odometry_is_the_latest_and_that_of_the_surest_compass() {
    let exact = taught(false, 60, |heading, _, _| heading);
    let rough = taught(false, 60, |heading, stretch, _| {
        heading + 0.9 * drawn(stretch, 3000)
    });
    let [exact, rough] = [exact, rough].map(|one| *one.tells(OTHER).expect("a compass"));
    let mut turn = SensedTurn::default();
    let at = |x_m: f64| Vector3::new(x_m, 0.0, 0.0);
    assert_eq!(turn.turn_rad(&at(0.0)), None);
    turn.take(1, &rough, 2.0, &at(0.0));
    turn.take(0, &exact, 3.1, &at(0.0));
    turn.take(0, &exact, -3.1, &at(0.1));
    turn.take(1, &rough, 1.0, &at(0.1));
    let (mean, sd) = turn.turn_rad(&at(0.1)).expect("a turn");
    assert!((mean.abs() - PI).abs() < 1e-9, "{mean}");
    assert!((0.1..0.2).contains(&sd), "{sd}");
    // Levels at rest count as one step, however many there are.
    for _ in 0..1000 {
        turn.take(0, &exact, 0.5, &at(2.0));
    }
    let (mean, _) = turn.turn_rad(&at(2.0)).expect("a turn");
    assert!((1.0..2.5).contains(&mean.abs()), "{mean}");
    for step in 0..100 {
        turn.take(0, &exact, 0.5, &at(2.0 + f64::from(step)));
    }
    assert!((turn.turn_rad(&at(101.0)).expect("a turn").0 - 0.5).abs() < 1e-3);
    assert_eq!(turn.turn_rad(&at(150.0)), None);
}
