//! A small data set written by hand, of which every reading can be said in advance.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fs;

use proptest::prelude::*;

use super::*;
use cogmap_worlds::dead_reckoned;
use cogmap_worlds::{Reading, ReadingBody, ReadingTarget};
use trajectory::{Span, Trajectory};

type Files = BTreeMap<String, String>;

/// Two robots and one landmark. The common span is 10 s to 12 s.
fn files() -> Files {
    [
        (
            "Barcodes.dat",
            "# Subject Barcode\n1 5\n2 14\n3 41\n6 72.0\n",
        ),
        ("Landmark_Groundtruth.dat", "6 1.5 -2.5 0.1 0.2\n"),
        // Out of order on purpose; the command at 9.75 s is in force at 10 s.
        (
            "Robot1_Odometry.dat",
            "11.0 0.5 -0.25\r\n9.75\t1.0 0.5\n13.0 0 0\n# end\n",
        ),
        (
            "Robot1_Groundtruth.dat",
            "9.5 1 2 3.0\n10.5 2 4 -3.0\n20 0 0 0\n",
        ),
        (
            "Robot1_Measurement.dat",
            "10.5 72 2.0 0.1\n10.5 14 3.0 -0.1\n10.0 72 9 0\n10.75 90 1 1\n10.8 5 1 1\n\
             11.0 72 2.5 0.2\n11.5 41 1 1\n12.0 72 9 0\n",
        ),
        ("Robot2_Odometry.dat", "10.0 0.25 0.0\n12.0 1 1\n"),
        ("Robot2_Groundtruth.dat", "10 0 0 0\n12 0.5 0 0\n"),
        ("Robot3_Odometry.dat", "0 0 0\n"), // no truth: not in the team
    ]
    .map(|(file, text)| (file.to_owned(), text.to_owned()))
    .into()
}

fn read(files: &Files) -> Result<Mrclam, MrclamError> {
    Mrclam::read(|file| Ok(files.get(file).cloned()))
}

fn motion(stamp_ms: i64, forward: f64, turn: f64, duration_s: f64) -> Reading {
    let body = ReadingBody::Velocity {
        linear_m_s: [forward, 0.0, 0.0],
        angular_rad_s: [0.0, 0.0, turn],
        duration_s,
        noise: None,
    };
    Reading {
        stamp_ns: stamp_ms * 1_000_000,
        body,
    }
}

fn seen(stamp_ms: i64, target: ReadingTarget, range_m: f64, azimuth_rad: f64) -> Reading {
    let body = ReadingBody::Sighting {
        target,
        range_m,
        azimuth_rad,
        elevation_rad: 0.0,
        range_sd_m: 0.15,
        bearing_sd_rad: 0.025,
    };
    Reading {
        stamp_ns: stamp_ms * 1_000_000,
        body,
    }
}

#[test]
fn the_stream_is_the_one_expected() {
    let set = read(&files()).unwrap();
    assert_eq!(
        set.span(),
        Span {
            start_ns: 10_000_000_000,
            end_ns: 12_000_000_000
        }
    );
    assert_eq!(set.n_unknown_barcodes(), 1);
    assert_eq!(
        set.landmarks()[&6].map(f64::to_bits),
        [1.5, -2.5].map(f64::to_bits)
    );
    let landmark = || ReadingTarget::Landmark("landmark-6".into());
    let stream = set.robot_readings(1);
    let ReadingBody::StartPose {
        translation_m,
        rotation_xyzw,
    } = &stream[0].body
    else {
        panic!("the stream does not open with a start pose")
    };
    // Half way from (1, 2) to (2, 4), and from 3.0 to -3.0 across the seam at π.
    assert_eq!(
        translation_m.map(f64::to_bits),
        [1.5, 3.0, 0.0].map(f64::to_bits)
    );
    let half: f64 = PI / 2.0;
    assert!((rotation_xyzw[2] - half.sin()).abs() < 1e-12);
    assert!((rotation_xyzw[3] - half.cos()).abs() < 1e-12);
    assert_eq!(
        stream[1..],
        [
            motion(10_500, 1.0, 0.5, 0.5),
            seen(10_500, landmark(), 2.0, 0.1),
            seen(10_500, ReadingTarget::Robot("robot2".into()), 3.0, -0.1),
            motion(11_000, 1.0, 0.5, 0.5),
            seen(11_000, landmark(), 2.5, 0.2),
            motion(12_000, 0.5, -0.25, 1.0),
        ]
    );
    assert!(set.robot_readings(3).is_empty());
}

