//! Recordings of robots as tables, with views, levels, ranges and motion.
//!
//! | file | columns |
//! |---|---|
//! | `samples.csv` | `t_s,agent,kind`, and what the kind has |
//! | `truth.csv` | `t_s,agent,x,y,z,yaw,quality`; `yaw` is empty where it is unknown |
//! | `CHANNEL.npy` | one view a row, as `numpy.save` writes 16, 32 or 64-bit floats |
//!
//! | kind | columns |
//! |---|---|
//! | `increment` | dx, dy, dz \[m\], dyaw \[rad\] since the motion before; sd of x and y, z, yaw |
//! | `velocity` | vx, vy \[m/s\], turn rate \[rad/s\], and for how long until the stamp \[s\] |
//! | `level` | channel, value |
//! | `descriptor` | channel, row of its file |
//! | `sighting` | `landmark` or `agent`, name, `range`, distance \[m\], its deviation \[m\] |
//! | `sighting` | `own_sample_at_s`, when the robot was at the same place |
//!
//! The first row of a file names the columns. An agent's rows are in order of time.

mod data_set;
mod error;
mod reflections;
mod row;
mod samples;
mod views;

pub use data_set::{Log, TableSet, Truth};
pub use error::{TableError, TableReason};
pub use row::{Row, RowBody};
pub use samples::Choice;
pub use views::Views;

#[cfg(test)]
mod tests;
