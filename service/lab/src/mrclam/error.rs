//! What may be wrong with a data set.

use trajectory::InvalidStamp;

/// Why a data set cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum MrclamError {
    /// A file cannot be read.
    #[error("read {file}")]
    Io {
        /// Name of the file.
        file: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file which every data set has is absent.
    #[error("{file} is absent")]
    Absent {
        /// Name of the file.
        file: String,
    },
    /// A line is no row of its table.
    #[error("{file}, line {line}: {reason}")]
    Row {
        /// Name of the file.
        file: String,
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: RowReason,
    },
    /// A table has no row.
    #[error("{file} has no row")]
    Empty {
        /// Name of the file.
        file: String,
    },
    /// No robot has both odometry and truth.
    #[error("no robot has both odometry and truth")]
    NoRobot,
    /// There is no time which all tables cover.
    #[error("the odometry and the truth of all robots have no time in common")]
    NoCommonSpan,
}

/// What is wrong with a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RowReason {
    /// Another number of columns.
    #[error("expected {expected} columns, found {found}")]
    Columns {
        /// As the format says.
        expected: usize,
        /// In the line.
        found: usize,
    },
    /// The time.
    #[error(transparent)]
    Stamp(#[from] InvalidStamp),
    /// A column is not a finite number.
    #[error("column {column} is not a finite number")]
    NotANumber {
        /// Number of the column, from 1.
        column: usize,
    },
    /// A column is not a whole number from 0 on.
    #[error("column {column} is not a whole number")]
    NotACount {
        /// Number of the column, from 1.
        column: usize,
    },
    /// A distance is negative.
    #[error("the range is negative")]
    NegativeRange,
    /// Two subjects carry the same barcode.
    #[error("the barcode is another subject's already")]
    SharedBarcode,
}
