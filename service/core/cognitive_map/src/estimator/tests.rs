mod effects;

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Point3, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;

use super::agent_filter::BODY_DIM;
use super::innovation::PointInnovation;
use super::*;
use crate::input::{Label, Motion, PoseNoise, RangeBearing, Relation, RelativePosition, StartPose};

pub(super) const SECOND_NS: i64 = 1_000_000_000;

fn label(number: usize) -> Label {
    Label::new(&format!("post-{number}")).unwrap()
}

pub(super) fn start(pose: &Isometry3<f64>, sd: f64) -> StartPose {
    let noise = PoseNoise::new([sd; 3], [0.3 * sd; 3]).unwrap();
    StartPose::new(
        pose.translation.vector.into(),
        pose.rotation.coords.into(),
        noise,
    )
    .unwrap()
}

/// A motion with noise of its own.
fn motion(linear: [f64; 3], angular: [f64; 3]) -> Motion {
    let noise = PoseNoise::new([0.01; 3], [0.005; 3]).unwrap();
    Motion::from_velocity(linear, angular, 1.0, Some(noise)).unwrap()
}

/// What is seen of a point from a pose, without error.
pub(super) fn polar(pose: &Isometry3<f64>, point: &Point3<f64>) -> Relation {
    let seen = pose.inverse_transform_point(point).coords;
    let azimuth = seen.y.atan2(seen.x);
    let elevation = seen.z.atan2(seen.x.hypot(seen.y));
    let relation = RangeBearing::new(seen.norm(), azimuth, elevation, 0.1, 0.02).unwrap();
    Relation::RangeBearing(relation)
}

const POSTS: [[f64; 3]; 5] = [
    [4.0, 1.0, 0.5],
    [-3.0, 2.0, -1.0],
    [1.0, -4.0, 1.0],
    [2.0, 5.0, 0.0],
    [-4.0, -3.0, 0.3],
];

/// A walk with turns in space, seeing a post after each step.
fn walk(
    estimator: &mut Estimator,
    agent: u32,
    from: &Isometry3<f64>,
    steps: usize,
) -> Isometry3<f64> {
    let mut truth = *from;
    for step in 0..steps {
        let turn = [0.05, -0.03, 0.4 * (step as f64).sin()];
        let moved = motion([0.3, 0.05, -0.02], turn);
        truth *= moved.increment();
        let stamp_ns = i64::try_from(step + 1).unwrap() * SECOND_NS;
        estimator.motion(agent, stamp_ns, &moved, &mut Vec::new());
        let post = step % POSTS.len();
        let relation = polar(&truth, &(from * Point3::from(POSTS[post])));
        estimator.landmark(agent, stamp_ns, &label(post), &relation, &mut Vec::new());
    }
    truth
}

/// Entries of a row by column, right side, standard deviation.
type Row = (Vec<(usize, f64)>, f64, f64);

