//! Where the places are, and what they remember: kept by somebody else.

use nalgebra::{Point3, Vector3};

use crate::kernel::Kernel;
use crate::prediction::{Prediction, Support, predict};
use crate::tuning::predict as tuning;
use crate::window::Felt;

/// What the places of a space remember of levels.
pub trait Field {
    /// What is known of a channel; `None` while nothing is, or if it says nothing.
    fn kernel(&self, channel: u8) -> Option<&Kernel>;

    /// The place nearest to a point, if one is near.
    fn nearest(&self, at: &Point3<f64>) -> Option<u32>;

    /// Places about a point, the nearest first, none much farther than `reach_m`.
    fn near(&self, at: &Point3<f64>, reach_m: f64) -> Vec<(u32, Point3<f64>)>;

    /// What a place remembers of a channel that counts for whoever asks.
    fn support(&self, place: u32, channel: u8) -> Option<Support>;

    /// The level of that.
    fn level(&self, place: u32, channel: u8) -> Option<f64> {
        self.support(place, channel).map(|support| support.value)
    }

    /// All places from one on, in order.
    fn places_from(&self, first: u32) -> Box<dyn Iterator<Item = u32> + '_>;

    /// Extent of the box about all places along each axis \[m\].
    fn extent_m(&self) -> Vector3<f64>;
}

/// At most so many places about a point that are apart from one another: of those side by side one
/// says nearly all, and those around say more than those in a row.
pub(crate) fn around(field: &dyn Field, at: &Point3<f64>, felt: &[Felt], most: usize) -> Vec<u32> {
    let lengths = felt.iter().filter_map(|felt| field.kernel(felt.channel));
    let (mut least_m, mut most_m) = (f64::INFINITY, 0.0_f64);
    for kernel in lengths {
        least_m = least_m.min(kernel.length_m);
        most_m = most_m.max(kernel.length_m);
    }
    let mut chosen: Vec<(u32, Point3<f64>)> = Vec::with_capacity(most);
    if most_m <= 0.0 {
        return Vec::new();
    }
    let apart_m2 = (tuning::APART * least_m).powi(2);
    for (place, position) in field.near(at, tuning::REACH * most_m) {
        let is_apart =
            |(_, other): &(u32, Point3<f64>)| (other - position).norm_squared() >= apart_m2;
        if chosen.len() < most && chosen.iter().all(is_apart) {
            chosen.push((place, position));
        }
    }
    chosen.into_iter().map(|(place, _)| place).collect()
}

/// What a channel is expected to be at a point, by places that are near to it.
pub(crate) fn expect(
    field: &dyn Field,
    near: &[u32],
    channel: u8,
    at: &Point3<f64>,
    supports: &mut Vec<Support>,
) -> Option<Prediction> {
    let kernel = field.kernel(channel)?;
    supports.clear();
    supports.extend(
        near.iter()
            .filter_map(|&place| field.support(place, channel)),
    );
    predict(kernel, supports, at)
}
