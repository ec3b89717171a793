//! Why a set cannot be read.

use std::io;
use std::path::PathBuf;

/// Name of the file in a directory.
pub(super) const FILE: &str = "victoria_park.txt";

/// A file of the original set, which is not read.
pub(super) const ORIGINAL: &str = "aa3_dr.mat";

/// Why a set cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum VictoriaError {
    /// A file cannot be read.
    #[error("read {}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// Only the original form is there.
    #[error(
        "{} holds the original set ({ORIGINAL} and others), which is not read; its text form {FILE} is",
        .0.display()
    )]
    Original(PathBuf),
    /// A line makes no sense.
    #[error("line {line}: {reason}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: VictoriaReason,
    },
    /// The text is not that of a set.
    #[error("{}", file.display())]
    Text {
        /// The file.
        file: PathBuf,
        /// Why.
        source: Box<Self>,
    },
    /// There is no motion.
    #[error("there is no odometry")]
    NoOdometry,
    /// A motion does not begin where the one before ended, so that no car can have driven so.
    #[error("the motion from {from} to {to} does not go on from the pose before")]
    Apart {
        /// Number of the pose before.
        from: u64,
        /// Number of the pose behind.
        to: u64,
    },
    /// A tree was seen from a pose that no motion reaches.
    #[error("no motion reaches the pose {0}, which saw a landmark")]
    Unreached(u64),
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VictoriaReason {
    /// Another kind of line.
    #[error("lines of the kind {0:?} are not read")]
    Kind(String),
    /// Another number of columns.
    #[error("expected {expected} columns, found {found}")]
    Columns {
        /// As the format says.
        expected: usize,
        /// In the line.
        found: usize,
    },
    /// A column is not a finite number.
    #[error("column {column} is not a finite number")]
    NotANumber {
        /// Number of the column, from 1.
        column: usize,
    },
    /// A column is no number of a pose or landmark.
    #[error("column {column} is not a whole number")]
    NotAnId {
        /// Number of the column, from 1.
        column: usize,
    },
    /// Motion that ends where it begins.
    #[error("the motion joins a pose with itself")]
    Loop,
    /// A number that was a pose before is a landmark here, or the other way round.
    #[error("{0} is a pose in one line and a landmark in another")]
    PoseAndLandmark(u64),
    /// The covariance makes no sense.
    #[error("the covariance is not positive definite")]
    Covariance,
}
