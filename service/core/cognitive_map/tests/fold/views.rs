//! What is seen along ways that are driven again: as a laser sees a hall with pillars.

use cognitive_map::{
    AgentId, CognitiveMap, Descriptor, LearnedChannel, Motion, PoseNoise, Record, Sample,
    SampleBody, Settings,
};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector2, Vector3};
use random::Seeded;

use crate::journal::{label, start_pose};

/// Size of the hall, and of the way round within it \[m\].
const HALL_M: [f64; 2] = [32.0, 20.0];
const WAY_M: [f64; 2] = [26.0, 14.0];
const STEP_M: f64 = 0.5;
const BEAMS: usize = 48;
const RANGE_MAX_M: f64 = 8.0;

/// What the robot's views are of.
#[derive(Clone, Copy, PartialEq)]
enum Views {
    Hall,
    Noise,
    None,
}

/// A drive: the records, and where the robot was with each motion.
struct Drive {
    records: Vec<Record>,
    truth: Vec<Point3<f64>>,
}

/// The pillars of a hall, as centres and radii \[m\].
fn pillars(random: &mut Seeded) -> Vec<(Vector2<f64>, f64)> {
    let pillar = |_| {
        let [x, y] = HALL_M.map(|size| size * (random.uniform() - 0.5));
        (Vector2::new(x, y), 0.2 + 0.6 * random.uniform())
    };
    (0..50).map(pillar).collect()
}

/// How far a beam gets \[m\].
fn range_m(from: &Vector2<f64>, along: &Vector2<f64>, pillars: &[(Vector2<f64>, f64)]) -> f64 {
    let wall = |k: usize| {
        let end = 0.5 * HALL_M[k] * along[k].signum();
        (end - from[k]) / along[k]
    };
    let pillar = |(centre, radius): &(Vector2<f64>, f64)| {
        let towards = centre - from;
        let ahead = towards.dot(along);
        let beside = towards.norm_squared() - ahead * ahead;
        let half = (radius * radius - beside).sqrt();
        (half.is_finite() && ahead > half).then_some(ahead - half)
    };
    let nearest = pillars.iter().filter_map(pillar);
    nearest.fold(wall(0).min(wall(1)).min(RANGE_MAX_M), f64::min)
}

/// A robot that drives round a hall, with odometry that turns too little for each metre.
fn drive(views: Views, rounds: f64) -> Drive {
    let noise = PoseNoise::new([0.01, 0.01, 0.0], [0.0, 0.0, 0.01]).unwrap();
    drive_stating(Some(noise), views, rounds)
}

/// The same, whose odometry states a noise or none.
fn drive_stating(noise: Option<PoseNoise>, views: Views, rounds: f64) -> Drive {
    let mut random = Seeded(3);
    let pillars = pillars(&mut random);
    let mut drive = Drive {
        records: vec![Record::Enrol {
            agent: AgentId(0),
            name: label("robot"),
        }],
        truth: Vec::new(),
    };
    let mut pose = Isometry3::new(
        Vector3::new(-0.5 * WAY_M[0], -0.5 * WAY_M[1], 0.0),
        Vector3::zeros(),
    );
    let mut bodies = vec![start_pose(pose.translation.vector.into(), [0.0; 3])];
    let sides = [WAY_M[0], WAY_M[1], WAY_M[0], WAY_M[1]];
    let mut left_m = rounds * sides.iter().sum::<f64>();
    for side_m in sides.iter().cycle() {
        let mut on_m = *side_m;
        while on_m > 0.0 && left_m > 0.0 {
            bodies.push(read(&mut pose, STEP_M, 0.0, noise, &mut random));
            bodies.extend(view(&pose, &pillars, views, &mut random));
            drive.truth.push(pose.translation.vector.into());
            (on_m, left_m) = (on_m - STEP_M, left_m - STEP_M);
        }
        for _ in 0..3 {
            bodies.push(read(
                &mut pose,
                0.0,
                std::f64::consts::FRAC_PI_6,
                noise,
                &mut random,
            ));
            drive.truth.push(pose.translation.vector.into());
        }
        if left_m <= 0.0 {
            break;
        }
    }
    for (seq, body) in (0..).zip(bodies) {
        drive.records.push(Record::Sample {
            agent: AgentId(0),
            session: 1,
            seq,
            sample: Sample {
                stamp_ns: i64::try_from(seq).unwrap() * 500_000_000,
                body,
            },
        });
    }
    drive
}

/// Goes on, and answers what odometry reads.
fn read(
    pose: &mut Isometry3<f64>,
    step_m: f64,
    turn: f64,
    noise: Option<PoseNoise>,
    random: &mut Seeded,
) -> SampleBody {
    *pose *= Isometry3::new(Vector3::x() * step_m, Vector3::z() * turn);
    let turn = turn - 0.008 * step_m + 0.01 * random.normal();
    let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, turn);
    let step = [step_m + 0.01 * random.normal(), 0.0, 0.0];
    let motion = Motion::from_increment(step, rotation.coords.into(), noise);
    SampleBody::Motion(motion.unwrap())
}

