//! What is known of a channel of views.

use crate::tuning::log::VIEWS_MAX;
use crate::tuning::similarity::COARSE_M;
use state::state_of_struct;

/// What was learned of a channel when its views were last matched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedChannel {
    /// Number of the channel.
    pub channel: u8,
    /// Views that it was learned from.
    pub views: u32,
    /// Range of the channel: views are alike within it \[m\].
    pub range_m: f64,
    /// Mean log of the likelihood ratio of two neighbours along the way to be within the range of
    /// one another, against far ones: what a pair of views says \[nats\]. Of the later half of the
    /// views, by what the earlier half teaches; not above zero where views say nothing.
    pub information_nats: f64,
    /// Share of the evidence of a view that is its own: neighbours say nearly the same.
    pub independence: f64,
}

state_of_struct!(LearnedChannel {
    channel,
    views,
    range_m,
    information_nats,
    independence
});

impl LearnedChannel {
    /// Whether views are alike over so far that pairs of them say less than odometry does. Agents
    /// are still found among the cells by them.
    pub fn is_coarse(&self) -> bool {
        self.range_m > COARSE_M
    }

    /// Whether one that was read from a checkpoint is one.
    pub fn is_sound(&self) -> bool {
        let numbers = [self.range_m, self.information_nats, self.independence];
        self.views as usize <= VIEWS_MAX && numbers.iter().all(|number| number.is_finite())
    }
}
