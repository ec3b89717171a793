//! Pose graphs in the g2o text format.
//!
//! One entry a line, white space between columns, `#` before comments:
//!
//! | entry | columns |
//! |---|---|
//! | `VERTEX_SE2` | id, x, y \[m\], heading \[rad\] |
//! | `VERTEX_SE3:QUAT` | id, x, y, z \[m\], qx, qy, qz, qw |
//! | `VERTEX_XY`, `VERTEX_TRACKXYZ` | id, x, y \[m\] and z: a point |
//! | `EDGE_SE2` | from, to, x, y, heading, 6 entries of the information matrix |
//! | `EDGE_SE3:QUAT` | from, to, x, y, z, qx, qy, qz, qw, 21 entries of the information matrix |
//! | `EDGE_SE2_XY` | pose, point, x, y in the frame of the pose, 3 entries of the information matrix |
//! | `EDGE_SE3_TRACKXYZ` | pose, point, sensor, x, y, z in the frame of the sensor, 6 entries of the information matrix |
//! | `PARAMS_SE3OFFSET` | sensor, its pose on the body: x, y, z, qx, qy, qz, qw |
//! | `FIX` | ids of nodes that stay where they are |
//!
//! The entries of an information matrix are those on and above the diagonal, row by row; its order
//! is translation, rotation vector, in the axes of the second pose. Kümmerle et al. 2011, "g2o: a
//! general framework for graph optimization". A file is planar or spatial, not both. Lines may come
//! in any order, except that a sensor comes before its edges.

mod error;
mod graph;
mod parse;
mod write;

pub use error::{G2oError, LineReason};
pub use graph::{Edge, G2oGraph, PointEdge};
pub use write::write_g2o;
