//! A sequence match: pairs of similar views of two stretches of way.

use std::ops::RangeInclusive;

use nalgebra::{Isometry3, Point3};

use crate::keyframes::SampleKey;
use crate::tuning::sequence as tuning;
use crate::views::{Distance, RecentView, StoredView};
use state::{Counted, Unstored, state_of_struct};

/// A view of the present stretch and a similar one of the earlier stretch, with their distance.
#[derive(Clone, Debug)]
pub(super) struct ViewPair {
    now_ordinal: u32,
    then_ordinal: u32,
    /// Positions by motion alone \[m\].
    pub(super) now: Point3<f64>,
    pub(super) then: Point3<f64>,
    pub(super) mean_m: f64,
    pub(super) sd_m: f64,
}

state_of_struct!(ViewPair {
    now_ordinal,
    then_ordinal,
    now,
    then,
    mean_m,
    sd_m
});

/// The sample in whose frame a stretch is described.
#[derive(Clone, Debug)]
pub(crate) struct SequenceFrame {
    pub(crate) sample: SampleKey,
    /// Pose by motion alone.
    pub(crate) in_odom: Isometry3<f64>,
    /// Uncertainty then \[m, rad\].
    pub(crate) spread: [f64; 2],
}

state_of_struct!(SequenceFrame {
    sample,
    in_odom,
    spread
});

/// Pairs of similar views of a present and an earlier stretch.
#[derive(Clone, Debug)]
pub(crate) struct SequenceMatch {
    pub(crate) now: SequenceFrame,
    pub(crate) then: SequenceFrame,
    /// Lowest and highest ordinal of the earlier stretch.
    low: u32,
    high: u32,
    /// Views since the latest pair.
    misses: u32,
    channel: u8,
    pub(super) pairs: Vec<ViewPair>,
    /// Views of the present stretch, once the match is complete.
    pub(crate) queries: Vec<RecentView>,
}

impl SequenceFrame {
    fn of(view: &StoredView) -> Self {
        Self {
            sample: view.sample,
            in_odom: view.in_odom,
            spread: view.spread,
        }
    }
}

impl SequenceMatch {
    /// A match with its first pair.
    pub(super) fn new(now: &StoredView, then: &StoredView, distance: Distance) -> Self {
        let mut matched = Self {
            now: SequenceFrame::of(now),
            then: SequenceFrame::of(then),
            low: then.ordinal,
            high: then.ordinal,
            misses: 0,
            channel: now.channel,
            pairs: Vec::new(),
            queries: Vec::new(),
        };
        matched.add(now, then, distance);
        matched
    }

    /// Whether an earlier view belongs to the earlier stretch, or continues it.
    pub(super) fn leads_to(&self, then: &StoredView) -> bool {
        self.then.sample.agent == then.sample.agent
            && self.then.sample.session == then.sample.session
            && self.ordinals().contains(&then.ordinal)
    }

    /// Ordinals of the earlier stretch, and of those views that continue it.
    pub(super) fn ordinals(&self) -> RangeInclusive<u32> {
        self.low.saturating_sub(tuning::GAP_MAX)..=self.high.saturating_add(tuning::GAP_MAX)
    }

    /// Adds a pair.
    pub(super) fn add(&mut self, now: &StoredView, then: &StoredView, distance: Distance) {
        self.misses = 0;
        self.now = SequenceFrame::of(now);
        self.low = self.low.min(then.ordinal);
        self.high = self.high.max(then.ordinal);
        if self.pairs.len() < tuning::PAIRS_MAX {
            self.pairs.push(ViewPair {
                now_ordinal: now.ordinal,
                then_ordinal: then.ordinal,
                now: now.in_odom.translation.vector.into(),
                then: then.in_odom.translation.vector.into(),
                mean_m: distance.mean_m,
                sd_m: distance.sd_m,
            });
        }
    }

    /// Counts a view of the present stretch without a pair.
    pub(super) fn miss(&mut self) {
        self.misses += 1;
    }

    /// The number of the channel.
    pub(crate) fn channel(&self) -> u8 {
        self.channel
    }

    /// The ordinal of the first view of the present stretch.
    pub(super) fn first_now(&self) -> u32 {
        self.pairs.first().map_or(0, |pair| pair.now_ordinal)
    }

    /// Whether a view was taken on the earlier stretch, or beside it.
    pub(crate) fn is_beside(&self, then: &StoredView) -> bool {
        then.channel == self.channel && self.leads_to(then)
    }

    /// Whether it is complete.
    pub(super) fn is_over(&self) -> bool {
        self.misses >= tuning::MISSES_MAX
            || self.count(|pair| pair.now_ordinal) >= tuning::VIEWS_MAX
    }

    /// Whether enough views agree that it is no accident.
    pub(super) fn is_telling(&self) -> bool {
        self.pairs.len() >= tuning::PAIRS_MIN
            && self.count(|pair| pair.now_ordinal) >= tuning::VIEWS_MIN
            && self.count(|pair| pair.then_ordinal) >= tuning::VIEWS_MIN
    }

    /// How many different views of a stretch there are.
    fn count(&self, ordinal: impl Fn(&ViewPair) -> u32) -> usize {
        let mut ordinals: Vec<u32> = self.pairs.iter().map(ordinal).collect();
        ordinals.sort_unstable();
        ordinals.dedup();
        ordinals.len()
    }
}

state_of_struct!(SequenceMatch {
    now,
    then,
    low,
    high,
    misses,
    channel,
    pairs as Counted<u64>,
    queries as Unstored,
});
