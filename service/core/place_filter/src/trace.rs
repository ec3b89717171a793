//! What a place remembers of a channel, for the filter.

use nalgebra::Vector3;
use state::state_of_struct;

use crate::tuning::trace as tuning;

/// Mean of the levels that were sensed about a place, and of where that was.
///
/// A level that was sensed by somebody who hardly knew where it is says little, so who is surer
/// counts more, and who is much less sure does not count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trace {
    /// Where, from the place \[m\].
    pub offset_m: Vector3<f64>,
    /// Mean level.
    pub value: f64,
    /// Sum of the weights, in levels of the surest.
    pub weight: f64,
    /// Variance of that position along an axis \[m²\].
    pub spread_m2: f64,
    /// The agent that taught it first.
    pub teacher: u32,
}

state_of_struct!(Trace {
    offset_m,
    value,
    weight,
    spread_m2,
    teacher
});

impl Trace {
    /// The first level that an agent senses about a place, at an offset from it \[m\] and with a
    /// variance of that along an axis \[m²\].
    pub fn new(value: f64, offset_m: Vector3<f64>, spread_m2: f64, teacher: u32) -> Self {
        Self {
            offset_m,
            value,
            weight: 1.0,
            spread_m2,
            teacher,
        }
    }

    /// Whether a level was sensed here that is one of the channel.
    pub fn is_known(&self) -> bool {
        self.weight > 0.0
    }

    /// Of a place about which nothing was sensed yet.
    pub fn unknown(offset_m: Vector3<f64>, spread_m2: f64, teacher: u32) -> Self {
        Self {
            weight: 0.0,
            ..Self::new(0.0, offset_m, spread_m2, teacher)
        }
    }

    /// A further one.
    pub fn learn(&mut self, value: f64, offset_m: Vector3<f64>, spread_m2: f64, teacher: u32) {
        let known_m2 = self.spread_m2 + tuning::POSITION_M2;
        let new_m2 = spread_m2 + tuning::POSITION_M2;
        let is_first = !self.is_known();
        if !is_first && new_m2 > tuning::LESS_SURE * known_m2 {
            return;
        }
        if is_first || known_m2 > tuning::LESS_SURE * new_m2 {
            *self = Self::new(value, offset_m, spread_m2, teacher);
            return;
        }
        let share = 1.0 / (1.0 + self.weight * new_m2 / known_m2);
        self.offset_m += (offset_m - self.offset_m) * share;
        self.value += (value - self.value) * share;
        self.spread_m2 += (spread_m2 - self.spread_m2) * share;
        self.weight = (self.weight + 1.0).min(tuning::LEVELS);
    }
}
