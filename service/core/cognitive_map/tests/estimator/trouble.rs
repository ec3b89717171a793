use nalgebra::Point3;

use crate::hall::{Hall, Lie, Outcome, planar};

/// Seeds of the halls.
const SEEDS: std::ops::Range<u64> = 1..3;

/// Runs a hall with and without trouble and hands over both.
fn compare(trouble: impl Fn(Hall) -> Hall, check: impl Fn(&Outcome, &Outcome)) {
    for seed in SEEDS {
        let hall = Hall {
            seed,
            ..Hall::default()
        };
        check(&hall.run(), &trouble(hall).run());
    }
}

#[test]
fn without_trouble_the_robots_know_where_they_are() {
    for seed in SEEDS {
        let outcome = Hall {
            seed,
            ..Hall::default()
        }
        .run();
        let worst_m = outcome.worst_rmse_m(0..4, 0);
        assert!(worst_m < 0.12, "{seed}: {worst_m}");
    }
}

#[test]
fn a_robot_that_lies_does_not_mislead_the_others() {
    let lies: [(&str, Lie); 3] = [
        ("too far", |_, range_m, azimuth| (range_m + 1.5, azimuth)),
        ("aside", |_, range_m, azimuth| (range_m, azimuth + 0.6)),
        ("anything", |random, _, _| {
            (5.0 * random.uniform(), 6.0 * random.uniform() - 3.0)
        }),
    ];
    // Of landmarks that nobody else has seen a liar is believed; later on the others know better.
    for (since, most_m) in [(0, 0.3), (150, 0.1)] {
        for (name, lie) in lies {
            compare(
                |hall| Hall {
                    lie: Some((since, lie)),
                    ..hall
                },
                |without, with| {
                    let [without_m, with_m] =
                        [without, with].map(|outcome| outcome.worst_rmse_m(1..4, since));
                    assert!(
                        with_m < without_m + most_m,
                        "{name} from {since} on: {with_m} {without_m}"
                    );
                },
            );
        }
    }
}

#[test]
fn noise_that_is_stated_wrongly_costs_little() {
    for (stated, most_m) in [(0.1, 0.25), (10.0, 0.25)] {
        compare(
            |hall| Hall { stated, ..hall },
            |_, with| {
                let worst_m = with.worst_rmse_m(0..4, 0);
                assert!(worst_m < most_m, "{stated}: {worst_m}");
            },
        );
        compare(
            |hall| Hall {
                stated_motion: Some(stated),
                ..hall
            },
            |_, with| {
                let worst_m = with.worst_rmse_m(0..4, 0);
                assert!(worst_m < most_m, "motion {stated}: {worst_m}");
            },
        );
    }
}

/// Who states that a sensor has no errors, or hundreds of times too small ones, is told by what it
/// sees: its sightings contradict one another.
#[test]
fn a_sensor_that_states_no_errors_misleads_little() {
    for stated in [0.0, 1e-3, 0.03] {
        compare(
            |hall| Hall { stated, ..hall },
            |_, with| {
                let worst_m = with.worst_rmse_m(0..4, 0);
                assert!(worst_m < 0.3, "{stated}: {worst_m}");
            },
        );
        compare(
            |hall| Hall {
                stated,
                stated_by: 0..1,
                ..hall
            },
            |_, with| {
                let (own_m, others_m) = (with.rmse_m(0, 0), with.worst_rmse_m(1..4, 0));
                assert!(
                    own_m < 0.2 && others_m < 0.1,
                    "{stated}: {own_m} {others_m}"
                );
                let off = |post| (with.post(post).unwrap() - with.posts[post]).norm();
                let posts_m = (0..with.posts.len()).map(off).fold(0.0, f64::max);
                assert!(posts_m < 0.4, "{stated}: {posts_m}");
            },
        );
    }
}

#[test]
fn some_sightings_of_something_else_cost_little() {
    compare(
        |hall| Hall {
            mistaken: 0.1,
            ..hall
        },
        |_, with| {
            let worst_m = with.worst_rmse_m(0..4, 0);
            assert!(worst_m < 0.25, "{worst_m}");
        },
    );
}

