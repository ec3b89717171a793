//! Tables as the format says, and what is sent of them.

use cogmap_proto::{Increment, NameError, Relation, SampleBody, Target};
use nalgebra::{Isometry3, Vector3};

use crate::stream::Stream;

use super::{Choice, Row, RowBody, TableError, TableReason, TableSet, Views};

const SAMPLES: &str = "\
t_s,agent,kind,f1,f2,f3,f4,f5,f6,f7
0.000,a,descriptor,eye,0
1.000,a,increment,1.0,0.0,0.000,0.5,0.1,0.000,0.05
1.000,a,descriptor,eye,1
1.500,a,level,light,3.5
20.000,a,velocity,1.0,0,0.1,2.0
20.000,a,sighting,landmark,tree,range,4.0,0.5
20.000,a,sighting,own_sample_at_s,1.1
2.000,b,increment,1,0,0,0,0,0,0
";
const TRUTH: &str = "\
t_s,agent,x,y,z,yaw,quality
0.000,a,5,6,0,,survey
2.000,a,7,6,0,0.25,survey
0.000,c,0,0,0,0,survey
";

/// A matrix of two views of two numbers, (0, 0) and (3, 4), in half precision.
fn views() -> Vec<u8> {
    let header = "{'descr': '<f2', 'fortran_order': False, 'shape': (2, 2), }\n";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(u16::try_from(header.len()).unwrap().to_le_bytes());
    bytes.extend(header.as_bytes());
    for number in [0x0000_u16, 0x0000, 0x4200, 0x4400] {
        bytes.extend(number.to_le_bytes());
    }
    bytes
}

fn set() -> TableSet {
    let mut set = TableSet::read(SAMPLES, TRUTH).unwrap();
    let views = Views::read(&views()).unwrap();
    set.views.insert("eye".to_owned(), views);
    set
}

#[test]
fn an_agent_sends_its_rows_a_second_later() {
    let set = set();
    let truth = set.agents["a"].truth.as_ref().unwrap();
    let start = truth.start(1_000_000_000).unwrap();
    assert_eq!(start.translation.vector, Vector3::new(6.0, 6.0, 0.0));
    assert!((start.rotation.scaled_axis().z - 0.25).abs() < 1e-12);
    let stream = set.stream("a", Some(&start), &Choice::default()).unwrap();
    // The view of nothing is not sent.
    let bodies: Vec<&SampleBody> = stream.samples().iter().map(|sample| &sample.body).collect();
    assert_eq!(bodies.len(), 7);
    assert_eq!(stream.samples()[0].stamp_ns, 999_999_999);
    let SampleBody::Increment(moved) = bodies[1] else {
        panic!("{:?}", bodies[1])
    };
    let noise = moved.noise.unwrap();
    let off = Vector3::from(noise.translation_sd_m) - Vector3::new(0.1, 0.1, 1e-6);
    assert!(off.norm() < 1e-12);
    let SampleBody::Descriptor(view) = bodies[2] else {
        panic!("{:?}", bodies[2])
    };
    assert_eq!(view.vector, [0.6, 0.8]);
    assert!(matches!(bodies[3], SampleBody::Level(level) if (level.value - 3.5).abs() < 1e-12));
    assert!(matches!(bodies[4], SampleBody::Velocity(velocity) if velocity.noise.is_none()));
    assert!(matches!(bodies[5], SampleBody::Sighting(seen)
        if matches!(seen.relation, Relation::Range { range_m: 4.0, range_sd_m: 0.5, .. })));
    assert!(matches!(bodies[6], SampleBody::Sighting(seen) if seen.target == Target::OwnSample(1)));
    assert_eq!(stream.samples()[6].stamp_ns, 21_000_000_000);
}

/// Truth is known at the stamps of rows: a motion there has led to it.
#[test]
fn exact_motions_lead_along_the_truth() {
    let rows = "1.0,a,increment,1,0,0,0.5,0,0,0\n2.0,a,velocity,1,0,0.5,1.0\n";
    let from_there = Isometry3::new(Vector3::new(3.0, -2.0, 0.0), Vector3::z() * 0.7);
    for table in [rows, "0.0,a,level,light,1\n", "0.5,a,velocity,2,0,-1,0.5\n"] {
        let rows = if table == rows {
            rows
        } else {
            &format!("{table}{rows}")
        };
        let text = format!("t_s,agent,kind,f1,f2,f3,f4,f5,f6,f7\n{rows}");
        let set = TableSet::read(&text, "").unwrap();
        let stream = set.stream("a", Some(&from_there), &Choice::default());
        let stream = stream.unwrap();
        // The first row of a reckoned way is the start pose, and the next one follows a motion.
        let at_first_row = usize::from(set.agents["a"].rows[0].body.motion().is_some());
        let off = stream.reckoned()[at_first_row].pose.inverse() * from_there;
        assert!(off.translation.vector.norm() < 1e-12, "{table}");
        assert!(off.rotation.angle() < 1e-12, "{table}");
    }
}

