//! Pose graphs in the g2o text format.
//!
//! One entry a line, white space between columns, `#` before comments:
//!
//! | entry | columns |
//! |---|---|
//! | `VERTEX_SE2` | id, x, y \[m\], heading \[rad\] |
//! | `VERTEX_SE3:QUAT` | id, x, y, z \[m\], qx, qy, qz, qw |
//! | `EDGE_SE2` | from, to, x, y, heading, 6 entries of the information matrix |
//! | `EDGE_SE3:QUAT` | from, to, x, y, z, qx, qy, qz, qw, 21 entries of the information matrix |
//!
//! The entries of an information matrix are those on and above the diagonal, row by row; its order is translation,
//! rotation vector, in the axes of the second pose. Kümmerle et al. 2011, "g2o: a general framework for graph
//! optimization". A file is planar or spatial, not both.

mod error;
mod feed;
mod graph;
mod parse;

pub use error::{G2oError, LineReason};
pub use feed::Feed;
pub use graph::{Edge, PoseGraph};

#[cfg(test)]
mod tests;