#[test]
fn a_linear_problem_has_the_solution_of_least_squares() {
    let parameters = Parameters {
        length_error_sd: 0.0,
        angle_error_sd: 0.0,
        bias_sd_rad_s: 0.0,
        soft: f64::INFINITY,
        ..Parameters::default()
    };
    let mut estimator = Estimator::new(parameters);
    let agent = estimator.enrol();
    let known = PoseNoise::new([0.5; 3], [0.0; 3]).unwrap();
    let told = StartPose::new([0.0; 3], [0.0, 0.0, 0.0, 1.0], known).unwrap();
    estimator.start_pose(agent, &told, &mut Vec::new());

    // Unknowns along x: four positions of the agent, then two landmarks. Rows: A x = b, each of its
    // sd.
    let mut rows: Vec<Row> = vec![(vec![(0, 1.0)], 0.0, 0.5)];
    let sightings = [
        (0, 0, 2.01),
        (1, 1, 3.02),
        (2, 0, 0.02),
        (3, 1, 0.96),
        (3, 0, -1.03),
    ];
    let steps = [1.0, 0.98, 1.03];
    for k in 0..4 {
        let stamp_ns = i64::try_from(k).unwrap() * SECOND_NS;
        if k > 0 {
            let noise = PoseNoise::new([0.1; 3], [0.0; 3]).unwrap();
            let moved =
                Motion::from_increment([steps[k - 1], 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], Some(noise));
            estimator.motion(agent, stamp_ns, &moved.unwrap(), &mut Vec::new());
            rows.push((vec![(k - 1, -1.0), (k, 1.0)], steps[k - 1], 0.1));
        }
        for (_, post, seen) in sightings.iter().filter(|sighting| sighting.0 == k) {
            let relation = RelativePosition::new([*seen, 0.0, 0.0], [0.2; 3]).unwrap();
            estimator.landmark(
                agent,
                stamp_ns,
                &label(*post),
                &Relation::Position(relation),
                &mut Vec::new(),
            );
            rows.push((vec![(k, -1.0), (4 + post, 1.0)], *seen, 0.2));
        }
    }
    let matrix = DMatrix::from_fn(rows.len(), 6, |row, column| {
        let entry = rows[row].0.iter().find(|entry| entry.0 == column);
        entry.map_or(0.0, |entry| entry.1 / rows[row].2)
    });
    let right = DVector::from_fn(rows.len(), |row, _| rows[row].1 / rows[row].2);
    let covariance = (matrix.transpose() * &matrix).try_inverse().unwrap();
    let solution = &covariance * matrix.transpose() * right;

    let (pose, spread) = estimator.pose(agent).unwrap();
    assert!(
        (pose.translation.x - solution[3]).abs() < 1e-9,
        "{pose} {solution}"
    );
    assert!((spread.matrix()[(0, 0)] - covariance[(3, 3)]).abs() < 1e-9);
    for (k, (_, position, spread)) in estimator.landmarks().enumerate() {
        assert!((position.x - solution[4 + k]).abs() < 1e-9);
        // Sightings count as vaguer by a hundred-millionth of the variances that they compare,
        // against rounding; these are below 1 m².
        assert!((spread[(0, 0)] - covariance[(4 + k, 4 + k)]).abs() < 1e-8);
    }
}

#[test]
fn exact_sightings_keep_a_drifting_agent_on_its_way_and_the_covariance_sound() {
    let mut estimator = Estimator::new(Parameters::default());
    let agent = estimator.enrol();
    estimator.start_pose(agent, &start(&Isometry3::identity(), 0.0), &mut Vec::new());
    let truth = walk(&mut estimator, agent, &Isometry3::identity(), 200);
    let (pose, spread) = estimator.pose(agent).unwrap();
    assert!((pose.translation.vector - truth.translation.vector).norm() < 1e-6);
    assert!(spread.position_sd_m() < 2.0);
    let joint = &estimator.frame(0).covariance;
    let dense = DMatrix::from_row_slice(joint.dim(), joint.dim(), joint.entries());
    assert_eq!(dense, dense.transpose(), "exactly symmetric");
    let least = dense.symmetric_eigenvalues().min();
    assert!(least > -1e-12, "{least}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Nothing depends on where the map's origin lies, nor on how its axes point.
    #[test]
    fn estimates_move_with_the_frame(
        shift in prop::array::uniform3(-50.0..50.0_f64),
        turn in prop::array::uniform3(-1.8..1.8_f64),
    ) {
        let frame = Isometry3::new(shift.into(), turn.into());
        let run = |from: &Isometry3<f64>| {
            let mut estimator = Estimator::new(Parameters::default());
            let agent = estimator.enrol();
            estimator.start_pose(agent, &start(from, 0.1), &mut Vec::new());
            // Seen from where the agent is not, so that there is something to correct.
            let off = from * Isometry3::translation(0.05, -0.1, 0.02);
            let mut truth = off;
            for (step, post) in POSTS.iter().cycle().take(40).enumerate() {
                let moved = motion([0.3, 0.0, 0.1], [0.0, 0.1, -0.3]);
                truth *= moved.increment();
                let stamp_ns = i64::try_from(step).unwrap() * SECOND_NS;
                estimator.motion(agent, stamp_ns, &moved, &mut Vec::new());
                let post = from * Point3::from(*post);
                let (name, seen) = (label(step % POSTS.len()), polar(&truth, &post));
                estimator.landmark(agent, stamp_ns, &name, &seen, &mut Vec::new());
            }
            estimator.pose(agent).unwrap()
        };
        let (here, spread_here) = run(&Isometry3::identity());
        let (there, spread_there) = run(&frame);
        let rest = (frame * here).inv_mul(&there);
        let (length_m, angle_rad) = (rest.translation.vector.norm(), rest.rotation.angle());
        prop_assert!(length_m < 1e-7 && angle_rad < 1e-7, "{rest}");
        let off = (spread_here.matrix() - spread_there.matrix()).amax();
        prop_assert!(off < 1e-7 * spread_here.matrix().amax(), "{off}");
    }

    /// Derivatives against differences, on both sides, behind and overhead.
    #[test]
    fn derivatives_of_a_sighting(
        point in prop::array::uniform3(-5.0..5.0_f64), off in prop::array::uniform3(-0.3..0.3_f64),
    ) {
        let point = Vector3::from(point);
        prop_assume!(point.norm() > 1.0);
        let relation = polar(&Isometry3::identity(), &Point3::from(point));
        let expected = point + Vector3::from(off);
        let innovation = PointInnovation::new(&relation, &expected).unwrap();
        let differences = Matrix3::from_columns(&[0, 1, 2].map(|axis| {
            let mut step = Vector3::zeros();
            step[axis] = 1e-6;
            let residual = |at| PointInnovation::new(&relation, &at).unwrap().residual;
            (residual(expected - step) - residual(expected + step)) / 2e-6
        }));
        prop_assert!((differences - innovation.by_point).amax() < 1e-5);
    }
}

#[test]
fn waiting_with_the_covariance_changes_nothing() {
    // What lasting errors renew counts from the next flush on.
    let parameters = Parameters {
        calibration_renewal: 0.0,
        ..Parameters::default()
    };
    let run = |flushes: bool| {
        let mut estimator = Estimator::new(parameters.clone());
        let agent = estimator.enrol();
        estimator.start_pose(agent, &start(&Isometry3::identity(), 0.1), &mut Vec::new());
        walk(&mut estimator, agent, &Isometry3::identity(), 7);
        for step in 0..50 {
            estimator.motion(
                agent,
                (10 + step) * SECOND_NS,
                &motion([0.2, 0.0, 0.0], [0.0, 0.2, 0.3]),
                &mut Vec::new(),
            );
            if flushes {
                estimator.frame_mut(0).flush();
            }
        }
        estimator.frame_mut(0).flush();
        estimator.frame(0).covariance.entries().to_vec()
    };
    let pairs = run(true).into_iter().zip(run(false));
    let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-10, "{off}");
}

