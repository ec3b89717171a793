//! The body that explains few contacts without normals.

use super::*;
use crate::contact::LevelReading;
use crate::indexed_model::IndexedModel;

/// What is predicted of some objects between their contacts, in order.
struct Predicted {
    /// Distances from the true surface \[m\].
    off_m: Vec<f64>,
    /// The same in the deviations that the models claim.
    in_deviations: Vec<f64>,
}

impl Predicted {
    /// Of six objects of a shape, each felt at so many random points.
    fn new(
        contacts: u64,
        shape: impl Fn(u64) -> Felt,
        off_m: impl Fn(&Point3<f64>) -> f64,
    ) -> Self {
        let (mut all_m, mut in_deviations) = (Vec::new(), Vec::new());
        for object in 0..6 {
            let felt = (0..contacts).map(|key| shape(1000 * object + key).0);
            let model = felt_at((1000 * object..).zip(felt));
            for (position_m, error_m) in nodes(&model) {
                all_m.push(off_m(&position_m));
                in_deviations.push(off_m(&position_m) / error_m);
            }
        }
        all_m.sort_by(f64::total_cmp);
        in_deviations.sort_by(f64::total_cmp);
        Self {
            off_m: all_m,
            in_deviations,
        }
    }

    /// Asserts that the median and nine of ten are within these distances, and that the claimed
    /// deviations are those of the errors.
    fn assert_within(&self, median_m: f64, most_m: f64) {
        let count = self.off_m.len();
        assert!(count > 6 * 100, "{count} nodes");
        let [median, most] = [count / 2, count * 9 / 10].map(|at| self.off_m[at]);
        assert!(median < median_m && most < most_m, "{median} {most}");
        let squares = self.in_deviations.iter().map(|own| own * own);
        let claimed = (squares.sum::<f64>() / count as f64).sqrt();
        assert!((0.3..2.0).contains(&claimed), "{claimed}");
    }
}

type Felt = (Point3<f64>, Unit<Vector3<f64>>);

/// A model of noisy contacts with these points.
fn felt_at(points: impl Iterator<Item = (u64, Point3<f64>)>) -> ObjectModel {
    let mut model = ObjectModel::new(ModelSettings::default());
    for (key, point) in points {
        let felt = touch((point, Vector3::z_axis()), &Isometry3::identity(), key);
        model.learn(&Contact::at(felt.position_m, NOISE_M));
    }
    model
}

/// Where a model predicts its surface, and the deviation that it claims there \[m\].
fn nodes(model: &ObjectModel) -> Vec<(Point3<f64>, f64)> {
    let places = IndexedModel::variants(model).0.places;
    let node = |place: &crate::indexed_place::IndexedPlace| {
        let prediction = place.prediction.as_ref()?;
        Some((place.position, prediction.error_m))
    };
    places.iter().filter_map(node).collect()
}

const SIDES_M: [f64; 3] = [0.08, 0.07, 0.11];
const RADIUS_M: f64 = 0.05;
/// Radius of a cup at its foot and its rim, and its height \[m\].
const CUP_M: [f64; 3] = [0.025, 0.045, 0.1];

/// A point of a cup with a lid.
fn on_cup(key: u64) -> Felt {
    let [foot_m, rim_m, height_m] = CUP_M;
    let random = |k: u64| uniform(7_000_000 + 8 * key + k);
    let (sin, cos) = (std::f64::consts::TAU * random(0)).sin_cos();
    let slant_m = height_m.hypot(rim_m - foot_m);
    let areas = [foot_m * foot_m, rim_m * rim_m, (foot_m + rim_m) * slant_m];
    let pick = random(1) * areas.iter().sum::<f64>();
    // Even over a disc, and over a cone between its two radii.
    let between = |from_m: f64, to_m: f64| {
        (from_m * from_m + (to_m * to_m - from_m * from_m) * random(2)).sqrt()
    };
    let (radius_m, z) = if pick < areas[0] {
        (between(0.0, foot_m), 0.0)
    } else if pick < areas[0] + areas[1] {
        (between(0.0, rim_m), height_m)
    } else {
        let radius_m = between(foot_m, rim_m);
        (radius_m, height_m * (radius_m - foot_m) / (rim_m - foot_m))
    };
    let point = Point3::new(radius_m * cos, radius_m * sin, z);
    (point, Vector3::z_axis())
}

/// Distance of a point from the surface of the cup \[m\].
fn off_cup_m(point: &Point3<f64>) -> f64 {
    let [foot_m, rim_m, height_m] = CUP_M;
    let (around_m, z) = (point.coords.xy().norm(), point.z);
    let to_segment = |[r0, z0]: [f64; 2], [r1, z1]: [f64; 2]| {
        let (r, h) = (r1 - r0, z1 - z0);
        let at = ((around_m - r0) * r + (z - z0) * h) / (r * r + h * h);
        let at = at.clamp(0.0, 1.0);
        (around_m - r0 - at * r).hypot(z - z0 - at * h)
    };
    let corners = [
        [0.0, 0.0],
        [foot_m, 0.0],
        [rim_m, height_m],
        [0.0, height_m],
    ];
    let sides = corners.windows(2).map(|ends| to_segment(ends[0], ends[1]));
    sides.fold(f64::INFINITY, f64::min)
}

