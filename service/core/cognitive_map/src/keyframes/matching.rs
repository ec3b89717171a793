//! How views are matched, and the matches.

use std::sync::Arc;

use place_recognition::ViewMatch;

/// The matches of views by which a map is relaxed. Clones share them.
pub(super) type ViewMatches = Arc<[ViewMatch]>;

/// How views are matched.
#[derive(Debug)]
pub(super) struct Matching {
    /// Most views of a channel, evenly thinned beyond: the cost grows with their square.
    pub(super) views_max: usize,
    /// Most keyframes of the map, thinned beyond.
    pub(super) keyframes_max: usize,
    /// Widths of the kernels of matches, in their ranges, one relaxation each.
    pub(super) widths: &'static [f64],
    /// How often the views are matched once more, close to where the best map has them.
    pub(super) close_matchings: usize,
    /// Whether a map with more matches takes the place of the one that has held so far, if it is
    /// less probable by less than half of what tells two maps apart: agents are corrected by it.
    pub(super) prefers_more: bool,
    /// Whether views without matches are matched only if the new ones resemble others more than
    /// those before them did.
    pub(super) needs_news: bool,
    /// Veers of odometry from which it begins anew, in standard deviations.
    pub(super) veers: &'static [f64],
}
