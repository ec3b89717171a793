//! Whether errors are as large as the map says.

use pose_graph::Innovation;

/// Squared errors in standard deviations, by the degrees of freedom that they had.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Consistency {
    /// How many.
    pub n: usize,
    sum: f64,
    degrees: usize,
}

impl Consistency {
    /// Takes one in.
    pub fn add(&mut self, innovation: Innovation) {
        self.n += 1;
        self.sum += innovation.squared;
        self.degrees += innovation.degrees;
    }

    /// The sum over the degrees of freedom: 1 where the map tells the truth, more where it is too
    /// sure.
    pub fn per_degree(&self) -> Option<f64> {
        (self.degrees > 0).then(|| self.sum / self.degrees as f64)
    }
}