/// Distance of a point from the surface of the box \[m\].
fn off_box_m(point: &Point3<f64>) -> f64 {
    let apart = point.coords.abs() - Vector3::from(SIDES_M) / 2.0;
    let outside = apart.map(|own| own.max(0.0)).norm();
    if outside > 0.0 { outside } else { -apart.max() }
}

fn off_ball_m(point: &Point3<f64>) -> f64 {
    (point.coords.norm() - RADIUS_M).abs()
}

#[test]
fn sixty_contacts_tell_box_ball_and_cup_to_a_millimetre() {
    let a_box = |key| on_box(SIDES_M, key);
    Predicted::new(60, a_box, off_box_m).assert_within(0.0006, 0.0015);
    let ball = |key| on_ball(RADIUS_M, key);
    Predicted::new(60, ball, off_ball_m).assert_within(0.0006, 0.0015);
    Predicted::new(60, on_cup, off_cup_m).assert_within(0.0006, 0.0015);
}

#[test]
fn twenty_contacts_tell_box_ball_and_cup_to_millimetres() {
    let a_box = |key| on_box(SIDES_M, key);
    Predicted::new(20, a_box, off_box_m).assert_within(0.002, 0.008);
    let ball = |key| on_ball(RADIUS_M, key);
    Predicted::new(20, ball, off_ball_m).assert_within(0.002, 0.008);
    Predicted::new(20, on_cup, off_cup_m).assert_within(0.002, 0.008);
}

/// A body turned, moved and seen in other units of length is the same body.
#[test]
fn a_body_is_the_same_in_any_frame() {
    let points: Vec<Point3<f64>> = (0..40).map(|key| on_box(SIDES_M, key).0).collect();
    let own = nodes(&felt_at((0..).zip(points.iter().copied())));
    let frame = frame();
    let moved = points.iter().map(|point| frame * point);
    let other = nodes(&felt_at((0..).zip(moved)));
    for nodes in [&own, &other] {
        assert!(nodes.len() > 100, "{}", nodes.len());
    }
    let off_m = other
        .iter()
        .map(|(at, _)| off_box_m(&frame.inverse_transform_point(at)));
    let worst_m = off_m.fold(0.0, f64::max);
    assert!(worst_m < 0.004, "{worst_m}");
}

/// What was felt from above is not closed below: no flat end is made up inside.
/// Of many contacts a body is fitted to some.
#[test]
fn two_fingers_that_touch_in_turns_tell_a_body() {
    let points = || (0..1000).map(|key| on_box(SIDES_M, key).0);
    let left = points().filter(|point| point.x < 0.0);
    let right = points().filter(|point| point.x >= 0.0);
    let in_turns = left.zip(right).flat_map(|(left, right)| [left, right]);
    let settings = ModelSettings {
        spacing_m: 0.0005,
        ..ModelSettings::default()
    };
    let mut model = ObjectModel::new(settings);
    for (key, point) in (0..320).zip(in_turns) {
        let felt = touch((point, Vector3::z_axis()), &Isometry3::identity(), key);
        model.learn(&Contact::at(felt.position_m, NOISE_M));
    }
    assert!(model.places().len() > 256, "{}", model.places().len());
    let (places, _) = IndexedModel::variants(&model);
    assert!(places.shares_errors() && !places.is_vague());
}

#[test]
fn what_stands_on_a_table_is_not_supposed_to_end_where_it_was_not_felt() {
    let cap = (0..9000).map(|key| on_ball(RADIUS_M, key).0);
    let upper = (0..9000).map(|key| on_box(SIDES_M, key).0);
    let felt = [
        cap.filter(|at| at.z > 0.025).collect::<Vec<_>>(),
        upper.filter(|at| at.z > 0.0).collect(),
    ];
    for (felt, top_m) in felt.iter().zip([RADIUS_M, SIDES_M[2] / 2.0]) {
        for (from, count) in [(200, 60), (400, 150), (800, 40)] {
            let points = felt[from..from + count].iter().copied();
            let nodes = nodes(&felt_at((0..).zip(points)));
            let is_inside = |at: &Point3<f64>| at.z < top_m - 0.02 && at.coords.xy().norm() < 0.02;
            let inside = nodes.iter().filter(|(at, _)| is_inside(at)).count();
            assert_eq!(inside, 0, "of {} nodes, {count} contacts", nodes.len());
        }
    }
}

#[test]
fn an_outline_is_no_body() {
    for object in 0..40 {
        let random = |k: u64| uniform(9_000_000 + 10 * object + k);
        let lobes = (6.0 * random(0)).floor();
        let points = (0..20_u32).map(|number| {
            let (sin, cos) =
                (0.1 * std::f64::consts::PI * (f64::from(number) + random(1))).sin_cos();
            let radius_m = 0.06 + 0.015 * (lobes * sin.atan2(cos) + 6.0 * random(2)).cos();
            let point = Point3::new(radius_m * cos, radius_m * sin, 0.0);
            (1000 * object + u64::from(number), point)
        });
        let indexed = IndexedModel::variants(&felt_at(points)).0;
        assert!(indexed.is_vague() || !indexed.shares_errors(), "{object}");
    }
}