/// An agent whose sightings say that it is elsewhere ends up there; a label that lies does not.
#[test]
fn a_moved_agent_comes_back_and_a_wrong_label_harms_nothing() {
    let mut estimator = Estimator::new(Parameters::default());
    let agent = estimator.enrol();
    estimator.start_pose(agent, &start(&Isometry3::identity(), 0.0), &mut Vec::new());
    let truth = walk(&mut estimator, agent, &Isometry3::identity(), 60);
    let seen = |estimator: &mut Estimator, pose: &Isometry3<f64>, k: usize, wrong: bool| {
        let stamp_ns = i64::try_from(100 + k).unwrap() * SECOND_NS;
        let post = Point3::from(POSTS[(k + usize::from(wrong)) % POSTS.len()]);
        estimator.landmark(
            agent,
            stamp_ns,
            &label(k % POSTS.len()),
            &polar(pose, &post),
            &mut Vec::new(),
        );
        let (estimate, _) = estimator.pose(agent).unwrap();
        (estimate.translation.vector - pose.translation.vector).norm()
    };
    for k in 0..3 {
        assert!(
            seen(&mut estimator, &truth, k, true) < 0.05,
            "a wrong label"
        );
    }
    let moved = truth * Isometry3::new(Vector3::new(1.5, -1.0, 0.0), Vector3::z() * 0.5);
    let error = (0..150)
        .map(|k| seen(&mut estimator, &moved, k, false))
        .last()
        .unwrap();
    assert!(error < 0.3, "{error}");
    for ((_, position, _), post) in estimator.landmarks().zip(POSTS) {
        assert!(
            (position - Point3::from(post)).norm() < 0.3,
            "the map stays: {position}"
        );
    }
}

