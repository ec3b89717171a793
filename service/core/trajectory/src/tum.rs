//! The TUM trajectory format: one line `t x y z qx qy qz qw` a pose, `t` in seconds.

use std::fmt::Write as _;

use geometry::rotation_from_xyzw;
use nalgebra::{Isometry3, Translation3};

use crate::StampedPose;
use crate::{InvalidStamp, format_seconds, parse_seconds};

/// Columns of a line.
const COLUMNS: usize = 8;

/// Why a line is no pose.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {reason}")]
pub struct TumError {
    /// Number of the line, from 1.
    pub line: usize,
    /// What is wrong with it.
    pub reason: TumReason,
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TumReason {
    /// Not eight columns.
    #[error("expected 8 columns, found {0}")]
    Columns(usize),
    /// The time.
    #[error(transparent)]
    Stamp(#[from] InvalidStamp),
    /// A column is not a finite number.
    #[error("column {0} is not a finite number")]
    NotANumber(usize),
    /// The quaternion has no direction.
    #[error("the quaternion has no direction")]
    NoDirection,
}

/// Writes poses, times with nine decimals printed exactly from the nanoseconds, other numbers with
/// as many digits as it takes to read the same number back.
pub fn write_tum<'a>(poses: impl IntoIterator<Item = &'a StampedPose>) -> String {
    let mut text = String::new();
    for StampedPose { stamp_ns, pose } in poses {
        let t = &pose.translation;
        let q = &pose.rotation;
        writeln!(
            text,
            "{} {} {} {} {} {} {} {}",
            format_seconds(*stamp_ns),
            t.x,
            t.y,
            t.z,
            q.i,
            q.j,
            q.k,
            q.w
        )
        .expect("writing to a string does not fail");
    }
    text
}

/// Reads poses. Blank lines and what follows a `#` are skipped; quaternions are normalised.
///
/// # Errors
/// A line has not eight columns, or one of them is not what it should be.
pub fn read_tum(text: &str) -> Result<Vec<StampedPose>, TumError> {
    let mut poses = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default();
        let columns: Vec<&str> = content.split_whitespace().collect();
        if !columns.is_empty() {
            let pose = parse(&columns).map_err(|reason| TumError {
                line: index + 1,
                reason,
            })?;
            poses.push(pose);
        }
    }
    Ok(poses)
}

/// One pose from the columns of its line.
fn parse(columns: &[&str]) -> Result<StampedPose, TumReason> {
    if columns.len() != COLUMNS {
        return Err(TumReason::Columns(columns.len()));
    }
    let stamp_ns = parse_seconds(columns[0])?;
    let mut numbers = [0.0; COLUMNS];
    for (index, column) in columns.iter().enumerate().skip(1) {
        let number = column
            .parse::<f64>()
            .ok()
            .filter(|number| number.is_finite());
        numbers[index] = number.ok_or(TumReason::NotANumber(index + 1))?;
    }
    let [_, x, y, z, i, j, k, w] = numbers;
    let rotation = rotation_from_xyzw([i, j, k, w]).ok_or(TumReason::NoDirection)?;
    Ok(StampedPose {
        stamp_ns,
        pose: Isometry3::from_parts(Translation3::new(x, y, z), rotation),
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_line_reads_as_the_format_says() {
        let text = "# t x y z qx qy qz qw\r\n\n1305031098.6659 1.5 -2 3e-1 0 0 2 0 # turned\r\n";
        let poses = read_tum(text).unwrap();
        assert_eq!(poses.len(), 1);
        assert_eq!(poses[0].stamp_ns, 1_305_031_098_665_900_000);
        let pose = poses[0].pose;
        assert_eq!(pose.translation.vector, Vector3::new(1.5, -2.0, 0.3));
        assert!((pose.rotation * Vector3::x() + Vector3::x()).norm() < 1e-12);
        assert!(write_tum(&poses).starts_with("1305031098.665900000 1.5 -2 0.3 0 0 1 0"));
    }

    #[test]
    fn a_bad_line_is_named() {
        let good = "0 0 0 0 0 0 0 1\n";
        for (bad, reason) in [
            ("1 2 3", TumReason::Columns(3)),
            (
                "x 0 0 0 0 0 0 1",
                TumReason::Stamp(InvalidStamp::NotDecimal),
            ),
            ("0 0 0 inf 0 0 0 1", TumReason::NotANumber(4)),
            ("0 0 0 0 0 0 0 0", TumReason::NoDirection),
        ] {
            let text = format!("{good}{bad}\n");
            assert_eq!(read_tum(&text), Err(TumError { line: 2, reason }));
        }
    }

    proptest! {
        #[test]
        fn what_is_written_reads_back(
            stamp_ns: i64,
            translation in prop::array::uniform3(-1e6..1e6_f64),
            turn in prop::array::uniform3(-3.0..3.0_f64),
        ) {
            let stamped = StampedPose {
                stamp_ns,
                pose: Isometry3::new(translation.into(), turn.into()),
            };
            let read = read_tum(&write_tum([&stamped])).unwrap();
            prop_assert_eq!(read.len(), 1);
            prop_assert_eq!(read[0].stamp_ns, stamp_ns);
            prop_assert_eq!(read[0].pose.translation, stamped.pose.translation);
            prop_assert!(read[0].pose.rotation.angle_to(&stamped.pose.rotation) < 1e-7);
        }

        #[test]
        fn any_text_is_answered(text in "[-+0-9.eEnaif# \n]{0,200}") {
            let _ = read_tum(&text);
        }
    }
}