#[test]
fn the_team_comes_by_stamp_then_by_robot() {
    let team = read(&files()).unwrap().team_readings();
    let order: Vec<_> = team
        .iter()
        .map(|entry| (entry.reading.stamp_ns / 1_000_000, entry.robot))
        .collect();
    assert_eq!(
        order,
        [
            (10_000, 1),
            (10_000, 2),
            (10_500, 1),
            (10_500, 1),
            (10_500, 1),
            (11_000, 1),
            (11_000, 1),
            (12_000, 1),
            (12_000, 2)
        ]
    );
}

#[test]
fn a_directory_reads_like_its_texts() {
    let directory = std::env::temp_dir().join(format!("cogmap-mrclam-{}", std::process::id()));
    fs::create_dir_all(&directory).unwrap();
    for (file, text) in files() {
        fs::write(directory.join(file), text).unwrap();
    }
    let loaded = Mrclam::load(&directory);
    fs::remove_dir_all(&directory).unwrap();
    assert_eq!(loaded.unwrap(), read(&files()).unwrap());
    assert!(matches!(
        Mrclam::load(&directory),
        Err(MrclamError::Absent { file }) if file == "Barcodes.dat"
    ));
}

#[test]
fn any_subset_of_robots_will_do() {
    let mut files = files();
    files.remove("Robot1_Groundtruth.dat");
    files.remove("Landmark_Groundtruth.dat");
    let set = read(&files).unwrap();
    assert_eq!(set.robots().keys().copied().collect::<Vec<_>>(), [2]);
    assert_eq!(set.robot_readings(2).len(), 2);
    files.remove("Robot2_Odometry.dat");
    assert!(matches!(read(&files), Err(MrclamError::NoRobot)));
}

#[test]
fn a_bad_row_is_named_with_its_file_and_line() {
    for (file, text, expected) in [
        (
            "Barcodes.dat",
            "1 5\n2 5\n",
            "Barcodes.dat, line 2: the barcode is another subject's already",
        ),
        (
            "Barcodes.dat",
            "1 5.5\n",
            "Barcodes.dat, line 1: column 2 is not a whole number",
        ),
        (
            "Robot1_Odometry.dat",
            "#\n10 x 0\n",
            "Robot1_Odometry.dat, line 2: column 2 is not a finite number",
        ),
        (
            "Robot1_Odometry.dat",
            "10 1\n",
            "Robot1_Odometry.dat, line 1: expected 3 columns, found 2",
        ),
        (
            "Robot1_Groundtruth.dat",
            "ten 0 0 0\n",
            "Robot1_Groundtruth.dat, line 1: the time is not a decimal number",
        ),
        (
            "Robot1_Groundtruth.dat",
            "9 0 0 inf\n",
            "Robot1_Groundtruth.dat, line 1: column 4 is not a finite number",
        ),
        (
            "Robot2_Measurement.dat",
            "11 72 -1 0\n",
            "Robot2_Measurement.dat, line 1: the range is negative",
        ),
        (
            "Robot2_Odometry.dat",
            "# nothing\n",
            "Robot2_Odometry.dat has no row",
        ),
        (
            "Robot2_Odometry.dat",
            "30 0 0\n31 0 0\n",
            "the odometry and the truth of all robots have no time in common",
        ),
    ] {
        let mut files = files();
        files.insert(file.to_owned(), text.to_owned());
        assert_eq!(read(&files).unwrap_err().to_string(), expected);
    }
}

#[test]
fn a_command_of_many_hours_is_split() {
    let mut files = files();
    for file in [
        "Robot1_Odometry.dat",
        "Robot1_Groundtruth.dat",
        "Robot1_Measurement.dat",
    ] {
        files.remove(file);
    }
    files.insert("Robot2_Odometry.dat".into(), "0 0.001 0\n9000 0 0\n".into());
    files.insert(
        "Robot2_Groundtruth.dat".into(),
        "0 0 0 0\n9000 9 0 0\n".into(),
    );
    let stream = read(&files).unwrap().robot_readings(2);
    assert_eq!(stream.len(), 4);
    assert_eq!(stream[1], motion(3_600_000, 0.001, 0.0, 3600.0));
    assert_eq!(stream[3], motion(9_000_000, 0.001, 0.0, 1800.0));
    let path = Trajectory::from_poses(&dead_reckoned(&stream).unwrap()).unwrap();
    assert!((path.at(9_000_000_000_000).unwrap().x - 9.0).abs() < 1e-9);
}

