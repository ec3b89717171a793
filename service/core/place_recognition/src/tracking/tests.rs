//! A robot that walks about a room whose floor shows something else everywhere, and whose odometry
//! turns by more than it says.

use std::f64::consts::{PI, TAU};

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use random::Seeded;
use state::{State, StateReader, StateWriter};

use super::*;
use crate::keyframes::SampleKey;
use crate::similarity::{LoggedView, Turned};
use crate::tuning::tracking as tuning;
use crate::view::View;

const NUMBERS: usize = 24;
const RANGE_M: f64 = 0.5;
const SIDE_M: f64 = 4.0;
/// Part of a view that is of its place.
const PLACE: f64 = 0.7;
const STEP_M: f64 = 0.1;

/// What is seen at a position: waves of random directions, and noise.
struct Floor(Vec<[f64; 3]>);

impl Floor {
    fn new(draws: &mut Seeded) -> Self {
        let wave = |_| {
            let [x, y] = [draws.normal(), draws.normal()].map(|x| x / RANGE_M);
            [x, y, TAU * draws.uniform()]
        };
        Self((0..4 * NUMBERS).map(wave).collect())
    }

    fn seen(&self, at: &Point3<f64>, draws: &mut Seeded) -> Vec<f32> {
        let number = |waves: &[[f64; 3]]| {
            let waves = waves
                .iter()
                .map(|[x, y, phase]| (x * at.x + y * at.y + phase).cos());
            let place: f64 = waves.sum::<f64>() / 2.0_f64.sqrt();
            #[expect(clippy::cast_possible_truncation, reason = "no exact number")]
            let seen = (PLACE.sqrt() * place + (1.0 - PLACE).sqrt() * draws.normal()) as f32;
            seen
        };
        if self.0.is_empty() {
            return vec![0.0; NUMBERS];
        }
        self.0.chunks(4).map(number).collect()
    }
}

/// The room, as a map has it: a view every quarter of a range.
fn map(floor: &Floor, draws: &mut Seeded) -> ViewMap {
    map_at(floor, &Vector3::zeros(), draws)
}

/// The same, with a corner of the room at a point.
fn map_at(floor: &Floor, origin: &Vector3<f64>, draws: &mut Seeded) -> ViewMap {
    let per_side = 32;
    let model = ViewModel {
        channel: 0,
        range_m: RANGE_M,
        turned: Turned::NOTHING,
        stride: 1,
        centre: vec![0.0; NUMBERS],
        centres: Vec::new(),
        projection: (0..NUMBERS * NUMBERS)
            .map(|at| if at % (NUMBERS + 1) == 0 { 1.0 } else { 0.0 })
            .collect(),
        correlations: vec![PLACE; NUMBERS],
    };
    let reference = |number: u32| {
        let [x, y] = [number % per_side, number / per_side]
            .map(|at| (f64::from(at) + 0.5) * SIDE_M / f64::from(per_side));
        let at = Point3::new(x, y, 0.0);
        ReferenceView {
            sample: SampleKey {
                agent: 1,
                session: 0,
                seq: number.into(),
            },
            ordinal: number,
            stretch: 0,
            pose: Some(Isometry3::from(at.coords + origin)),
            components: floor.seen(&at, draws),
        }
    };
    ViewMap::new(model, (0..per_side * per_side).map(reference).collect())
}

/// A robot, and the estimate of it: odometry from where it was put last.
#[derive(Clone)]
struct Walk {
    truth: Isometry3<f64>,
    estimate: Isometry3<f64>,
    in_odom: Isometry3<f64>,
    sd: [f64; 6],
    seq: u64,
    tracker: Option<Tracker>,
}

impl Walk {
    fn new() -> Self {
        let at = pose(2.0, 2.0, 0.0);
        Self {
            truth: at,
            estimate: at,
            in_odom: Isometry3::identity(),
            sd: [0.2, 0.2, 0.0, 0.0, 0.0, 0.2],
            seq: 0,
            tracker: None,
        }
    }

