//! Why a data set cannot be read.

use std::io;

use trajectory::{InvalidStamp, InvalidTrajectory};

/// Why a data set cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TucError {
    /// A file cannot be read.
    #[error("read {file}")]
    Io {
        /// Name of the file.
        file: String,
        /// The system's reason.
        source: io::Error,
    },
    /// The directory has no file with such an ending.
    #[error("there is no file *{0}")]
    Absent(&'static str),
    /// A line makes no sense.
    #[error("line {line}: {reason}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: TucReason,
    },
    /// One of the texts is not that of a set.
    #[error("{file}")]
    Text {
        /// Name of the file.
        file: String,
        /// Why.
        source: Box<Self>,
    },
    /// There is no odometry.
    #[error("there is no odometry")]
    NoOdometry,
    /// The truth is no trajectory.
    #[error(transparent)]
    Truth(#[from] InvalidTrajectory),
}

/// What is wrong with a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TucReason {
    /// Too few columns.
    #[error("expected {expected} columns, found {found}")]
    Columns {
        /// As the format says.
        expected: usize,
        /// In the line.
        found: usize,
    },
    /// A time.
    #[error(transparent)]
    Stamp(#[from] InvalidStamp),
    /// A column is not a finite number.
    #[error("column {column} is not a finite number")]
    NotANumber {
        /// Number of the column, from 1.
        column: usize,
    },
    /// A variance is negative.
    #[error("a variance is negative")]
    NegativeVariance,
    /// Odometry does not go forward in time.
    #[error("the stamp is not later than the one before")]
    NotLater,
}