#[test]
fn a_share_of_the_sightings_has_another_name() {
    let mut files = files();
    let landmark = |n: u32| format!("{} 72.0 {n} 0.1\n", 10.0 + f64::from(n) * 1e-3);
    let rows: String = (1..1900).map(landmark).collect();
    files
        .get_mut("Robot1_Measurement.dat")
        .unwrap()
        .push_str(&rows);
    let set = read(&files).unwrap();
    let confused = |share, seed| {
        let mut confused = set.clone();
        confused.confuse(share, seed);
        confused
    };
    assert_eq!(confused(0.0, 1), set);
    assert_eq!(confused(0.3, 1), confused(0.3, 1));
    assert_ne!(confused(0.3, 1), confused(0.3, 2));
    let mut n_false = 0;
    for (robot, log) in confused(0.3, 1).robots() {
        let right = &set.robots()[robot].measurements;
        assert_eq!(log.measurements.len(), right.len());
        for (seen, right) in log.measurements.iter().zip(right) {
            if seen == right {
                continue;
            }
            n_false += 1;
            assert!(seen.subject != *robot, "nobody sees itself");
            assert!([1, 2, 3, 6].contains(&seen.subject), "one that is seen");
            let subject = right.subject;
            assert_eq!(Measurement { subject, ..*seen }, *right);
        }
    }
    assert!((480..660).contains(&n_false), "{n_false} of 1907");
}

#[test]
fn a_robot_may_have_names_of_its_own_for_landmarks() {
    let set = read(&files()).unwrap();
    let mut n_renamed = 0;
    for entry in set.team_readings() {
        let own = entry.clone().with_own_names();
        match (entry.reading.body, own.reading.body) {
            (
                ReadingBody::Sighting {
                    target: ReadingTarget::Landmark(name),
                    ..
                },
                ReadingBody::Sighting {
                    target: ReadingTarget::Landmark(own),
                    ..
                },
            ) => {
                assert_eq!(own, format!("{name}-of-robot{}", entry.robot));
                n_renamed += 1;
            }
            (body, own) => assert_eq!(body, own, "nothing else is called otherwise"),
        }
    }
    assert!(n_renamed > 0);
}

proptest! {
    /// Sightings cut the motion into more pieces, but never lose or double any of it.
    #[test]
    fn motion_is_whole_however_it_is_cut(
        commands in prop::collection::vec((0..40_i64, -1.0..1.0_f64, -2.0..2.0_f64), 2..15),
        sightings in prop::collection::vec(0..40_i64, 0..15),
    ) {
        let mut files = files();
        for file in ["Robot1_Odometry.dat", "Robot1_Groundtruth.dat"] {
            files.remove(file);
        }
        let rows = commands.iter().map(|(t, v, w)| format!("{t}e-1 {v} {w}\n"));
        files.insert("Robot2_Odometry.dat".into(), rows.collect());
        files.insert("Robot2_Groundtruth.dat".into(), "1 0 0 0\n3.5 1 1 1\n".into());
        let rows = sightings.iter().map(|t| format!("{t}e-1 72 1 0\n"));
        let without = read(&files);
        files.insert("Robot2_Measurement.dat".into(), rows.collect());
        let with = read(&files);
        let (Ok(without), Ok(with)) = (without, with) else { return Ok(()) };
        let ends = [&without, &with].map(|set| {
            let stream = set.robot_readings(2);
            prop_assert!(stream.is_sorted_by_key(|reading| reading.stamp_ns));
            let poses = dead_reckoned(&stream).unwrap();
            Ok(*poses.last().unwrap())
        });
        let [a, b] = ends;
        let (a, b) = (a?, b?);
        prop_assert_eq!(a.stamp_ns, with.span().end_ns);
        prop_assert_eq!(b.stamp_ns, with.span().end_ns);
        prop_assert!((a.pose.translation.vector - b.pose.translation.vector).norm() < 1e-9);
        prop_assert!(a.pose.rotation.angle_to(&b.pose.rotation) < 1e-6);
    }
}
