use nalgebra::UnitQuaternion;
use random::Seeded;

use super::*;
use crate::input::Label;

/// Deviation of sightings along an axis \[m\].
const SD_M: f64 = 0.05;

/// Landmarks around, sightings of them from a body, of which the first so many are of something
/// else, and the body's pose.
struct Scene {
    landmarks: Vec<Option<KnownPoint>>,
    seen: Vec<SeenPoint>,
    pose: Isometry3<f64>,
}

impl Scene {
    fn new(seed: u64, n: usize, n_false: usize, is_planar: bool) -> Self {
        let mut random = Seeded(seed);
        let mut scene = Self {
            landmarks: Vec::new(),
            seen: Vec::new(),
            pose: anywhere(&mut random, is_planar),
        };
        for k in 0..n {
            let point = within(&mut random, 4.0, is_planar);
            let error = [(); 3].map(|()| SD_M * random.normal());
            let error = Vector3::from(error).component_mul(&axes(is_planar));
            let in_body = if k < n_false {
                within(&mut random, 4.0, is_planar)
            } else {
                point + error
            };
            scene.landmarks.push(Some(KnownPoint {
                position: scene.pose * point,
                variance: 1e-4,
            }));
            scene.seen.push(SeenPoint {
                label: Label::new(&format!("post {k}")).unwrap(),
                in_body,
                distance_m: point.coords.norm().max(0.5),
                variance: SD_M * SD_M,
                motion_variance: 0.0,
                age: (n - 1 - k) as u64,
                is_refused: true,
            });
        }
        scene
    }

    fn judged_from(&self, pose: &Isometry3<f64>, is_planar: bool) -> Option<Consensus> {
        consensus(&self.seen, &self.landmarks, pose, is_planar)
    }
}

fn axes(is_planar: bool) -> Vector3<f64> {
    Vector3::new(1.0, 1.0, if is_planar { 0.0 } else { 1.0 })
}

fn within(random: &mut Seeded, radius_m: f64, is_planar: bool) -> Point3<f64> {
    loop {
        let point = Vector3::from([(); 3].map(|()| 2.0 * random.uniform() - 1.0));
        let point = point.component_mul(&axes(is_planar));
        if point.norm() <= 1.0 {
            return Point3::from(point * radius_m);
        }
    }
}

fn anywhere(random: &mut Seeded, is_planar: bool) -> Isometry3<f64> {
    let shift = within(random, 20.0, is_planar).coords;
    let turn = if is_planar {
        Vector3::z() * (6.0 * random.uniform() - 3.0)
    } else {
        within(random, 3.0, false).coords
    };
    Isometry3::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn))
}

#[test]
fn a_pose_is_found_where_half_of_the_sightings_are_of_something_else() {
    for is_planar in [true, false] {
        for seed in 0..50 {
            let scene = Scene::new(seed, 16, 8, is_planar);
            let wrong = anywhere(&mut Seeded(1000 + seed), is_planar);
            let Some(found) = scene.judged_from(&wrong, is_planar) else {
                panic!("{seed}: nothing found");
            };
            let off = scene.pose.inv_mul(&found.pose);
            assert!(off.translation.vector.norm() < 0.2, "{seed}: {off}");
            assert!(off.rotation.angle() < 0.1, "{seed}: {off}");
            assert!((6..=11).contains(&found.agreeing.len()), "{seed}");
        }
    }
}

#[test]
fn who_is_where_it_is_thought_to_be_stays_there() {
    for is_planar in [true, false] {
        for seed in 0..50 {
            let scene = Scene::new(seed, 16, 8, is_planar);
            let verdict = scene.judged_from(&scene.pose, is_planar);
            assert!(verdict.is_none(), "{seed}: {verdict:?}");
        }
    }
}

#[test]
fn sightings_of_something_else_agree_on_nothing() {
    for is_planar in [true, false] {
        for n in [4, 5, 6, 16] {
            let scenes = if is_planar { 4000 } else { 400 };
            let found = (0..scenes).filter(|&seed| {
                let scene = Scene::new(seed, n, n, is_planar);
                scene.judged_from(&scene.pose, is_planar).is_some()
            });
            assert!(500 * found.count() as u64 <= scenes, "{is_planar} {n}");
        }
    }
}

#[test]
fn what_was_seen_before_says_nothing_without_one_of_the_latest() {
    let mut scene = Scene::new(1, 16, 0, true);
    let wrong = anywhere(&mut Seeded(2), true);
    assert!(scene.judged_from(&wrong, true).is_some());
    for seen in &mut scene.seen[13..] {
        seen.in_body += Vector3::new(1.0, 2.0, 0.0);
    }
    assert!(scene.judged_from(&wrong, true).is_none());
}

/// What a robot saw before it was carried away agrees on where it was.
#[test]
fn a_few_refused_sightings_count_among_many_from_before() {
    for seed in 0..50 {
        let mut scene = Scene::new(seed, 16, 0, true);
        let before = anywhere(&mut Seeded(1000 + seed), true);
        let to_before = before.inv_mul(&scene.pose);
        for seen in &mut scene.seen[..12] {
            seen.is_refused = false;
            seen.in_body = to_before.inverse() * seen.in_body;
        }
        // Where it was before, the landmarks are where it saw them.
        for (landmark, seen) in scene.landmarks.iter_mut().zip(&scene.seen).take(12) {
            landmark.as_mut().unwrap().position = before * seen.in_body;
        }
        let Some(found) = scene.judged_from(&before, true) else {
            panic!("{seed}: nothing found");
        };
        let off_m = scene.pose.inv_mul(&found.pose).translation.vector.norm();
        assert!(off_m < 0.3, "{seed}: {off_m}");
        let mut agreeing = found.agreeing.iter();
        assert!(agreeing.all(|seen| seen.is_refused), "{seed}");
    }
}

#[test]
fn too_few_landmarks_say_nothing() {
    let wrong = anywhere(&mut Seeded(2), true);
    for n in 0..4 {
        let scene = Scene::new(1, n, 0, true);
        let verdict = scene.judged_from(&wrong, true);
        assert!(verdict.is_none(), "{n}: {verdict:?}");
    }
}

#[test]
fn numbers_that_are_none_are_borne() {
    for bad in [f64::NAN, f64::INFINITY, 0.0, -1.0, 1e300, 1e-300] {
        let mut scene = Scene::new(1, 16, 4, true);
        scene.seen[5].variance = bad;
        scene.seen[6].distance_m = bad;
        scene.seen[7].in_body.x = bad;
        if let Some(landmark) = &mut scene.landmarks[8] {
            landmark.variance = bad;
        }
        scene.landmarks[9] = None;
        for is_planar in [true, false] {
            let _ = scene.judged_from(&scene.pose, is_planar);
            let _ = consensus(&[], &[], &scene.pose, is_planar);
        }
    }
}