    /// Goes on by a step, turning back at the walls of the room, with so much noise of the turn
    /// [rad].
    fn go(&mut self, noise_rad: f64, draws: &mut Seeded) {
        self.go_in(&Vector3::zeros(), noise_rad, draws);
    }

    /// The same in a room of which a corner is at a point.
    fn go_in(&mut self, origin: &Vector3<f64>, noise_rad: f64, draws: &mut Seeded) {
        let mut turn = 0.3 * draws.normal();
        let ahead = (self.truth * pose(STEP_M, 0.0, turn)).translation.vector - origin;
        if !(0.2..SIDE_M - 0.2).contains(&ahead.x) || !(0.2..SIDE_M - 0.2).contains(&ahead.y) {
            let inwards = Vector3::new(2.0, 2.0, 0.0) + origin - self.truth.translation.vector;
            let heading = self.truth.rotation.euler_angles().2;
            turn = (inwards.y.atan2(inwards.x) - heading + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
        }
        self.truth *= pose(0.0, 0.0, turn) * pose(STEP_M, 0.0, 0.0);
        let read = pose(0.0, 0.0, turn + noise_rad * draws.normal()) * pose(STEP_M, 0.0, 0.0);
        self.estimate *= read;
        self.in_odom *= read;
    }

    /// Sees what there is, and is put where the tracker has it.
    fn see(&mut self, floor: &Floor, map: &ViewMap, draws: &mut Seeded) -> Option<Tracked> {
        self.see_in(floor, &Vector3::zeros(), map, draws)
    }

    /// The same in a room of which a corner is at a point.
    fn see_in(
        &mut self,
        floor: &Floor,
        origin: &Vector3<f64>,
        map: &ViewMap,
        draws: &mut Seeded,
    ) -> Option<Tracked> {
        let at = self.truth.translation.vector - origin;
        let vector = floor.seen(&at.into(), draws);
        let sample = SampleKey {
            agent: 0,
            session: 0,
            seq: self.seq,
        };
        self.seq += 1;
        let view = View {
            sample,
            in_odom: self.in_odom,
            pose: self.estimate,
            covariance: PoseCovariance::from_sd(&self.sd.into()),
            channel: "floor",
            vector: &vector,
        };
        let logged = LoggedView {
            channel: 0,
            sample,
            ordinal: 0,
            stretch: 0,
            in_odom: self.in_odom,
            vector: vector.clone().into(),
        };
        let stamp_ns = i64::try_from(self.seq).unwrap() * 500_000_000;
        let new = || Tracker::new(&view, stamp_ns);
        let tracker = self.tracker.get_or_insert_with(new);
        let tracked = tracker.step(&view, stamp_ns, &logged, map);
        if let Some(tracked) = &tracked {
            self.estimate = tracked.pose;
        }
        tracked
    }

    fn off_m(&self) -> f64 {
        (self.estimate.translation.vector - self.truth.translation.vector).norm()
    }
}

fn pose(x: f64, y: f64, turn: f64) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, turn);
    Isometry3::from_parts(Vector3::new(x, y, 0.0).into(), rotation)
}

/// Mean square errors [m²] of where a robot is by odometry and by what it sees, and of the latter
/// in its variances; and the part of views by which it is not tracked.
fn errors(noise_rad: f64) -> [f64; 4] {
    let (mut sums, mut count, mut lost) = ([0.0; 3], 0.0, 0.0);
    for seed in 0..4 {
        let mut draws = Seeded(seed);
        let floor = Floor::new(&mut draws);
        let map = map(&floor, &mut draws);
        let (mut walk, mut blind) = (Walk::new(), Walk::new().estimate);
        for step in 0..400 {
            let before = walk.in_odom;
            walk.go(noise_rad, &mut draws);
            blind *= before.inv_mul(&walk.in_odom);
            let tracked = walk.see(&floor, &map, &mut draws);
            if step < 100 {
                continue;
            }
            let Some(tracked) = tracked else {
                lost += 1.0;
                continue;
            };
            let variance = tracked.covariance.position_sd_m().powi(2);
            let blind_m = (blind.translation.vector - walk.truth.translation.vector).norm();
            for (sum, new) in sums.iter_mut().zip([
                blind_m.powi(2),
                walk.off_m().powi(2),
                walk.off_m().powi(2) / variance,
            ]) {
                *sum += new;
            }
            count += 1.0;
        }
    }
    let [blind_m2, off_m2, nees] = sums.map(|sum| sum / count);
    [blind_m2, off_m2, nees, lost / (count + lost)]
}

