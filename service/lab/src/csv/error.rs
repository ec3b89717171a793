//! Why a set cannot be read.

use std::io;

use trajectory::{InvalidStamp, InvalidTrajectory};

/// Why a set cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// A file cannot be read.
    #[error("read {file}")]
    Io {
        /// The file.
        file: String,
        /// The system's reason.
        source: io::Error,
    },
    /// The first line does not name the columns.
    #[error("{file}, line 1: must begin with {expected}, the names of the columns, not {found:?}")]
    Header {
        /// The file.
        file: String,
        /// The names.
        expected: &'static str,
        /// In the line.
        found: String,
    },
    /// A line makes no sense.
    #[error("{file}, line {line}: {reason}")]
    Line {
        /// The file.
        file: String,
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: TableReason,
    },
    /// A file of views is not one.
    #[error("{file}: not a matrix of floating-point numbers as numpy.save writes it")]
    Views {
        /// The file.
        file: String,
    },
    /// A sample names a view that is not there.
    #[error("the channel {channel} has no view {row}")]
    NoView {
        /// The channel.
        channel: String,
        /// Number of the row, from 0.
        row: usize,
    },
    /// The truth is no trajectory.
    #[error("the truth of {agent}")]
    Truth {
        /// The agent.
        agent: String,
        /// Why.
        source: InvalidTrajectory,
    },
    /// No agent has samples.
    #[error("there is no sample")]
    Empty,
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TableReason {
    /// Too few columns.
    #[error("expected {expected} columns, found {found}")]
    Columns {
        /// As the kind has.
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
    /// A deviation or a time for which a velocity was held is negative.
    #[error("column {column} is negative")]
    Negative {
        /// Number of the column, from 1.
        column: usize,
    },
    /// A column is no number of a row.
    #[error("column {column} is not a whole number")]
    NotARow {
        /// Number of the column, from 1.
        column: usize,
    },
    /// An unknown kind of sample or of sighting.
    #[error("{0:?} is not read")]
    Kind(String),
    /// The name of an agent or a channel is none.
    #[error(transparent)]
    Name(#[from] cogmap_proto::NameError),
    /// An agent's time runs backwards.
    #[error("the stamp is earlier than that of the agent's row before")]
    Backwards,
}
