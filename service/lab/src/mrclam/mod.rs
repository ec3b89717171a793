//! The UTIAS multi-robot data sets (MRCLAM) as streams of readings.
//!
//! A data set is one directory of text tables:
//!
//! | file | columns |
//! |---|---|
//! | `Barcodes.dat` | subject, barcode (subjects 1-5 are robots, from 6 on landmarks) |
//! | `Landmark_Groundtruth.dat` | subject, x, y, sd x, sd y \[m\]; may be absent |
//! | `Robot<r>_Odometry.dat` | t \[s\], forward velocity \[m/s\], angular velocity \[rad/s\] |
//! | `Robot<r>_Measurement.dat` | t \[s\], barcode, range \[m\], bearing \[rad, left positive\]; may be absent |
//! | `Robot<r>_Groundtruth.dat` | t \[s\], x \[m\], y \[m\], heading \[rad\] |
//!
//! Leung, Halpern, Barfoot, Liu, "The UTIAS multi-robot cooperative localization and mapping
//! dataset", IJRR 2011. The sets come without a licence for redistribution, so none is kept here.

mod data_set;
mod error;
mod false_names;
mod robot;
mod stream;
mod table;

pub use data_set::Mrclam;
pub use error::{MrclamError, RowReason};
pub use robot::{Command, Measurement, PlanarPose, RobotLog};
pub use stream::{BEARING_SD_RAD, RANGE_SD_M, TeamReading};

#[cfg(test)]
mod tests;