#[test]
fn a_heading_that_errs_by_more_than_it_says_is_followed() {
    for noise_rad in [0.02, 0.2] {
        let [blind_m2, off_m2, nees, lost] = errors(noise_rad);
        let [blind_m, off_m] = [blind_m2, off_m2].map(f64::sqrt);
        assert!(blind_m > 0.5, "{blind_m} m by odometry at {noise_rad} rad");
        assert!(off_m < 0.5 * RANGE_M, "{off_m} m at {noise_rad} rad");
        // What counts of a view is little, since views of real sensors err alike: these do not.
        assert!((0.1..1.5).contains(&nees), "{nees} at {noise_rad} rad");
        assert!(lost < 0.05, "{lost} at {noise_rad} rad");
    }
}

#[test]
fn one_that_is_put_elsewhere_is_followed_there() {
    let mut draws = Seeded(7);
    let floor = Floor::new(&mut draws);
    let map = map(&floor, &mut draws);
    let mut walk = Walk::new();
    let mut step = |walk: &mut Walk| {
        walk.go(0.05, &mut draws);
        walk.see(&floor, &map, &mut draws)
    };
    for _ in 0..50 {
        step(&mut walk);
    }
    assert!(walk.off_m() < RANGE_M, "{}", walk.off_m());
    // Somebody carries it away, and says where to.
    walk.truth = pose(1.0, 3.0, 2.0);
    walk.estimate = pose(1.3, 2.8, 2.5);
    walk.sd = [0.4, 0.4, 0.0, 0.0, 0.0, 0.5];
    for _ in 0..50 {
        step(&mut walk);
    }
    assert!(walk.off_m() < RANGE_M, "{}", walk.off_m());
}

#[test]
fn where_nothing_was_seen_nothing_is_said() {
    let mut draws = Seeded(8);
    let floor = Floor::new(&mut draws);
    let map = map(&floor, &mut draws);
    let mut walk = Walk::new();
    walk.truth.translation.vector += Vector3::x() * 10.0;
    walk.estimate = walk.truth;
    for _ in 0..60 {
        let ahead = pose(STEP_M, 0.0, 0.0);
        (walk.truth, walk.estimate) = (walk.truth * ahead, walk.estimate * ahead);
        walk.in_odom *= ahead;
        assert_eq!(walk.see(&floor, &map, &mut draws), None);
    }
    assert!(walk.off_m() < 1e-9);
}

#[test]
fn what_was_written_goes_on_as_before() {
    let mut draws = Seeded(9);
    let floor = Floor::new(&mut draws);
    let map = map(&floor, &mut draws);
    let mut walk = Walk::new();
    for _ in 0..30 {
        walk.go(0.05, &mut draws);
        walk.see(&floor, &map, &mut draws);
    }
    let mut out = StateWriter::default();
    walk.tracker.as_ref().unwrap().write(&mut out);
    map.write(&mut out);
    let bytes = out.into_bytes();
    let mut input = StateReader::new(&bytes);
    let tracker = Tracker::read(&mut input).unwrap();
    let read = ViewMap::read(&mut input).unwrap();
    assert!(read == map && read.is_sound(Some(NUMBERS)) && tracker.is_sound(1));
    assert!(!read.is_sound(Some(NUMBERS + 1)) && !tracker.is_sound(0));
    let next = |walk: &mut Walk, map: &ViewMap| walk.see(&floor, map, &mut Seeded(10));
    let mut restored = Walk {
        tracker: Some(tracker),
        ..walk.clone()
    };
    let by_restored = next(&mut restored, &read);
    assert!(by_restored.is_some());
    assert_eq!(by_restored, next(&mut walk, &map));
}

