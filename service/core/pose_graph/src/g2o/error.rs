//! Errors of a text in the format g2o.

use crate::InvalidInformation;

/// Why a text is no pose graph.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum G2oError {
    /// A line is no entry of the format.
    #[error("line {line}: {reason}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: LineReason,
    },
    /// There is no edge.
    #[error("the graph has no edge")]
    NoEdge,
    /// A node is held that is nowhere.
    #[error("the held node {0} has neither an entry nor an edge")]
    HeldNowhere(u64),
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LineReason {
    /// Another kind of entry.
    #[error("entries of the kind {0:?} are not read")]
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
    /// A column is no node's id.
    #[error("column {column} is not a whole number")]
    NotAnId {
        /// Number of the column, from 1.
        column: usize,
    },
    /// A quaternion has no direction.
    #[error("the quaternion has no direction")]
    NoDirection,
    /// An edge that ends where it begins.
    #[error("the edge joins a node with itself")]
    Loop,
    /// The information matrix makes no sense.
    #[error(transparent)]
    Information(#[from] InvalidInformation),
    /// A node that was a pose before is a point here, or the other way round.
    #[error("node {0} is a pose in one line and a point in another")]
    PoseAndPoint(u64),
    /// A sensor that has no entry before this line.
    #[error("there is no sensor {0} before this line")]
    UnknownSensor(u64),
    /// Planar and spatial entries in one file.
    #[error("the file was {so_far} before")]
    Mixed {
        /// What the entries before were.
        so_far: &'static str,
    },
}
