//! Laws of the demo's scenario.

use super::*;
use crate::reading::{ReadingMark, ReadingTarget};
use crate::walker::BODY_RADIUS_M;

fn scenario(seed: u64, n_robots: u32, duration_s: f64) -> Scenario {
    Scenario::new(ScenarioSettings {
        seed,
        n_robots,
        epoch_ns: 0,
        duration_s,
    })
    .expect("there is room")
}

fn acts(mut scenario: Scenario) -> Vec<(f64, Act)> {
    let mut acts = Vec::new();
    while scenario.has_more() {
        let now_s = scenario.elapsed_s();
        acts.extend(scenario.tick().acts.into_iter().map(|act| (now_s, act)));
    }
    acts
}

#[test]
fn equal_settings_give_equal_streams() {
    let (mut a, mut b) = (scenario(3, 5, 60.0), scenario(3, 5, 60.0));
    let mut other = scenario(4, 5, 60.0);
    assert_ne!(a.clone().tick(), other.tick());
    while a.has_more() {
        assert_eq!(a.tick(), b.tick());
    }
    assert!(!b.has_more());
}

#[test]
fn every_act_comes_in_the_first_minute_whatever_the_seed() {
    for seed in 0..20 {
        let acts = acts(scenario(seed, 5, 60.0));
        let at = |is: &dyn Fn(&Act) -> bool| {
            let found: Vec<f64> = acts
                .iter()
                .filter(|(_, a)| is(a))
                .map(|(s, _)| *s)
                .collect();
            assert_eq!(found.len(), 1, "seed {seed}: {acts:?}");
            found[0]
        };
        let woken_s = at(&|act| matches!(act, Act::WokenUp { robot } if robot == "robot4"));
        let carried_s =
            at(&|act| matches!(act, Act::CarriedOff { robot, .. } if robot == "robot5"));
        let touched_s = at(&|act| matches!(act, Act::Touching(_)));
        // Each has time to lead somewhere.
        assert!((15.0..20.0).contains(&woken_s));
        assert!((29.0..35.0).contains(&touched_s));
        assert!(
            (36.0..46.0).contains(&carried_s),
            "seed {seed}: {carried_s} s"
        );
    }
}

#[test]
fn acts_come_again_and_those_that_do_not_fit_do_not_come() {
    let count = |duration_s, is: fn(&Act) -> bool| {
        let acts = acts(scenario(1, 5, duration_s));
        acts.iter().filter(|(_, act)| is(act)).count()
    };
    let is_off: fn(&Act) -> bool = |act| matches!(act, Act::SwitchedOff { .. });
    let is_woken: fn(&Act) -> bool = |act| matches!(act, Act::WokenUp { .. });
    let is_carried: fn(&Act) -> bool = |act| matches!(act, Act::CarriedOff { .. });
    for (duration_s, woken, carried, off) in [(20.0, 0, 0, 0), (30.0, 1, 0, 0), (180.0, 3, 3, 2)] {
        let found = [is_woken, is_carried, is_off].map(|is| count(duration_s, is));
        assert_eq!(found, [woken, carried, off], "{duration_s} s");
    }
    // Where nothing comes, everybody is told.
    assert_eq!(scenario(1, 5, 20.0).told_robots().count(), 5);
    assert_eq!(scenario(1, 5, 60.0).told_robots().count(), 4);
    // With one robot there is nobody else whose memory helps.
    let alone = acts(scenario(1, 1, 60.0));
    assert!(
        !alone
            .iter()
            .any(|(_, act)| is_woken(act) || is_carried(act))
    );
}

#[test]
fn robots_touch_nothing_and_step_on_unless_they_are_carried() {
    for seed in 0..5 {
        let mut scenario = scenario(seed, 5, 60.0);
        let mut before = std::collections::BTreeMap::new();
        while scenario.has_more() {
            let tick = scenario.tick();
            for agent in tick.agents.iter().filter(|agent| agent.name != ARM) {
                let position_m = agent.truth.pose.translation.vector;
                assert!(
                    scenario.world().is_free(&position_m, BODY_RADIUS_M - 0.01),
                    "seed {seed}: {position_m}"
                );
                let moved_m = before.insert(agent.name.clone(), position_m);
                let moved_m =
                    moved_m.map_or(0.0, |was_m: Vector3<f64>| (position_m - was_m).norm());
                let is_carried = tick.acts.iter().any(
                    |act| matches!(act, Act::CarriedOff { robot, .. } if *robot == agent.name),
                );
                assert_eq!(moved_m > 0.11, is_carried, "seed {seed}: {moved_m} m");
            }
        }
    }
}

#[test]
fn a_robot_that_wakes_up_is_told_nothing_and_sees_no_tag() {
    let mut scenario = scenario(2, 5, 60.0);
    let mut read = Vec::new();
    while scenario.has_more() {
        let tick = scenario.tick();
        let woken = tick
            .agents
            .into_iter()
            .filter(|agent| agent.name == "robot4");
        read.extend(woken.flat_map(|agent| agent.readings));
    }
    assert!(!read.is_empty());
    // Before its first view no motion is known that led there.
    assert!(matches!(read[0].body, ReadingBody::Descriptor { .. }));
    let tells = |reading: &Reading| {
        matches!(
            &reading.body,
            ReadingBody::StartPose { .. }
                | ReadingBody::Sighting {
                    target: ReadingTarget::Landmark(_) | ReadingTarget::Robot(_),
                    ..
                }
        )
    };
    assert!(!read.iter().any(tells));
}

#[test]
fn the_arm_feels_only_what_it_says_it_feels() {
    let mut scenario = scenario(1, 1, 60.0);
    let (mut is_felt, mut contacts) = (false, Vec::new());
    while scenario.has_more() {
        let tick = scenario.tick();
        let arm = tick.agents.iter().find(|agent| agent.name == ARM);
        for reading in &arm.expect("it is always there").readings {
            match &reading.body {
                ReadingBody::Object(ReadingMark::End) => is_felt = false,
                ReadingBody::Object(ReadingMark::Learn { .. } | ReadingMark::Identify { .. }) => {
                    is_felt = true;
                    contacts.push(0);
                }
                ReadingBody::Contact { offset_m, .. } => {
                    assert!(is_felt);
                    // A hand is not larger than that.
                    assert!(Vector3::from(*offset_m).norm() < 0.2, "{offset_m:?}");
                    *contacts.last_mut().expect("a mark came before") += 1;
                }
                _ => {}
            }
        }
    }
    assert_eq!(contacts.len(), 3);
    assert!(
        contacts.iter().all(|contacts| (60..120).contains(contacts)),
        "{contacts:?}"
    );
}