/// A node has the normal of the side from which the places about it were felt.
#[test]
fn nodes_of_a_body_have_normals_where_places_have() {
    let mut model = ObjectModel::new(ModelSettings::default());
    for key in 0..40 {
        model.learn(&touch(on_ball(RADIUS_M, key), &Isometry3::identity(), key));
    }
    let places = IndexedModel::variants(&model).0.places;
    let nodes = places.iter().filter(|place| place.prediction.is_some());
    assert!(nodes.clone().count() > 100);
    for node in nodes {
        let normal = node.normal.expect("all were felt with one");
        let cos = normal.dot(&node.position.coords.normalize());
        assert!(cos > 0.9, "{cos}");
    }
}

/// Who touches chosen points again and again feels nothing between them.
#[test]
fn between_chosen_points_with_levels_of_their_own_nothing_is_predicted() {
    let mut model = ObjectModel::new(ModelSettings::default());
    let steps = || [-1.0, 0.0, 1.0].into_iter();
    let directions =
        steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| (x, y, z))));
    for (key, (x, y, z)) in (0..).zip(directions.filter(|own| *own != (0.0, 0.0, 0.0))) {
        let point = Point3::from(RADIUS_M * Vector3::new(x, y, z).normalize());
        let level = LevelReading {
            channel: 0,
            value: 10.0 * uniform(3_000 + key),
            sd: 0.03,
        };
        let mut contact = Contact::at(point, NOISE_M);
        contact.levels.push(level);
        model.learn(&contact);
    }
    assert_eq!(nodes(&model), Vec::new());
    let mut library = ObjectLibrary::default();
    library.put(ObjectId(0), model);
    assert_eq!(library.variants().count(), 1, "nor by a body");
}

/// A ball that was touched at these points, with levels that tell little of one another.
fn ball_touched_at(points: impl Iterator<Item = (u64, Vector3<f64>)>) -> ObjectModel {
    let mut model = ObjectModel::new(ModelSettings::default());
    for (key, at) in points {
        let level = at.z + 0.4 * normal(50_000 + key);
        let at = Point3::from(RADIUS_M * at);
        let felt = touch((at, Vector3::z_axis()), &Isometry3::identity(), key);
        let contact = Contact::at(felt.position_m, NOISE_M);
        model.learn(&contact.with_level(0, level, 0.03));
    }
    model
}

/// Who touched points that he chose may touch them again, and between them nothing is felt.
#[test]
fn a_body_is_supposed_of_random_points_and_not_of_chosen_ones() {
    let random = |ball: u64| {
        ball_touched_at((100 * ball..).take(24).map(|key| {
            let at = on_ball(1.0, key).0;
            (key, at.coords)
        }))
    };
    let chosen = |ball: u64| {
        ball_touched_at((100 * ball..).zip(0..24).map(|(key, number)| {
            let z = (f64::from(number) + 0.5) / 12.0 - 1.0;
            let (sin, cos) = (2.4 * f64::from(number)).sin_cos();
            let across = (1.0 - z * z).sqrt();
            (key, Vector3::new(across * cos, across * sin, z))
        }))
    };
    // Those of which neighbouring levels tell less than nothing are lists anyway.
    let variants = |models: &[ObjectModel]| {
        let mut library = ObjectLibrary::default();
        for (id, model) in (0..).zip(models) {
            // Its levels leave open whether anything lies between its places.
            let (places, body) = IndexedModel::variants(model);
            assert!(!places.shares_errors() && body.is_some(), "{id}");
            library.put(ObjectId(id), model.clone());
        }
        library.variants().count()
    };
    let random = [0, 1, 5, 6, 7].map(random);
    assert_eq!(variants(&random), 2 * random.len());
    let chosen = [0, 1, 3, 7].map(chosen);
    assert_eq!(variants(&chosen), chosen.len());
    // Of both kinds, of which four are beyond doubt: each has its own odds.
    let [mixed @ .., _, _, _] = &random;
    let mixed: Vec<ObjectModel> = mixed.iter().chain(&chosen[..2]).cloned().collect();
    assert_eq!(variants(&mixed), 2 * 2 + 2);
}

/// Contacts beside one another are one place, so that random places are never near one another.
#[test]
fn random_contacts_are_not_taken_for_chosen_ones_however_many_they_are() {
    for contacts in [24, 60, 120, 240] {
        let logs = (0..8_u64).filter_map(|ball| {
            let keys = 10_000 + 1_000 * ball..;
            let points = keys
                .take(contacts)
                .map(|key| (key, on_ball(1.0, key).0.coords));
            let (places, body) = IndexedModel::variants(&ball_touched_at(points));
            body.unwrap_or(places).chosen_log
        });
        let mut logs: Vec<f64> = logs.collect();
        logs.sort_by(f64::total_cmp);
        assert!(logs.len() == 8 && logs[5] < 0.0, "{contacts}: {logs:?}");
    }
}