#[test]
fn a_sighting_of_an_agent_counts_alike_whoever_comes_first() {
    let step = motion([0.5, 0.0, 0.0], [0.0, 0.0, 0.2]);
    let seen = Relation::Position(RelativePosition::new([3.1, 0.2, 0.0], [0.1; 3]).unwrap());
    let run = |late_target: bool| {
        let mut estimator = Estimator::new(Parameters::default());
        let [observer, target] = [(); 2].map(|()| estimator.enrol());
        estimator.start_pose(
            observer,
            &start(&Isometry3::identity(), 0.1),
            &mut Vec::new(),
        );
        estimator.start_pose(
            target,
            &start(&Isometry3::translation(3.0, 0.0, 0.0), 0.1),
            &mut Vec::new(),
        );
        let target_moves = |estimator: &mut Estimator| {
            for k in 1..4 {
                estimator.motion(target, k * SECOND_NS, &step, &mut Vec::new());
            }
        };
        if !late_target {
            target_moves(&mut estimator);
        }
        for k in 1..3 {
            estimator.motion(observer, k * SECOND_NS, &step, &mut Vec::new());
        }
        estimator.sighting(observer, 2 * SECOND_NS, target, &seen, &mut Vec::new());
        if late_target {
            target_moves(&mut estimator);
        }
        [observer, target].map(|agent| estimator.pose(agent).unwrap().0.translation.vector)
    };
    let apart = Estimator::new(Parameters::default());
    assert_eq!(apart.pose(0), None);
    for (early, late) in run(false).iter().zip(run(true)) {
        // The target's noise between the sighting and now is not told apart from that before.
        assert!((early - late).norm() < 5e-3, "{early} {late}");
    }
}

/// Two agents which know nothing of each other see the same posts, and one another.
#[test]
fn frames_are_laid_into_one_another() {
    let mut estimator = Estimator::new(Parameters::default());
    let [first, second] = [(); 2].map(|()| estimator.enrol());
    assert!(estimator.found(first) && !estimator.found(second));
    let apart = Isometry3::from_parts(
        Vector3::new(1.0, -2.0, 0.5).into(),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.2, -0.4, 1.5)),
    );
    let mut truth = [Isometry3::identity(), apart];
    let mut effects = Vec::new();
    for step in 0..60 {
        for (agent, truth) in [first, second].into_iter().zip(&mut truth) {
            let moved = motion([0.2, 0.0, 0.0], [0.0, 0.02, 0.1]);
            *truth *= moved.increment();
            let stamp_ns = i64::from(step + 1) * SECOND_NS;
            estimator.motion(agent, stamp_ns, &moved, &mut Vec::new());
            for (number, post) in POSTS.iter().enumerate() {
                let relation = polar(truth, &Point3::from(*post));
                estimator.landmark(agent, stamp_ns, &label(number), &relation, &mut effects);
            }
        }
    }
    assert!(estimator.is_in_map(second));
    let merged: Vec<FramesMerged> = effects.into_iter().filter_map(as_merged).collect();
    assert_eq!(merged.len(), 1);
    assert_eq!((merged[0].frame, merged[0].into), (2, 0));
    assert_eq!(merged[0].agents, [second]);
    assert!((merged[0].pose.to_homogeneous() - apart.to_homogeneous()).amax() < 0.1);
    let (pose, _) = estimator.pose(second).unwrap();
    let rest = truth[1].inv_mul(&pose);
    assert!(
        rest.translation.vector.norm() < 0.02 && rest.rotation.angle() < 0.01,
        "{rest}"
    );
    assert_eq!(estimator.landmarks().count(), POSTS.len());
}

#[test]
fn more_landmarks_than_are_held_jointly_are_kept() {
    let mut estimator = Estimator::new(Parameters::default());
    let agent = estimator.enrol();
    estimator.start_pose(agent, &start(&Isometry3::identity(), 0.0), &mut Vec::new());
    let place = |number: usize| Point3::new(2.0 + (number % 10) as f64, (number / 10) as f64, 0.0);
    for round in 0..3 {
        for number in 0..150 {
            let relation = polar(&Isometry3::identity(), &place(number));
            estimator.landmark(
                agent,
                round * SECOND_NS,
                &label(number),
                &relation,
                &mut Vec::new(),
            );
        }
    }
    assert_eq!(estimator.landmarks().count(), 96);
    assert_eq!(estimator.frame(0).archive.len(), 150 - 96);
    for (_, position, covariance) in estimator.landmarks() {
        assert!(covariance.iter().all(|entry| entry.is_finite()));
        let nearest = (0..150).map(|number| (place(number) - position).norm());
        assert!(nearest.fold(f64::INFINITY, f64::min) < 1e-6);
    }
}

