//! Victoria Park as text: the motion of a car and the trees that it saw.
//!
//! | line | columns |
//! |---|---|
//! | `ODOMETRY` | from, to, x, y \[m\], heading \[rad\], 6 entries of the covariance |
//! | `LANDMARK` | pose, landmark, x, y in the frame of the pose \[m\], 3 entries of the covariance |
//!
//! The entries of a covariance are those on and above the diagonal, row by row. White space stands
//! between columns, `#` before comments. Poses and landmarks are numbered together, in the order in
//! which they appear, and nothing has a stamp; each motion begins where the one before ended. This
//! is the form in which the set comes with GTSAM and iSAM (`victoria_park.txt`), with trees already
//! found in the laser scans and told apart. The original set (Nebot, University of Sydney:
//! `aa3_dr.mat`, `aa3_lsr2.mat`, `aa3_gpsx.mat`) holds scans and GPS fixes in a binary form, and is
//! not read.

mod data_set;
mod error;
mod samples;

pub use data_set::{Odometry, Sighting, Victoria};
pub use error::{VictoriaError, VictoriaReason};

#[cfg(test)]
mod tests;
