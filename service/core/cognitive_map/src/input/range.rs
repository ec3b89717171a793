//! Distances alone.

use nalgebra::Vector3;

use super::InvalidSample;
use super::invalid::{METRES_MAX, bounded, deviations};

/// A distance without a direction, as ultra-wideband radios measure it.
///
/// It is that from an antenna on the body to the target: the position of a landmark, or the origin
/// of another agent's body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    distance_m: f64,
    sd_m: f64,
    antenna: Vector3<f64>,
}

impl Range {
    /// Of a distance, its standard deviation, and where the antenna is in the body frame.
    ///
    /// # Errors
    /// A number is out of range, the range or the deviation negative.
    pub fn new(range_m: f64, range_sd_m: f64, antenna_m: [f64; 3]) -> Result<Self, InvalidSample> {
        bounded([range_m, 0.0, 0.0], METRES_MAX)?;
        deviations([range_sd_m, 0.0, 0.0])?;
        if range_m < 0.0 {
            return Err(InvalidSample::NumberOutOfRange);
        }
        Ok(Self {
            distance_m: range_m,
            sd_m: range_sd_m,
            antenna: bounded(antenna_m, METRES_MAX)?,
        })
    }

    /// Distance \[m\].
    pub fn range_m(&self) -> f64 {
        self.distance_m
    }

    /// Standard deviation of the distance \[m\].
    pub fn range_sd_m(&self) -> f64 {
        self.sd_m
    }

    /// Where the antenna is in the body frame: its lever arm \[m\].
    pub fn antenna_m(&self) -> &Vector3<f64> {
        &self.antenna
    }
}