#[test]
fn a_new_session_starts_less_certain() {
    let mut estimator = Estimator::new(Parameters::default());
    let agent = estimator.enrol();
    estimator.start_pose(agent, &start(&Isometry3::identity(), 0.1), &mut Vec::new());
    let before = estimator.pose(agent).unwrap().1.position_sd_m();
    estimator.go_unseen(agent, &Vector6::repeat(1.0));
    let after = estimator.pose(agent).unwrap().1.position_sd_m();
    assert!((after * after - before * before - 3.0).abs() < 1e-9);
    assert_eq!(estimator.in_odom(agent), Some(Isometry3::identity()));
}

/// More agents than are estimated jointly come and go; those at rest or far from all others cost
/// nothing.
#[test]
fn of_a_crowd_those_that_see_take_part() {
    let mut estimator = Estimator::new(Parameters::default());
    let agents: Vec<u32> = (0..40).map(|_| estimator.enrol()).collect();
    let place = |agent: u32| Isometry3::translation(0.1 * f64::from(agent), 0.0, 0.0);
    for &agent in &agents {
        estimator.start_pose(agent, &start(&place(agent), 0.1), &mut Vec::new());
    }
    let step = motion([0.1, 0.0, 0.0], [0.0, 0.0, 0.0]);
    let mut stamp_ns = 0;
    let mut everybody_moves = |estimator: &mut Estimator| {
        stamp_ns += SECOND_NS;
        for &agent in &agents {
            estimator.motion(agent, stamp_ns, &step, &mut Vec::new());
        }
        stamp_ns
    };
    everybody_moves(&mut estimator);
    assert_eq!(
        estimator.frame(0).covariance.dim(),
        0,
        "nobody has seen anything"
    );
    let shift = Isometry3::translation(0.1, 0.0, 0.0);
    for round in 0..2 {
        for &agent in &agents {
            for (number, post) in POSTS.iter().enumerate() {
                let relation = polar(&(place(agent) * shift), &Point3::from(*post));
                estimator.landmark(agent, SECOND_NS, &label(number), &relation, &mut Vec::new());
            }
        }
        let frame = estimator.frame(0);
        assert_eq!((frame.members.len(), frame.population), (32, 40), "{round}");
        assert_eq!(frame.covariance.dim(), 32 * BODY_DIM + POSTS.len() * 3);
    }
    // Agent 0 has left the joint estimate: its motion leaves that alone, and it comes back.
    let before = estimator.frame(0).covariance.entries().to_vec();
    estimator.motion(0, 2 * SECOND_NS, &step, &mut Vec::new());
    assert_eq!(estimator.frame(0).covariance.entries(), before);
    let (_, apart) = estimator.pose(0).unwrap();
    let truth = place(2);
    let relation = polar(&truth, &Point3::from(POSTS[0]));
    estimator.landmark(0, 2 * SECOND_NS, &label(0), &relation, &mut Vec::new());
    assert!(estimator.frame(0).member(0).is_some());
    let (pose, back) = estimator.pose(0).unwrap();
    assert!((pose.translation.vector - truth.translation.vector).norm() < 0.05);
    assert!(
        back.position_sd_m() > apart.position_sd_m(),
        "the safe side"
    );
}

fn as_merged(effect: Effect) -> Option<FramesMerged> {
    match effect {
        Effect::FramesMerged(merged) => Some(merged),
        _ => None,
    }
}

/// Robots that see one another and no landmark tell nothing about their odometry by pairs: what it
/// adds is not followed for ever.
#[test]
fn odometry_that_no_landmark_tells_about_is_followed_for_a_while() {
    let mut estimator = Estimator::new(Parameters::default());
    let agents = [estimator.enrol(), estimator.enrol()];
    for (agent, x) in agents.into_iter().zip([0.0, 2.0]) {
        let start = StartPose::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], PoseNoise::none());
        estimator.start_pose(agent, &start.unwrap(), &mut Vec::new());
    }
    let step = Motion::from_increment([0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], None).unwrap();
    let seen = RangeBearing::new(2.0, 0.0, 0.0, 0.03, 0.01).unwrap();
    let mut followed = Vec::new();
    for second in 0..200 {
        for agent in agents {
            estimator.motion(agent, second * SECOND_NS, &step, &mut Vec::new());
        }
        let relation = Relation::RangeBearing(seen);
        estimator.sighting(0, second * SECOND_NS, 1, &relation, &mut Vec::new());
        followed.push(estimator.frame(0).covariance.shares().len());
    }
    assert_eq!((followed[60], followed[199]), (4, 0));
}
