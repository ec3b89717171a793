//! The TUC SLAM data sets: one robot's planar odometry, and place matches of which many are false.
//!
//! | line of `<name>_Input.txt` | columns |
//! |---|---|
//! | `odom2` | t \[s\], velocity x, y \[m/s\], turn rate \[rad/s\], their variances \[(m/s)², (m/s)², (rad/s)²\] |
//! | `loop` | t of a sample, t of an earlier one that was taken for the same place \[s\], score from 0 to 1 |
//!
//! | line of `<name>_GT.txt` | columns |
//! |---|---|
//! | `point2` | t \[s\], x, y \[m\], 4 entries of a covariance |
//! | `angle` | t \[s\], heading \[rad\], its variance |
//!
//! A velocity belongs to the interval that ends at its stamp. Other lines are skipped. Neubert,
//! Schubert, Protzel, "A neurologically inspired sequence processing model for mobile robot place
//! recognition", RA-L 2019, doi 10.1109/LRA.2019.2927096. The sets may not be used commercially, so
//! none is kept here.

mod data_set;
mod error;
mod false_matches;
mod samples;

pub use data_set::{Match, OdometryStep, Tuc};
pub use error::{TucError, TucReason};
pub use samples::Motion;

#[cfg(test)]
mod tests;