/// Three of ten sightings are of something else, of posts and of robots alike, from the first step
/// on. What they say of odometry is not believed.
#[test]
fn many_sightings_of_something_else_lose_few_robots() {
    let mut all_m = Vec::new();
    for seed in 1..9 {
        let hall = Hall {
            seed,
            mistaken: 0.3,
            ..Hall::default()
        };
        let outcome = hall.run();
        all_m.extend((0..4).map(|robot| outcome.rmse_m(robot, 0)));
        let off = |post| Some((outcome.post(post)? - outcome.posts[post]).norm());
        let wrong = (0..outcome.posts.len()).filter(|&post| off(post).is_none_or(|off| off > 0.6));
        assert!(wrong.count() <= 1, "{seed}");
    }
    all_m.sort_by(f64::total_cmp);
    assert!(all_m[16] < 0.1 && all_m[28] < 0.3, "{all_m:?}");
}

#[test]
fn a_robot_that_slipped_or_was_carried_away_comes_back() {
    for (name, slip, steps) in [
        ("slip", planar(1.0, 0.3, 0.4), 60),
        ("carried", planar(-2.5, 2.0, 2.5), 120),
    ] {
        compare(
            |hall| Hall {
                slip: Some((150, slip)),
                ..hall
            },
            |without, with| {
                let after_m = with.rmse_m(1, 150 + steps);
                assert!(
                    after_m < 1.5 * without.rmse_m(1, 150 + steps) + 0.1,
                    "{name}: {after_m}"
                );
                let others_m = [0, 2, 3].map(|robot| with.rmse_m(robot, 0));
                assert!(others_m.iter().all(|m| *m < 0.2), "{name}: {others_m:?}");
            },
        );
    }
}

/// Sightings of known landmarks that agree say where a robot is that was carried away.
#[test]
#[allow(clippy::print_stdout, reason = "documents give what it prints")]
fn a_robot_that_was_carried_away_knows_where_it_is_within_seconds() {
    for mistaken in [0.0, 0.1, 0.2] {
        let looks = |seed| {
            let hall = Hall {
                seed,
                steps: 220,
                mistaken,
                slip: Some((150, planar(-2.5, 2.0, 2.5))),
                ..Hall::default()
            };
            let errors_m = hall.run().errors_m;
            let is_lost = |step: &usize| errors_m[*step][1] > 0.4;
            (150..220).rev().find(is_lost).map_or(0, |last| last - 149)
        };
        let mut all: Vec<usize> = (1..13).map(looks).collect();
        all.sort_unstable();
        println!("{mistaken} mistaken, looks: {all:?}");
        assert!(all[6] <= 5 && all[11] <= 15, "{mistaken}: {all:?}");
    }
}

#[test]
fn a_moved_landmark_is_found_where_it_stands() {
    let place = Point3::new(1.0, -1.0, 0.0);
    compare(
        |hall| Hall {
            moved: Some((150, place)),
            ..hall
        },
        |without, with| {
            let [without_m, with_m] = [without, with].map(|outcome| outcome.worst_rmse_m(0..4, 0));
            assert!(with_m < 1.5 * without_m + 0.05, "{with_m} {without_m}");
            let off_m = (with.post(0).unwrap() - place).norm();
            assert!(off_m < 0.4, "{off_m}");
        },
    );
}

#[test]
fn landmarks_that_are_taken_for_each_other_mislead_nobody_for_long() {
    compare(
        |hall| Hall {
            swapped: Some(150),
            ..hall
        },
        |without, with| {
            let [without_m, with_m] = [without, with].map(|outcome| outcome.worst_rmse_m(0..4, 0));
            assert!(with_m < 1.5 * without_m + 0.05, "{with_m} {without_m}");
        },
    );
}

#[test]
fn a_robot_that_was_silent_for_long_goes_on() {
    compare(
        |hall| Hall {
            silence: 100..300,
            ..hall
        },
        |_, with| {
            let worst_m = with.worst_rmse_m(0..4, 0);
            assert!(worst_m < 0.15, "{worst_m}");
        },
    );
}

#[test]
fn walls_make_the_estimate_coarser_and_no_more() {
    compare(
        |hall| Hall {
            walls: true,
            ..hall
        },
        |without, with| {
            let [without_m, with_m] = [without, with].map(|outcome| outcome.worst_rmse_m(0..4, 0));
            assert!(with_m < 2.5 * without_m + 0.1, "{with_m} {without_m}");
            let posts = with.posts.iter().enumerate();
            let off = posts.filter_map(|(number, post)| Some((with.post(number)? - post).norm()));
            let worst_m = off.fold(0.0, f64::max);
            assert!(worst_m < 1.0, "{worst_m}");
        },
    );
}
