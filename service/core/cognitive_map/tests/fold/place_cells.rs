//! An animal in a box, of which odometry and the counts of its place cells are known.

use cognitive_map::{
    AgentId, CognitiveMap, Descriptor, Motion, PoseNoise, Record, Sample, SampleBody, Settings,
};
use nalgebra::{Isometry3, UnitQuaternion, Vector2, Vector3};
use random::Seeded;

use crate::journal::{label, start_pose};

const BOX_M: f64 = 1.5;
const CELLS: usize = 60;
/// Radius of a place field \[m\].
const FIELD_M: f64 = 0.2;
/// Spikes of a cell between two views, at the middle of its field.
const SPIKES_MAX: f64 = 4.0;
const STEP_S: f64 = 0.4;

/// What the animal did, and where it was with each view.
struct Run {
    records: Vec<Record>,
    truth: Vec<Vector2<f64>>,
}

/// A number of spikes (Knuth 1969).
fn poisson(mean: f64, random: &mut Seeded) -> f64 {
    let (mut product, mut count) = (random.uniform(), 0.0);
    while product > (-mean).exp() {
        product *= random.uniform();
        count += 1.0;
    }
    count
}

/// An animal that runs about. Its odometry says nothing of its own noise: turns err by 0.1 rad
/// with each step, and lengths by a tenth.
fn run(views: usize) -> Run {
    let mut random = Seeded(5);
    let fields: Vec<Vector2<f64>> = (0..CELLS)
        .map(|_| Vector2::new(random.uniform(), random.uniform()) * BOX_M)
        .collect();
    let mut pose = Isometry3::new(Vector3::new(0.7, 0.7, 0.0), Vector3::zeros());
    let mut bodies = vec![start_pose(pose.translation.vector.into(), [0.0; 3])];
    let mut truth = Vec::new();
    while truth.len() < views {
        let speed = 0.15 + 0.1 * random.uniform();
        let mut turn = 0.5 * random.normal();
        let ahead = (pose * Isometry3::translation(2.0 * speed * STEP_S, 0.0, 0.0)).translation;
        if !(0.05..BOX_M - 0.05).contains(&ahead.x) || !(0.05..BOX_M - 0.05).contains(&ahead.y) {
            turn = 2.0;
        }
        let rotation = |turn: f64| UnitQuaternion::from_euler_angles(0.0, 0.0, turn);
        let step = Isometry3::from_parts(
            (rotation(turn) * Vector3::new(speed * STEP_S, 0.0, 0.0)).into(),
            rotation(turn),
        );
        let next = pose * step;
        let is_within = |x: f64| (0.0..BOX_M).contains(&x);
        let goes_on = is_within(next.translation.x) && is_within(next.translation.y);
        let length_m = if goes_on { speed * STEP_S } else { 0.0 };
        let walked = rotation(turn) * Vector3::new(length_m, 0.0, 0.0);
        pose *= Isometry3::from_parts(walked.into(), rotation(turn));
        let (read, part) = (turn + 0.1 * random.normal(), 1.0 + 0.1 * random.normal());
        let walked = rotation(read) * Vector3::new(length_m * part, 0.0, 0.0);
        let noise = PoseNoise::new([0.01, 0.01, 0.0], [0.0, 0.0, 0.02]).unwrap();
        let motion =
            Motion::from_increment(walked.into(), rotation(read).coords.into(), Some(noise));
        bodies.push(SampleBody::Motion(motion.unwrap()));
        let at = pose.translation.vector.xy();
        let count = |field: &Vector2<f64>| {
            let off = (field - at).norm_squared() / (2.0 * FIELD_M * FIELD_M);
            #[expect(clippy::cast_possible_truncation, reason = "a small number")]
            let root = poisson(SPIKES_MAX * (-off).exp(), &mut random).sqrt() as f32;
            root
        };
        let vector: Vec<f32> = fields.iter().map(count).collect();
        if let Ok(descriptor) = Descriptor::new(label("cells"), &vector) {
            bodies.push(SampleBody::Descriptor(descriptor));
            truth.push(at);
        }
    }
    let mut records = vec![Record::Enrol {
        agent: AgentId(0),
        name: label("animal"),
    }];
    let mut stamp_ns = 0;
    for (seq, body) in (0..).zip(bodies) {
        if matches!(body, SampleBody::Motion(_)) {
            stamp_ns += 400_000_000;
        }
        records.push(Record::Sample {
            agent: AgentId(0),
            session: 1,
            seq,
            sample: Sample { stamp_ns, body },
        });
    }
    Run { records, truth }
}

/// Where the live estimate has the animal with each view.
fn live(run: &Run) -> Vec<Vector2<f64>> {
    let (mut map, mut events) = (CognitiveMap::new(Settings::default()), Vec::new());
    let mut live = Vec::new();
    for record in &run.records {
        map.apply(record, &mut events);
        if let Record::Sample { sample, .. } = record
            && matches!(sample.body, SampleBody::Descriptor(_))
        {
            live.push(
                map.agent(AgentId(0))
                    .unwrap()
                    .pose()
                    .translation
                    .vector
                    .xy(),
            );
        }
    }
    live
}

/// Median distance and that of nine in ten, after the motion of the plane that fits best \[m\]:
/// before it knew its cells the animal had lost its heading, and its map is turned by that.
fn aligned_errors_m(points: &[Vector2<f64>], truth: &[Vector2<f64>]) -> [f64; 2] {
    let mean = |points: &[Vector2<f64>]| points.iter().sum::<Vector2<f64>>() / points.len() as f64;
    let (from, to) = (mean(points), mean(truth));
    let (mut along, mut across) = (0.0, 0.0);
    for (point, there) in points.iter().zip(truth) {
        let (a, b) = (point - from, there - to);
        (along, across) = (along + a.dot(&b), across + a.perp(&b));
    }
    let turn = nalgebra::Rotation2::new(across.atan2(along));
    let off = |(point, there): (&Vector2<f64>, &Vector2<f64>)| {
        (turn * (point - from) + to - there).norm()
    };
    let mut off: Vec<f64> = points.iter().zip(truth).map(off).collect();
    off.sort_by(f64::total_cmp);
    [off[off.len() / 2], off[off.len() * 9 / 10]]
}

#[test]
fn an_animal_is_where_its_cells_say_between_relaxations() {
    let run = run(600);
    let [half, most] = aligned_errors_m(&live(&run)[400..], &run.truth[400..]);
    // By relaxations alone it is off by 0.47 and 0.58 m.
    assert!(half < 0.3 && most < 0.5, "{half} m, {most} m");
}