/// The ranges of all beams, as a descriptor.
fn view(
    pose: &Isometry3<f64>,
    pillars: &[(Vector2<f64>, f64)],
    views: Views,
    random: &mut Seeded,
) -> Option<SampleBody> {
    let heading = pose.rotation.euler_angles().2;
    let from = pose.translation.vector.xy();
    let beam = |number: usize| {
        let angle = heading + std::f64::consts::TAU * number as f64 / BEAMS as f64;
        let along = Vector2::new(angle.cos(), angle.sin());
        let seen = match views {
            Views::Noise => random.normal().abs(),
            Views::Hall | Views::None => range_m(&from, &along, pillars) + 0.05 * random.normal(),
        };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a range is no exact number"
        )]
        let seen = seen as f32;
        seen
    };
    let vector: Vec<f32> = (0..BEAMS).map(beam).collect();
    let descriptor = Descriptor::new(label("laser"), &vector).unwrap();
    (views != Views::None).then_some(SampleBody::Descriptor(descriptor))
}

/// Root mean square errors while driving and afterwards \[m\].
fn errors_m(drive: &Drive) -> (f64, f64) {
    let (mut map, mut events) = (CognitiveMap::new(Settings::default()), Vec::new());
    let (mut live, mut moments) = (Vec::new(), Vec::new());
    for record in &drive.records {
        map.apply(record, &mut events);
        if let Record::Sample { sample, .. } = record
            && matches!(sample.body, SampleBody::Motion(_))
        {
            let at = map.agent(AgentId(0)).unwrap().pose().translation.vector;
            live.push((at - drive.truth[live.len()].coords).norm_squared());
            moments.push(sample.stamp_ns);
        }
    }
    let refined = &map.refined().agents[0].poses;
    let off = |(stamp_ns, truth): (&i64, &Point3<f64>)| {
        let at = refined.iter().find(|row| row.stamp_ns == *stamp_ns)?;
        Some((at.pose.translation.vector - truth.coords).norm_squared())
    };
    let after: Vec<f64> = moments.iter().zip(&drive.truth).filter_map(off).collect();
    assert!(after.len() * 2 > moments.len());
    let rms = |squares: &[f64]| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    (rms(&live), rms(&after))
}

#[test]
fn a_way_that_is_driven_again_is_recognised_by_what_a_laser_sees() {
    let (by_odometry, _) = errors_m(&drive(Views::None, 3.0));
    let (live, refined) = errors_m(&drive(Views::Hall, 3.0));
    assert!(by_odometry > 4.0, "{by_odometry}");
    assert!(refined < 0.25 * by_odometry, "{refined} {by_odometry}");
    assert!(live < 0.4 * by_odometry, "{live} {by_odometry}");
}

#[test]
fn a_way_is_recognised_by_a_robot_that_states_no_noise() {
    let (by_odometry, _) = errors_m(&drive(Views::None, 3.0));
    let (live, refined) = errors_m(&drive_stating(None, Views::Hall, 3.0));
    assert!(refined < 0.1 * by_odometry, "{refined} {by_odometry}");
    assert!(live < 0.4 * by_odometry, "{live} {by_odometry}");
}

#[test]
fn views_that_say_nothing_change_nothing() {
    let (live, refined) = errors_m(&drive(Views::Noise, 2.0));
    // The same drive: noise is drawn in the same order.
    let mut without = drive(Views::Noise, 2.0);
    without.records.retain(|record| match record {
        Record::Sample { sample, .. } => !matches!(sample.body, SampleBody::Descriptor(_)),
        _ => true,
    });
    let (live_without, refined_without) = errors_m(&without);
    assert!((live - live_without).abs() < 1e-9, "{live} {live_without}");
    let changed_m = (refined - refined_without).abs();
    assert!(changed_m < 1e-3, "{refined} {refined_without}");
}

#[test]
fn a_restart_while_views_are_matched_makes_no_difference() {
    check_restarts(&drive(Views::Hall, 2.0));
}

#[test]
fn a_restart_while_noise_is_found_makes_no_difference() {
    check_restarts(&drive_stating(None, Views::Hall, 2.0));
}

/// Checks that a drive leads to the same map with and without restarts.
fn check_restarts(drive: &Drive) {
    let fold = |every: usize| {
        let (mut map, mut events) = (CognitiveMap::new(Settings::default()), Vec::new());
        for (at, record) in drive.records.iter().enumerate() {
            map.apply(record, &mut events);
            if at % every == every - 1 {
                map = CognitiveMap::restore(Settings::default(), map.checkpoint(0)).unwrap();
            }
        }
        map.digest()
    };
    let alone = fold(usize::MAX);
    for every in [13, 101] {
        assert!(fold(every) == alone, "every {every} records");
    }
}

/// What a map has learned of the only channel of a drive.
fn learned(views: Views) -> Option<LearnedChannel> {
    let (mut map, mut events) = (CognitiveMap::new(Settings::default()), Vec::new());
    for record in &drive(views, 1.5).records {
        map.apply(record, &mut events);
    }
    let channel = map.view_channels().next().unwrap();
    assert_eq!((channel.name, channel.dimension), ("laser", 48));
    assert!(channel.views > 100, "{}", channel.views);
    channel.learned
}

#[test]
fn the_range_of_a_channel_is_learned_and_noise_has_none() {
    let laser = learned(Views::Hall).unwrap();
    assert!((1.0..8.0).contains(&laser.range_m), "{laser:?}");
    assert!(laser.information_nats > 1.0, "{laser:?}");
    assert!((0.0..=1.0).contains(&laser.independence), "{laser:?}");
    let noise = learned(Views::Noise);
    assert!(
        noise.is_none_or(|noise| noise.information_nats < 0.05),
        "{noise:?}"
    );
}
