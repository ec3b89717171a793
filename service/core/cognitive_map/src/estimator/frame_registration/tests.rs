use nalgebra::{Isometry3, Point3, Vector3};

use crate::estimator::tests::{SECOND_NS, polar, start};
use crate::estimator::{Estimator, Parameters};
use crate::input::{Label, Motion, PoseNoise};

/// Posts in no order on a floor, no two close together.
fn floor_posts(seed: u64, n: usize) -> Vec<Point3<f64>> {
    let mut state = seed;
    let mut number = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 / (1_u64 << 52) as f64) - 1.0
    };
    let mut posts: Vec<Point3<f64>> = Vec::new();
    while posts.len() < n {
        let post = Point3::new(9.0 * number(), 6.0 * number(), 0.0);
        if posts.iter().all(|other| (other - post).norm() > 1.5) {
            posts.push(post);
        }
    }
    posts
}

/// Drives about on a floor and looks around, with names of its own for the posts.
fn drive(
    estimator: &mut Estimator,
    agent: u32,
    from: &Isometry3<f64>,
    posts: &[Point3<f64>],
    name: &str,
    steps: usize,
) -> Isometry3<f64> {
    let mut truth = *from;
    for step in 0..steps {
        let noise = PoseNoise::new([0.01, 0.01, 0.0], [0.0, 0.0, 0.005]).unwrap();
        let turn = [0.0, 0.0, 0.1 + 0.05 * (0.03 * step as f64).sin()];
        let moved = Motion::from_velocity([0.4, 0.0, 0.0], turn, 1.0, Some(noise)).unwrap();
        truth *= moved.increment();
        let stamp_ns = i64::try_from(step + 1).unwrap() * SECOND_NS;
        estimator.motion(agent, stamp_ns, &moved, &mut Vec::new());
        let post = step % posts.len();
        let label = Label::new(&format!("{name}-{post}")).unwrap();
        estimator.landmark(
            agent,
            stamp_ns,
            &label,
            &polar(&truth, &posts[post]),
            &mut Vec::new(),
        );
    }
    truth
}

#[test]
fn landmarks_under_other_names_tie_frames_and_become_one() {
    for seed in [1, 2, 3] {
        for heading in [2.0, -0.7] {
            let posts = floor_posts(seed, 14);
            let mut estimator = Estimator::new(Parameters::default());
            let [one, other] = [0, 1].map(|_| estimator.enrol());
            estimator.found(one);
            drive(
                &mut estimator,
                one,
                &Isometry3::identity(),
                &posts,
                "a",
                300,
            );
            let from = Isometry3::new(Vector3::new(-2.0, 1.0, 0.0), Vector3::z() * heading);
            let truth = drive(&mut estimator, other, &from, &posts, "b", 600);
            assert!(estimator.is_in_map(other), "seed {seed}, heading {heading}");
            let (pose, covariance) = estimator.pose(other).unwrap();
            let off = truth.inv_mul(&pose);
            assert!(
                off.translation.vector.norm() < 0.3 && off.rotation.angle() < 0.05,
                "{off}"
            );
            assert!(covariance.matrix()[(0, 0)].sqrt() < 0.5);
            // Both names are one landmark from then on, and what is seen under one moves the other.
            assert_eq!(estimator.landmarks().count(), posts.len());
            for (post, position) in posts.iter().enumerate() {
                let [a, b] = ["a", "b"].map(|name| Label::new(&format!("{name}-{post}")).unwrap());
                assert_eq!(estimator.name_of(&b), estimator.name_of(&a));
                let name = estimator.name_of(&a);
                let (_, found, _) = estimator
                    .landmarks()
                    .find(|landmark| landmark.0 == name)
                    .unwrap();
                assert!((found - position).norm() < 0.3, "{a:?}");
            }
        }
    }
}

#[test]
fn a_mirrored_or_regular_world_ties_nothing() {
    let posts = floor_posts(4, 14);
    let mirrored: Vec<_> = posts
        .iter()
        .map(|post| Point3::new(-post.x, post.y, 0.0))
        .collect();
    let grid: Vec<_> = (0..16)
        .map(|k| Point3::new(f64::from(k % 4) * 2.5, f64::from(k / 4) * 2.5, 0.0))
        .collect();
    for (known, seen) in [(&posts, &mirrored), (&grid, &grid)] {
        let mut estimator = Estimator::new(Parameters::default());
        let [one, other] = [0, 1].map(|_| estimator.enrol());
        estimator.found(one);
        drive(&mut estimator, one, &Isometry3::identity(), known, "a", 300);
        drive(
            &mut estimator,
            other,
            &Isometry3::identity(),
            seen,
            "b",
            600,
        );
        assert!(!estimator.is_in_map(other));
        assert_eq!(estimator.landmarks().count(), known.len());
        let label = Label::new("b-3").unwrap();
        assert_eq!(estimator.name_of(&label), &label);
    }
}

#[test]
fn in_one_frame_an_agent_s_own_names_are_told_from_landmarks_of_its_own() {
    let posts = floor_posts(6, 12);
    let elsewhere: Vec<_> = floor_posts(7, 12)
        .iter()
        .map(|post| post + Vector3::x() * 40.0)
        .collect();
    for (seen, n_landmarks) in [(&posts, 12), (&elsewhere, 24)] {
        let mut estimator = Estimator::new(Parameters::default());
        let [one, other] = [0, 1].map(|_| estimator.enrol());
        let from = Isometry3::new(Vector3::new(1.0, -2.0, 0.0), Vector3::z() * 0.4);
        estimator.start_pose(one, &start(&Isometry3::identity(), 0.02), &mut Vec::new());
        estimator.start_pose(other, &start(&from, 0.02), &mut Vec::new());
        drive(
            &mut estimator,
            one,
            &Isometry3::identity(),
            &posts,
            "a",
            300,
        );
        drive(&mut estimator, other, &from, seen, "b", 400);
        assert_eq!(estimator.landmarks().count(), n_landmarks);
    }
    // Of two posts close together that one agent tells apart, neither is the other.
    let mut pairs = posts.clone();
    pairs.extend(posts.iter().map(|post| post + Vector3::new(0.1, 0.05, 0.0)));
    let mut estimator = Estimator::new(Parameters::default());
    let one = estimator.enrol();
    estimator.found(one);
    drive(
        &mut estimator,
        one,
        &Isometry3::identity(),
        &pairs,
        "a",
        700,
    );
    assert_eq!(estimator.landmarks().count(), pairs.len());
}
