use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::*;

/// Numbers within ±1 that follow from a seed.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 / (1_u64 << 52) as f64) - 1.0
    }

    fn point(&mut self, half_m: [f64; 3]) -> Point3<f64> {
        Point3::from(half_m.map(|half| half * self.next()))
    }
}

const FLOOR: [f64; 3] = [8.0, 5.0, 0.0];
const HALL: [f64; 3] = [8.0, 5.0, 3.0];
const SD_M: f64 = 0.1;

fn world(numbers: &mut Numbers, n: usize, half_m: [f64; 3]) -> Vec<Point3<f64>> {
    (0..n).map(|_| numbers.point(half_m)).collect()
}

/// What a frame knows of points: each off by about a tenth of a metre, in a frame at a pose.
fn seen_points(
    numbers: &mut Numbers,
    frame: &Isometry3<f64>,
    points: &[Point3<f64>],
    is_planar: bool,
) -> Vec<UncertainPoint> {
    let point = |point: &Point3<f64>| {
        // Uniform numbers within √3 deviations.
        let reach = 3.0_f64.sqrt() * SD_M;
        let off = numbers.point([reach, reach, if is_planar { 0.0 } else { reach }]);
        UncertainPoint {
            position: frame.inverse_transform_point(&(point + off.coords)),
            variance: SD_M * SD_M,
        }
    };
    points.iter().map(point).collect()
}

fn motion(shift: [f64; 3], turn: Vector3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(
        Vector3::from(shift).into(),
        UnitQuaternion::from_scaled_axis(turn),
    )
}

/// The order in which the newer frame knows what the older one has in order.
fn shuffled<T: Clone>(numbers: &mut Numbers, items: &[T]) -> (Vec<usize>, Vec<T>) {
    let mut keyed: Vec<(f64, usize)> = (0..items.len()).map(|at| (numbers.next(), at)).collect();
    keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let order: Vec<usize> = keyed.iter().map(|&(_, at)| at).collect();
    let items = order.iter().map(|&at| items[at].clone()).collect();
    (order, items)
}

/// How far a motion lays points from where they are, at most \[m\].
fn off_m(found: &Registration, frame: &Isometry3<f64>, points: &[Point3<f64>]) -> f64 {
    let off = |point: &Point3<f64>| (found.pose * (frame.inverse() * point) - point).norm();
    points.iter().map(off).fold(0.0, f64::max)
}

