//! Batches with every kind of sample.

use cogmap_proto::{
    Descriptor, Increment, Level, Marker, MotionNoise, ObjectMark, Orientation, Relation, Sample,
    SampleBatch, SampleBody, Sighting, StartPose, Target, TouchNoise, Velocity,
};

use super::Visit;

const NOISE: MotionNoise = MotionNoise {
    translation_sd_m: [0.01, 0.02, 0.0],
    rotation_sd_rad: [0.0, 0.001, 0.03],
};

/// A turn to the left by 2 arcsin 0.6.
const LEFT_XYZW: [f64; 4] = [0.0, 0.0, 0.6, 0.8];

pub(super) fn each(visit: &mut impl Visit) {
    visit.batch("batch_increment", &batch(increments()));
    visit.batch("batch_velocity", &batch(velocities()));
    visit.batch("batch_level", &batch(levels()));
    visit.batch("batch_descriptor", &batch(descriptors()));
    visit.batch("batch_sighting", &batch(sightings()));
    visit.batch("batch_start_pose", &batch(start_poses()));
    visit.batch("batch_marker", &batch(markers()));
    visit.batch("batch_object", &batch(object_marks()));
    visit.batch("batch_session_end", &batch(vec![SampleBody::SessionEnd {}]));
    visit.batch("batch_extremes", &extremes());
}

/// Samples 10 ms apart, from a session that began in 2027.
fn batch(bodies: Vec<SampleBody>) -> SampleBatch {
    let stamps_ns = (0..).map(|i| 1_800_000_000_500_000_000 + i * 10_000_000);
    let samples = stamps_ns
        .zip(bodies)
        .map(|(stamp_ns, body)| Sample { stamp_ns, body })
        .collect();
    SampleBatch {
        session: 1_800_000_000_000_000_000,
        first_seq: 50,
        samples,
    }
}

fn object_marks() -> Vec<SampleBody> {
    let noise = TouchNoise {
        position_sd_m: 0.001,
        normal_sd_rad: 0.02,
        level_sd: 0.5,
    };
    let marks = [
        ObjectMark::Learn {
            name: Some("mug".to_owned()),
            spacing_m: 0.008,
            orientation: Orientation::Known {},
            noise,
        },
        ObjectMark::Learn {
            name: None,
            spacing_m: 0.002,
            orientation: Orientation::Free {},
            noise: TouchNoise::default(),
        },
        ObjectMark::Identify {
            orientation: Orientation::Cube {},
            noise,
        },
        ObjectMark::Identify {
            orientation: Orientation::Finite {
                rotations_xyzw: vec![LEFT_XYZW, [0.0, 0.0, 0.0, 1.0]],
            },
            noise,
        },
        ObjectMark::End {},
        ObjectMark::Recognise {
            orientation: Orientation::Yaw {},
            noise,
        },
    ];
    marks.map(SampleBody::Object).to_vec()
}

fn increments() -> Vec<SampleBody> {
    let increment = Increment {
        translation_m: [0.1, -0.25, 0.0],
        rotation_xyzw: LEFT_XYZW,
        noise: None,
    };
    vec![
        SampleBody::Increment(increment.clone()),
        SampleBody::Increment(Increment {
            noise: Some(NOISE),
            ..increment
        }),
    ]
}

fn velocities() -> Vec<SampleBody> {
    let velocity = Velocity {
        linear_m_s: [1.5, 0.0, -0.125],
        angular_rad_s: [0.0, 0.01, -0.7],
        duration_s: 0.01,
        noise: None,
    };
    vec![
        SampleBody::Velocity(velocity.clone()),
        SampleBody::Velocity(Velocity {
            noise: Some(NOISE),
            ..velocity
        }),
    ]
}

fn levels() -> Vec<SampleBody> {
    vec![
        SampleBody::Level(Level {
            channel: "light".to_owned(),
            value: 812.0,
            offset_m: [0.0; 3],
            normal: None,
        }),
        SampleBody::Level(Level {
            channel: "touch.left-1".to_owned(),
            value: -0.375,
            offset_m: [0.2, 0.1, -0.05],
            normal: Some([0.0, -1.0, 0.0]),
        }),
    ]
}

fn descriptors() -> Vec<SampleBody> {
    vec![SampleBody::Descriptor(Descriptor {
        channel: "camera".to_owned(),
        vector: vec![0.5, -0.5, 0.25, 0.0, 1.0, -0.125, 0.75, 0.0625],
    })]
}

/// Every target with every relation.
fn sightings() -> Vec<SampleBody> {
    let targets = [
        Target::Landmark("porte 3, étage α".to_owned()),
        Target::Agent("robot-2".to_owned()),
        Target::OwnSample(17),
    ];
    let relations = [
        Relation::Position {
            translation_m: [2.0, -1.5, 0.25],
            sd_m: [0.1, 0.1, 0.2],
        },
        Relation::RangeBearing {
            range_m: 4.25,
            azimuth_rad: -0.5,
            elevation_rad: 0.125,
            range_sd_m: 0.05,
            bearing_sd_rad: 0.01,
        },
        Relation::Pose {
            translation_m: [-3.0, 0.5, 0.0],
            rotation_xyzw: [0.0, 0.0, -0.6, 0.8],
            noise: NOISE,
        },
        Relation::Range {
            range_m: 12.5,
            range_sd_m: 0.1,
            offset_m: [0.25, 0.0, 0.5],
        },
    ];
    let mut bodies = Vec::new();
    for target in &targets {
        for relation in &relations {
            let (target, relation) = (target.clone(), relation.clone());
            bodies.push(SampleBody::Sighting(Sighting { target, relation }));
        }
    }
    bodies
}

fn start_poses() -> Vec<SampleBody> {
    let pose = StartPose {
        translation_m: [12.5, -7.0, 0.3],
        rotation_xyzw: LEFT_XYZW,
        noise: None,
    };
    vec![
        SampleBody::StartPose(pose.clone()),
        SampleBody::StartPose(StartPose {
            noise: Some(NOISE),
            ..pose
        }),
    ]
}

fn markers() -> Vec<SampleBody> {
    vec![
        SampleBody::Marker(Marker {
            label: "lap 1".to_owned(),
            ends_trip: false,
        }),
        SampleBody::Marker(Marker {
            label: "done".to_owned(),
            ends_trip: true,
        }),
    ]
}

/// The largest and smallest numbers that fit, whether or not a service would take them.
fn extremes() -> SampleBatch {
    let level = |stamp_ns, channel: &str, value| Sample {
        stamp_ns,
        body: SampleBody::Level(Level {
            channel: channel.to_owned(),
            value,
            offset_m: [-0.0, 1e-300, -1e300],
            normal: None,
        }),
    };
    SampleBatch {
        session: u64::MAX - 1,
        first_seq: u64::MAX - 4,
        samples: vec![
            level(i64::MIN, "a", 1e308),
            level(-1, "b", -1e308),
            level(i64::MAX, "c", 9_007_199_254_740_992.0),
        ],
    }
}