#[test]
fn a_channel_is_left_out_by_name() {
    let without = ["eye".to_owned(), "light".to_owned()].into();
    let choice = Choice {
        without,
        ..Choice::default()
    };
    let stream = set().stream("a", None, &choice).unwrap();
    let is_percept = |body: &SampleBody| {
        matches!(
            body,
            SampleBody::Level(_) | SampleBody::Descriptor(_) | SampleBody::StartPose(_)
        )
    };
    assert!(
        !stream
            .samples()
            .iter()
            .any(|sample| is_percept(&sample.body))
    );
    assert_eq!(stream.samples().len(), 4);
}

#[test]
fn motions_go_without_noise_where_none_is_to_be_stated() {
    let choice = Choice {
        unstated_noise: true,
        ..Choice::default()
    };
    let [stated, unstated] =
        [Choice::default(), choice].map(|choice| set().stream("a", None, &choice).unwrap());
    let motions = |stream: &Stream| -> Vec<Increment> {
        let bodies = stream.samples().iter().map(|sample| &sample.body);
        bodies
            .filter_map(|body| match body {
                SampleBody::Increment(motion) => Some(motion.clone()),
                _ => None,
            })
            .collect()
    };
    let (stated, unstated) = (motions(&stated), motions(&unstated));
    assert!(!stated.is_empty());
    for (one, other) in stated.iter().zip(&unstated) {
        assert!(one.noise.is_some() && other.noise.is_none());
        let moved = |motion: &Increment| {
            let numbers = [&motion.translation_m[..], &motion.rotation_xyzw[..]].concat();
            numbers.into_iter().map(f64::to_bits).collect::<Vec<_>>()
        };
        assert_eq!(moved(one), moved(other));
    }
    assert_eq!(stated.len(), unstated.len());
}

#[test]
fn a_bad_line_is_named() {
    for (line, expected) in [
        ("1,b,jump,1,2", TableReason::Kind("jump".to_owned())),
        ("3,b,level,light,x", TableReason::NotANumber { column: 5 }),
        (
            "3,b,increment,1,0,0,0,-1,0,0",
            TableReason::Negative { column: 8 },
        ),
        ("3,b,descriptor,eye,-1", TableReason::NotARow { column: 5 }),
        ("1,b,level,light,1", TableReason::Backwards),
        (
            "3,b,level,my light,1",
            TableReason::Name(NameError::Character(' ')),
        ),
        (
            "3,b,level",
            TableReason::Columns {
                expected: 5,
                found: 3,
            },
        ),
    ] {
        match TableSet::read(&format!("{SAMPLES}{line}\n"), TRUTH) {
            Err(TableError::Line {
                line: 10, reason, ..
            }) => assert_eq!(reason, expected),
            other => panic!("{line}: {other:?}"),
        }
    }
    assert!(matches!(
        TableSet::read("t_s,agent,kind\n", ""),
        Err(TableError::Empty)
    ));
}

#[test]
fn a_table_without_the_names_of_its_columns_is_refused() {
    let (_, headless) = SAMPLES.split_once('\n').unwrap();
    let refused = TableSet::read(headless, TRUTH);
    assert!(
        matches!(refused, Err(TableError::Header { .. })),
        "{refused:?}"
    );
    let refused = TableSet::read(SAMPLES, "x,y,z\n");
    assert!(
        matches!(refused, Err(TableError::Header { .. })),
        "{refused:?}"
    );
}

#[test]
fn a_view_that_is_not_there_is_an_error() {
    let set = TableSet::read(SAMPLES, "").unwrap();
    let missing = set.stream("a", None, &Choice::default());
    assert!(matches!(missing, Err(TableError::NoView { row: 0, .. })));
    let mut short = views();
    short.pop();
    assert_eq!(Views::read(&short), None);
    assert_eq!(Views::read(b"not a matrix"), None);
}

#[test]
fn a_share_of_the_distances_is_reflected() {
    let lines = (0..200).map(|k| format!("{k},a,sighting,landmark,mast,range,7.5,0.1"));
    let text: Vec<String> = std::iter::once("t_s,agent,kind".to_owned())
        .chain(lines)
        .collect();
    let set = TableSet::read(&text.join("\n"), "").unwrap();
    let n_reflected = |share: f64, seed: u64| {
        let mut set = set.clone();
        set.reflect(share, seed);
        let is_reflected = |row: &&Row| match &row.body {
            RowBody::Range(_, range_m, _) => {
                assert!([7.5, 22.5].iter().any(|one| (one - range_m).abs() < 1e-9));
                *range_m > 10.0
            }
            other => panic!("{other:?}"),
        };
        set.agents["a"].rows.iter().filter(is_reflected).count()
    };
    assert_eq!(n_reflected(0.0, 1), 0);
    assert!((40..80).contains(&n_reflected(0.3, 1)));
    let drawn = |seed: u64| {
        let mut set = set.clone();
        set.reflect(0.3, seed);
        set
    };
    assert_eq!(drawn(1), drawn(1));
    assert_ne!(drawn(1), drawn(2));
}
