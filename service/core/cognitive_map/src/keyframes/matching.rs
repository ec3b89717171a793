//! How views are matched, and the matches.

use std::sync::Arc;

use place_recognition::{ViewLog, ViewMatch};

use super::tuning;

/// The matches of views by which a map is relaxed. Clones share them.
pub(super) type ViewMatches = Arc<[ViewMatch]>;

/// How views are matched.
#[derive(Debug)]
pub(super) struct Matching {
    /// Most views of a channel, evenly thinned beyond: the cost grows with their square.
    pub(super) views_max: usize,
    /// Widths of the kernels of matches, in their ranges, one relaxation each.
    pub(super) widths: &'static [f64],
    /// Veers of odometry from which it begins anew, in standard deviations.
    pub(super) veers: &'static [f64],
}

impl Matching {
    /// How the views of a log are matched while samples come in.
    pub(super) fn live(log: &ViewLog) -> &'static Self {
        if log.is_much_longer() {
            &tuning::LIVE_MATCHING_ANEW
        } else {
            &tuning::LIVE_MATCHING
        }
    }
}