#[test]
fn a_covered_sensor_and_a_surer_estimate_change_nothing() {
    let mut draws = Seeded(11);
    let floor = Floor::new(&mut draws);
    let map = map(&floor, &mut draws);
    let mut walk = Walk::new();
    for _ in 0..30 {
        walk.go(0.05, &mut draws);
        walk.see(&floor, &map, &mut draws);
    }
    let fitting = walk.tracker.as_ref().unwrap().fitting;
    assert!(fitting > 10, "{fitting}");
    // It shows the mean of all views from now on.
    let covered = Floor(Vec::new());
    for _ in 0..30 {
        walk.go(0.05, &mut draws);
        assert_eq!(walk.see(&covered, &map, &mut draws), None);
    }
    assert_eq!(walk.tracker.as_ref().unwrap().fitting, fitting);
    // It is told where it is to a centimetre, again and again.
    walk.sd = [0.01, 0.01, 0.0, 0.0, 0.0, 0.01];
    for _ in 0..30 {
        walk.go(0.05, &mut draws);
        walk.estimate = walk.truth;
        assert_eq!(walk.see(&floor, &map, &mut draws), None);
    }
}

#[test]
fn a_map_far_from_its_origin_is_as_one_about_it() {
    let far = Vector3::new(5e6, -3e6, 0.0);
    let off_m = [Vector3::zeros(), far].map(|origin| {
        let mut draws = Seeded(12);
        let floor = Floor::new(&mut draws);
        let map = map_at(&floor, &origin, &mut draws);
        let mut walk = Walk::new();
        walk.truth.translation.vector += origin;
        walk.estimate = walk.truth;
        let mut sum = 0.0;
        for _ in 0..100 {
            walk.go_in(&origin, 0.05, &mut draws);
            walk.see_in(&floor, &origin, &map, &mut draws);
            sum += walk.off_m();
        }
        sum / 100.0
    });
    assert!((off_m[0] - off_m[1]).abs() < 0.01, "{off_m:?}");
}

#[test]
fn views_ahead_say_nothing_of_one_who_looks_behind() {
    let mut draws = Seeded(7);
    let floor = Floor::new(&mut draws);
    let at = Point3::new(2.1, 1.9, 0.0);
    let seen = floor.seen(&at, &mut draws);
    let view = LoggedView {
        channel: 0,
        sample: SampleKey {
            agent: 0,
            session: 0,
            seq: 0,
        },
        ordinal: 0,
        stretch: 0,
        in_odom: Isometry3::identity(),
        vector: seen.clone().into(),
    };
    // All views of the map were taken with one heading.
    let nats = |turned: Turned, turn_rad: f64, tilt_rad: f64| {
        let mut map = map(&floor, &mut Seeded(8));
        map.model.turned = turned;
        let tilted = UnitQuaternion::from_euler_angles(tilt_rad, 0.0, 0.5);
        let estimate = Isometry3::from_parts(at.into(), tilted);
        let expected = expected::Expected::of(&seen, &view, &map, (&estimate, [at, at]));
        expected.log_likelihood(&at, turn_rad - 0.5)
    };
    let camera = Turned::of_parts([1.0, 0.5, 0.0, 0.0, 0.0]);
    let all_round = nats(Turned::NOTHING, PI, 0.0);
    assert!(all_round > 2.0, "{all_round}");
    let nothing = tuning::ELSE.ln();
    for (turn_rad, tilt_rad) in [(PI, 0.0), (-PI / 2.0, 0.0), (0.0, PI / 2.0), (PI, PI / 2.0)] {
        let behind = nats(camera, turn_rad, tilt_rad);
        assert!((behind - nothing).abs() < 1e-9, "{behind}");
    }
    for turn_rad in [0.0, TAU, -TAU] {
        let ahead = nats(camera, turn_rad, 0.0);
        assert!(
            (ahead - nats(Turned::NOTHING, 0.0, 0.0)).abs() < 1e-9,
            "{ahead}"
        );
    }
    assert!(nats(camera, 0.5, 0.0) < nats(camera, 0.0, 0.0));
}