/// Whether the correspondences are the same points, or points so close to one another that it is
/// open which is which.
fn are_right(found: &Registration, order: &[usize], points: &[Point3<f64>]) -> bool {
    let off = |&(one, other): &(usize, usize)| (points[one] - points[order[other]]).norm();
    found
        .correspondences
        .iter()
        .all(|correspondence| off(correspondence) < 8.0 * SD_M)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_frame_on_the_floor_is_found_by_where_its_landmarks_lie(
        seed in any::<u64>(), x in -20.0..20.0_f64, y in -20.0..20.0_f64, heading in -3.1..3.1_f64,
    ) {
        let numbers = &mut Numbers(seed);
        let points = world(numbers, 15, FLOOR);
        let frame = motion([x, y, 0.0], Vector3::z() * heading);
        let older = seen_points(numbers, &Isometry3::identity(), &points, true);
        let (order, seen) = shuffled(numbers, &points);
        let newer = seen_points(numbers, &frame, &seen, true);
        // A world may happen to be ambiguous; then nothing is claimed.
        if let Some(found) = register(&older, &newer, true) {
            prop_assert!(off_m(&found, &frame, &points) < 0.5);
            prop_assert!(found.pose.translation.z.abs() < 1e-12);
            prop_assert!(found.correspondences.len() >= 5);
            prop_assert!(are_right(&found, &order, &points));
        }
    }

    #[test]
    fn what_is_nowhere_the_same_is_never_claimed(
        seed in any::<u64>(),
        n in 5_usize..60,
        is_planar: bool,
    ) {
        let numbers = &mut Numbers(seed);
        let half_m = if is_planar { FLOOR } else { HALL };
        let (one, other) = (world(numbers, n, half_m), world(numbers, 20, half_m));
        let older = seen_points(numbers, &Isometry3::identity(), &one, is_planar);
        let newer = seen_points(numbers, &Isometry3::identity(), &other, is_planar);
        prop_assert_eq!(register(&older, &newer, is_planar), None);
    }

    #[test]
    fn a_mirrored_constellation_is_another_one(seed in any::<u64>(), heading in -3.1..3.1_f64) {
        let numbers = &mut Numbers(seed);
        let points = world(numbers, 15, FLOOR);
        let older = seen_points(numbers, &Isometry3::identity(), &points, true);
        let mirrored = points.iter().map(|point| Point3::new(-point.x, point.y, point.z));
        let mirrored: Vec<_> = mirrored.collect();
        let frame = motion([1.0, 2.0, 0.0], Vector3::z() * heading);
        let newer = seen_points(numbers, &frame, &mirrored, true);
        prop_assert_eq!(register(&older, &newer, true), None);
        // As high as wide, for a flat world is much like its mirror image turned upside down.
        let points = world(numbers, 15, [6.0; 3]);
        let older = seen_points(numbers, &Isometry3::identity(), &points, false);
        let mirrored = points.iter().map(|point| Point3::new(-point.x, point.y, point.z));
        let mirrored: Vec<_> = mirrored.collect();
        let frame = motion([1.0, 2.0, -1.0], Vector3::y() * heading);
        let newer = seen_points(numbers, &frame, &mirrored, false);
        prop_assert_eq!(register(&older, &newer, false), None);
    }

    #[test]
    fn a_frame_in_space_is_found_by_where_its_landmarks_lie(
        seed in any::<u64>(),
        shift in prop::array::uniform3(-9.0..9.0_f64),
        turn in prop::array::uniform3(-1.8..1.8_f64),
    ) {
        let numbers = &mut Numbers(seed);
        let points = world(numbers, 15, HALL);
        let frame = motion(shift, turn.into());
        let older = seen_points(numbers, &Isometry3::identity(), &points, false);
        let (order, seen) = shuffled(numbers, &points);
        let newer = seen_points(numbers, &frame, &seen, false);
        if let Some(found) = register(&older, &newer, false) {
            prop_assert!(off_m(&found, &frame, &points) < 0.5);
            prop_assert!(are_right(&found, &order, &points));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// Landmarks that hang together, as on one board, agree together: that is one agreement.
    #[test]
    fn boards_with_many_landmarks_count_once(
        seed in any::<u64>(),
        n_boards in 2_usize..7,
        is_planar: bool,
    ) {
        let numbers = &mut Numbers(seed);
        let half_m = if is_planar { FLOOR } else { HALL };
        let mut boards = || {
            let middles = world(numbers, n_boards, half_m);
            let corners = middles.iter().flat_map(|middle| {
                [[0.0, 0.0], [0.2, 0.0], [0.0, 0.2], [0.2, 0.2]]
                    .map(|[x, y]| middle + Vector3::new(x, y, 0.0))
            });
            let corners: Vec<_> = corners.collect();
            seen_points(numbers, &Isometry3::identity(), &corners, is_planar)
        };
        let (older, newer) = (boards(), boards());
        prop_assert_eq!(register(&older, &newer, is_planar), None);
    }
}

/// Of so many worlds, in how many a frame is found.
fn n_found(n_common: usize, n_own: usize, is_planar: bool) -> usize {
    let half_m = if is_planar { FLOOR } else { HALL };
    let found = (0..40).filter(|&seed| {
        let numbers = &mut Numbers(seed);
        let common = world(numbers, n_common, half_m);
        let [one, other] = [0, 1].map(|_| [common.clone(), world(numbers, n_own, half_m)].concat());
        let older = seen_points(numbers, &Isometry3::identity(), &one, is_planar);
        let frame = motion([3.0, -7.0, 0.0], Vector3::z() * -2.9);
        let newer = seen_points(numbers, &frame, &other, is_planar);
        register(&older, &newer, is_planar).is_some()
    });
    found.count()
}

#[test]
fn most_worlds_tell_enough() {
    let found = [(15, 0, true), (12, 6, true), (12, 0, false), (4, 0, true)];
    let found = found.map(|(common, own, is_planar)| n_found(common, own, is_planar));
    let least = [36, 16, 30, 0];
    assert!(
        found
            .iter()
            .zip(least)
            .all(|(&found, least)| found >= least),
        "{found:?}"
    );
    assert_eq!(found[3], 0, "four say too little");
}

/// In these a landmark lies nearer to another one than to itself, since both estimates are off: on
/// the floor, then in space. Such a pair was taken for one landmark, and the first motions were
/// fitted to it.
#[test]
fn landmarks_that_may_be_others_are_no_twins() {
    let known = [(1617, true), (2317, true), (40, false), (1217, false)];
    let others = (0..100).flat_map(|seed| [(seed, true), (seed, false)]);
    for (seed, is_planar) in known.into_iter().chain(others) {
        let numbers = &mut Numbers(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(seed));
        let points = world(numbers, 15, if is_planar { FLOOR } else { HALL });
        let frame = motion([3.0, -7.0, 0.0], Vector3::z() * -2.9);
        let older = seen_points(numbers, &Isometry3::identity(), &points, is_planar);
        let (order, seen) = shuffled(numbers, &points);
        let newer = seen_points(numbers, &frame, &seen, is_planar);
        let found = register(&older, &newer, is_planar).expect("it is alike");
        assert!(off_m(&found, &frame, &points) < 0.5, "world {seed}");
        assert!(are_right(&found, &order, &points), "world {seed}");
        assert!(
            found.correspondences.len() >= 8,
            "world {seed}: {:?}",
            found.correspondences
        );
    }
}

#[test]
fn regular_worlds_are_not_claimed() {
    let numbers = &mut Numbers(5);
    let grid = |columns: usize, rows: usize, step_m: f64| -> Vec<Point3<f64>> {
        let at = |k: usize| {
            Point3::new(
                (k % columns) as f64 * step_m,
                (k / columns) as f64 * step_m,
                0.0,
            )
        };
        (0..columns * rows).map(at).collect()
    };
    let mut worlds = vec![
        grid(4, 4, 2.0),
        grid(8, 2, 1.5),
        grid(12, 1, 2.0),
        grid(9, 8, 2.0),
    ];
    // A room that looks the same from its other side.
    let half = world(numbers, 8, FLOOR);
    let turned = half
        .iter()
        .map(|point| Point3::new(-point.x, -point.y, point.z));
    worlds.push(half.iter().copied().chain(turned).collect());
    // The same group of landmarks in two places.
    let group = world(numbers, 6, [1.5, 1.5, 0.0]);
    let places = [0.0, 7.0].map(|x| Vector3::new(x, 0.4 * x, 0.0));
    let rooms = places
        .iter()
        .flat_map(|shift| group.iter().map(move |point| point + shift));
    worlds.push(rooms.collect());
    for (number, points) in worlds.iter().enumerate() {
        for frame in [
            motion([4.0, -2.0, 0.0], Vector3::z() * 2.0),
            Isometry3::identity(),
        ] {
            let older = seen_points(numbers, &Isometry3::identity(), points, true);
            // What was seen of the world by the newer frame may be all of it or a part.
            for seen in [points.len(), points.len() / 2] {
                if number == 5 && seen == points.len() {
                    continue; // both places together are only in one place
                }
                let newer = seen_points(numbers, &frame, &points[..seen], true);
                assert_eq!(
                    register(&older, &newer, true),
                    None,
                    "world {number}, {seen} seen"
                );
            }
        }
    }
}

#[test]
fn numbers_beyond_all_bounds_are_no_likeness() {
    let point = |x: f64, y: f64, variance: f64| UncertainPoint {
        position: Point3::new(x, y, 0.0),
        variance,
    };
    for points in [
        vec![point(0.0, 0.0, 0.01); 20],
        (0..20)
            .map(|k| point(f64::from(k), f64::NAN, 0.01))
            .collect(),
        (0..20)
            .map(|k| point(1e300 * f64::from(k), 1e300, 1e200))
            .collect(),
        (0..20)
            .map(|k| point(f64::from(k * k), f64::from(k), f64::INFINITY))
            .collect(),
        (0..20)
            .map(|k| point(f64::from(k * k), 0.0, 0.0))
            .collect::<Vec<UncertainPoint>>(),
    ] {
        for is_planar in [true, false] {
            let found = register(&points, &points, is_planar);
            let is_exact = points[0].variance == 0.0;
            assert!(found.is_none() || (is_exact && is_planar), "{found:?}");
        }
    }
    assert_eq!(register(&[], &[], true), None);
}
