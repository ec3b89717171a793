//! What is known of a channel of views.

use super::turned::Turned;
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
    /// What a turn of the body between two views changes.
    pub turned: Turned,
    /// Whether that is so far that a pair of views says less than odometry does, or as far as views
    /// were compared. Agents are still found among the cells by such views.
    pub is_coarse: bool,
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
    turned,
    is_coarse,
    information_nats,
    independence
});

impl LearnedChannel {
    /// The same after what was known of the channel before: one that was coarse by its range is so
    /// until that is clearly shorter.
    #[must_use]
    pub fn after(mut self, before: &[Self]) -> Self {
        let is_long = |one: &Self| one.range_m > COARSE_M.1;
        let was_coarse = { before.iter() }
            .any(|one| one.channel == self.channel && one.is_coarse && is_long(one));
        self.is_coarse |= was_coarse && is_long(&self);
        self
    }

    /// Whether one that was read from a checkpoint is one.
    pub fn is_sound(&self) -> bool {
        let numbers = [self.range_m, self.information_nats, self.independence];
        self.turned.is_sound()
            && self.views as usize <= VIEWS_MAX
            && numbers.iter().all(|number| number.is_finite())
    }
}
