//! Tuning: all constants of place recognition, by part, with unit and meaning. One without a reason
//! is a judgement: no measurement of it alone is recorded.
//!
//! Lengths *in reaches* are multiples of the reach of a channel: the distance beyond which its
//! views are no more similar than unrelated ones. Pairs of a length and an angle bound a motion
//! \[m, rad\].

/// Statistics of a channel.
pub(crate) mod channel {
    use std::f64::consts::FRAC_PI_2;

    /// Classes of angles between two views, from 0 to a right angle.
    pub(crate) const CLASSES: usize = 32;
    /// Fewest pairs of views for a class to be used.
    pub(crate) const PAIRS_MIN: u64 = 8;
    /// Pairs over which the mean of a class fades.
    pub(crate) const PAIRS: f64 = 1000.0;
    /// Fewest pairs of a class before a distance may be far for it: so many times what lies three
    /// standard deviations beyond the mean.
    pub(crate) const USUAL_MIN: u64 = 64;
    pub(crate) const FAR: f64 = 2.0;
    /// Pairs over which the mean of unrelated views fades.
    pub(crate) const UNRELATED: f64 = 4096.0;
    /// Fewest unrelated pairs before views are compared with chance.
    pub(crate) const UNRELATED_MIN: u64 = 64;
    /// Views are similar when their angle is so many standard deviations below that of unrelated
    /// ones.
    pub(crate) const SIMILAR_SD: f64 = 4.0;
    /// A pair whose angle is so many standard deviations below the mean is not counted as
    /// unrelated.
    pub(crate) const RELATED: f64 = 3.0;
    /// Least standard deviation of a distance, as a share of it.
    pub(crate) const SHARE_MIN: f64 = 0.1;
    /// Least standard deviation of a distance \[m\]: odometry over a few metres is no better.
    pub(crate) const SD_M_MIN: f64 = 0.02;
    /// Share of the mean angle between unrelated views beyond which a view is new beside another.
    pub(crate) const NEWS: f64 = 0.25;
    /// Least cosine of a class from which the kernel is fitted: views farther apart may be as
    /// similar by chance.
    pub(crate) const KERNEL_COSINE_MIN: f64 = 0.5;
    /// Largest cosine of two views of one place: views are noisy.
    pub(crate) const COSINE_MAX: f64 = 0.999;
    /// Width of a class \[rad\].
    pub(crate) const WIDTH_RAD: f64 = FRAC_PI_2 / CLASSES as f64;
}

/// The memory of views.
pub(crate) mod memory {
    /// Most channels.
    pub(crate) const CHANNELS_MAX: usize = 64;
    /// Most views.
    pub(crate) const VIEWS_MAX: usize = 16_384;
    /// Most numbers in their descriptors: 8 MiB.
    pub(crate) const NUMBERS_MAX: usize = 1 << 21;
    /// Most views of a channel with all of which a new one is compared.
    pub(crate) const COMPARED: usize = 2048;
    /// Of more, the most from which it learns what unrelated views are like: their mean is known to
    /// a sixteenth of a deviation.
    pub(crate) const DRAWN: usize = 512;
    /// Least motion between two views that are compared \[m, rad\].
    pub(crate) const MOVED: (f64, f64) = (0.05, 0.1);
    /// Least motion after which a view may be new \[m, rad\]: nearer ones hardly differ in a room.
    pub(crate) const STEP: (f64, f64) = (0.1, 0.1);
    /// A view that is similar to none of those nearer than this, in reaches, is an outlier:
    /// somebody passes by.
    pub(crate) const BESIDE: f64 = 0.6;
    /// Ordinals by which an agent's own views must be earlier to count as revisited.
    pub(crate) const EARLIER: u32 = 16;
    /// Two views may be of one place if they are nearer than so many standard deviations of their
    /// positions.
    pub(crate) const APART_SD: f64 = 3.0;
    /// Ordinals skipped where an agent was put somewhere else.
    pub(crate) const APART: u32 = 64;
    /// Most similar views of a view, the most similar first.
    pub(crate) const SIMILAR_MAX: usize = 32;
    /// Most incomplete sequence matches of an agent on a channel.
    pub(crate) const MATCHES_MAX: usize = 4;
}

/// Tracks of views.
pub(crate) mod track {
    /// Latest views with which a new one is compared to learn the statistics of its channel.
    pub(crate) const RECENT_MAX: usize = 12;
}

/// Sequence matches.
pub(crate) mod sequence {
    /// Largest difference of ordinals between views of a stretch.
    pub(crate) const GAP_MAX: u32 = 4;
    /// Consecutive views of the present stretch without a pair that complete a match.
    pub(crate) const MISSES_MAX: u32 = 2;
    /// Most views of the present stretch in a match: beyond, odometry adds errors of its own.
    pub(crate) const VIEWS_MAX: usize = 8;
    /// Fewest different views of each stretch. By chance one view in tens of thousands is as
    /// similar to another one.
    pub(crate) const VIEWS_MIN: usize = 2;
    /// Fewest pairs of a match that counts.
    pub(crate) const PAIRS_MIN: usize = 5;
    /// Most pairs.
    pub(crate) const PAIRS_MAX: usize = 96;
}

/// Range alignment.
pub(crate) mod ranges {
    use crate::levenberg_marquardt::Descent;

    /// Share of the pairs that count as independent: neighbouring views are similar for the same
    /// reasons.
    pub(crate) const INDEPENDENT: f64 = 0.5;
    /// Residual beyond which the cost grows linearly (Huber), in standard deviations.
    pub(crate) const BOUNDED: f64 = 2.0;
    /// Largest mean squared residual of ranges that agree.
    pub(crate) const AGREE: f64 = 4.0;
    /// Largest squared Mahalanobis distance of a revisit from the expected pose: 1 in 10⁵ exceeds
    /// it (χ², 6 degrees of freedom).
    pub(crate) const NEAR: f64 = 33.0;
    /// Solutions count that cost by no more than this above the best one.
    pub(crate) const RIVAL: f64 = 12.0;
    /// Solutions closer than this share of the mean range are one.
    pub(crate) const SAME: f64 = 0.2;
    /// The descent from a start.
    pub(crate) const DESCENT: Descent = Descent {
        steps: 25,
        tolerance: 1e-6,
        floor: 0.0,
    };
    /// Standard deviation of an unknown rotation \[rad\].
    pub(crate) const OPEN_RAD: f64 = 3.0;
    /// Standard deviation of an unknown shift, in mean ranges.
    pub(crate) const OPEN_DISTANCES: f64 = 10.0;
}

/// The descriptor Gaussian process.
pub(crate) mod process {
    /// Most views about a point, the nearest first.
    pub(crate) const NEAR_MAX: usize = 12;
    /// Least variance: positions and kernel are not exact.
    pub(crate) const OPEN_MIN: f64 = 0.02;
    /// A point is known when the variance there is at most this.
    pub(crate) const OPEN_MAX: f64 = 0.8;
    /// A point is well known when the variance there is at most this.
    pub(crate) const KNOWN_MAX: f64 = 0.5;
}

/// View alignment.
pub(crate) mod alignment {
    /// ε: probability of an outlier.
    pub(crate) const WRONG: f64 = 0.05;
    /// G: largest evidence of a query \[nats\].
    pub(crate) const EVIDENCE_MAX: f64 = 3.0;
    /// Largest part τ of the effective dimension.
    pub(crate) const COUNTED_MAX: f64 = 0.5;
    /// Largest evidence of a query for a pose against another one at which it cannot be judged
    /// \[nats\].
    pub(crate) const OPEN: f64 = 0.1;
    /// Residual from which on a query loses weight.
    pub(crate) const SOFT: f64 = 2.0;
    /// Rounds of looking up the views about a pose, and steps of each.
    pub(crate) const ROUNDS: (usize, usize) = (3, 4);
    /// A round that moves a pose by less is the last one \[m, rad\].
    pub(crate) const AT_REST: f64 = 1e-3;
}

/// Batch alignment.
pub(crate) mod batch {
    /// Most views about the way, those nearest to a query first.
    pub(crate) const VIEWS_MAX: usize = 64;
    /// Most halvings of a step that does not lower the cost.
    pub(crate) const HALVED_MAX: usize = 4;
    /// A step shorter than this is the last one \[m, rad\].
    pub(crate) const AT_REST: f64 = 1e-3;
    /// Squared leave-one-out residual, 1 on average, beyond which a query is an outlier.
    pub(crate) const OFF_MAX: f64 = 3.0;
    /// Largest share of outliers.
    pub(crate) const STRAY_MAX: f64 = 0.3;
    /// Variance of an outlier: larger than that of an unknown place.
    pub(crate) const ANYTHING: f64 = 4.0;
}

/// Revisits.
pub(crate) mod revisit {
    /// A revisit says nothing of an agent whose position is surer than the revisit by this factor.
    pub(crate) const SURER: f64 = 2.0;
    /// Deviations from one another beyond which two stretches are not one place.
    pub(crate) const AWAY: f64 = 6.0;
    /// Least evidence of the views along a stretch for where they are aligned \[nats\].
    pub(crate) const AGREE: f64 = 3.0;
}

/// Searches.
pub(crate) mod search {
    /// Most queries of a search.
    pub(crate) const QUERIES_MAX: usize = 48;
    /// Longest way over which they lie \[m\]: beyond some metres odometry adds errors of its own.
    pub(crate) const WAY_M_MAX: f64 = 5.0;
    /// Most numbers in their descriptors: a quarter of a MiB.
    pub(crate) const NUMBERS_MAX: usize = 1 << 16;
}

/// Ranges of a search.
pub(crate) mod problem {
    /// Standard deviation of odometry's lengths as a share of the way: that of a modest robot.
    pub(crate) const ODOMETRY_SHARE: f64 = 0.05;
}

/// Lookup of reference views.
pub(crate) mod references {
    /// Farthest that relaxation may have moved a view since it was stored, for the prefilter by the
    /// stored position to keep it \[m\].
    pub(crate) const DISPLACED_M: f64 = 5.0;
}

/// Pose seeding.
pub(crate) mod seeding {
    use crate::levenberg_marquardt::Descent;

    /// Most nodes of a query.
    pub(crate) const NODES_PER_SPOT_MAX: usize = 4;
    /// Most nodes from which poses are seeded.
    pub(crate) const SEEDS_MAX: usize = 16;
    /// Fewest queries whose nodes must be as far from one another as the queries are.
    pub(crate) const SPOTS_MIN: usize = 4;
    /// Deviations between two distances up to which they agree.
    pub(crate) const AGREE: f64 = 2.5;
    /// Rounds of reweighting.
    pub(crate) const ROUNDS: usize = 5;
    /// Turns about the way that are tried: a straight way leaves the turn about it open.
    pub(crate) const TURNS: u32 = 6;
    /// Most steps of an eigendecomposition, which needs some ten.
    pub(crate) const EIGEN_STEPS_MAX: usize = 200;
    /// When a descent ends, but for the steps.
    pub(crate) const DESCENT: Descent = Descent {
        steps: 0,
        tolerance: 1e-5,
        floor: 1e-9,
    };
    /// Steps of a first descent, and of a final one.
    pub(crate) const STEPS: (usize, usize) = (6, 20);
    /// Most poses of the final descent.
    pub(crate) const POSES_MAX: usize = 12;
    /// Poses closer than this are the same, in reaches of the channel and \[rad\].
    pub(crate) const SAME: (f64, f64) = (0.15, 0.25);
    /// Gate: largest residual of a range that counts, in reaches.
    pub(crate) const GATE: f64 = 1.0;
    /// Most ranges of a query that count.
    pub(crate) const CUES_PER_SPOT: usize = 8;
}

/// Candidates.
pub(crate) mod candidates {
    /// Poses nearer than this are of one candidate, in reaches.
    pub(crate) const PLACE: f64 = 0.5;
    /// Most poses of a candidate that are refined by batch alignment.
    pub(crate) const WHOLE_MAX: usize = 4;
    /// A pose is dropped when its cost exceeds the best one by this \[nats\].
    pub(crate) const RIVAL: f64 = 12.0;
    /// Standard deviation of a rotation beyond which other turns about the way are tried \[rad\].
    pub(crate) const TURN_OPEN_RAD: f64 = 0.5;
}

/// Acceptance of a relocalisation.
pub(crate) mod relocalise {
    /// Least motion between two queries \[m, rad\].
    pub(crate) const MOVED: (f64, f64) = (0.05, 0.2);
    /// Queries between two attempts, before and after the agent was found.
    pub(crate) const FRESH: (u32, u32) = (2, 3);
    /// An agent that is not found for long makes attempts more rarely: one query more for so many
    /// queries.
    pub(crate) const PATIENCE: usize = 12;
    /// Fewest queries of an attempt.
    pub(crate) const QUERIES_MIN: usize = 6;
    /// Log odds at which a pose is accepted: one wrong answer in a thousand \[nats\].
    pub(crate) const SURE: f64 = 6.9;
    /// Largest standard deviation of the heading of an answer \[rad\].
    pub(crate) const HEADING_SD_MAX_RAD: f64 = 0.3;
    /// Standard deviation of the heading up to which the search goes on after the agent was found:
    /// an error of the heading becomes one of the position \[rad\].
    pub(crate) const HEADING_SD_RAD: f64 = 0.02;
    /// Way after which it ends in any case \[m\].
    pub(crate) const ON_M: f64 = 5.0;
    /// Factor by which a candidate may be less certain query by query than by all queries at once:
    /// where they differ by more, the map is thin, and the batch rests on what the map leaves open.
    pub(crate) const ROUGHLY: f64 = 2.0;
    /// Largest factor of the covariance: beyond it the map contradicts the queries, or itself.
    pub(crate) const INFLATION_MAX: f64 = 2.0;
    /// Most guesses.
    pub(crate) const GUESSES_MAX: usize = 8;
}

/// Kidnap detection.
pub(crate) mod kidnap {
    /// Threshold of the cumulative sum \[nats\]: one false alarm in a thousand, if one query in a
    /// thousand is the first one after a kidnapping.
    pub(crate) const SURE: f64 = 6.9 + 6.9;
    /// Least distance between weighed queries, in lengths of the channel's kernel: nearer ones have
    /// correlated errors.
    pub(crate) const SPACING: f64 = 0.25;
    /// Factor by which the errors of a pose may exceed their standard deviations.
    pub(crate) const INFLATION: f64 = 2.0;
    /// A view nearer than this to the one before must be similar to it, in reaches: else one of
    /// them is an outlier.
    pub(crate) const BESIDE: f64 = 0.6;
    /// Most remembered views near the agent that are looked up.
    pub(crate) const NEAR_MAX: usize = 24;
    /// A query counts if its heading differs from one of the views about it by no more than this,
    /// or than these differ from one another: a channel may see something else in another direction
    /// \[rad\].
    pub(crate) const TURNED_RAD: f64 = 0.5;
}

/// The log of views.
pub(crate) mod log {
    /// Most views; beyond, every second one is dropped.
    pub(crate) const VIEWS_MAX: usize = 4096;
    /// Most numbers of a view as it is logged: longer descriptors are projected.
    pub(crate) const NUMBERS_MAX: usize = 128;
    /// Fewest views that say what a channel shows.
    pub(crate) const VIEWS_MIN: usize = 96;
    /// Fewest new views for which all are matched again, and one for so many earlier ones: the
    /// amortised cost of a view then grows linearly with their number. A robot that comes back is
    /// corrected before its heading has drifted much further.
    pub(crate) const NEW_MIN: usize = 16;
    pub(crate) const PER_NEW: usize = 20;
}

/// The similarity of views, learned for each channel.
pub(crate) mod similarity {
    /// Part of the mean variance of neighbours that is added to both covariances.
    pub(crate) const SHRINKAGE: f64 = 0.05;
    /// Correlations of components of two views of one place that count.
    pub(crate) const CORRELATION_MIN: f64 = 0.02;
    pub(crate) const CORRELATION_MAX: f64 = 0.999;
    /// Neighbours along the way that count as views of one place.
    pub(crate) const NEIGHBOUR_LAGS: std::ops::RangeInclusive<isize> = 1..=3;
    /// Fewest pairs of neighbours.
    pub(crate) const NEIGHBOURS_MIN: usize = 96;
    /// Fewest views of a session that has a mean of its own.
    pub(crate) const SESSION_VIEWS_MIN: usize = 256;
    /// Neighbours among which the range of a channel is found, and classes of their distances.
    pub(crate) const RANGE_LAGS: usize = 20;
    pub(crate) const CLASSES: usize = 20;
    /// Distance at which a Gaussian has half its height, in its deviations.
    pub(crate) const HALF_HEIGHT: f64 = 1.18;
    /// Pairs of neighbours that what a turn leaves and what the next smaller one does are held
    /// together by: those of two views.
    pub(crate) const TURN_PAIRS: f64 = 2.0 * RANGE_LAGS as f64;
    /// Pairs of far views that are drawn.
    pub(crate) const FAR_PAIRS: usize = 40_000;
    /// Fewest views between two that are far from one another, and as a part of all.
    pub(crate) const FAR_MIN: usize = 50;
    pub(crate) const FAR_PART: usize = 20;
    /// Part of the most similar views of a view that its background is the mean of.
    pub(crate) const BACKGROUND_PART: usize = 10;
    /// Bounds of the log-odds of one pair.
    pub(crate) const LOG_ODDS: (f32, f32) = (-6.0, 8.0);
    /// Views to each side that a sequence takes in.
    pub(crate) const SEQUENCE: isize = 2;
    /// Fewest views, and part of a run, that lie between a view and those that it is matched with.
    pub(crate) const GAP_MIN: usize = 30;
    pub(crate) const GAP_PART: usize = 40;
    /// Most matches of a view, and the neighbours of one that count as the same match.
    pub(crate) const MATCHES: usize = 2;
    pub(crate) const BESIDE: isize = 4;
    /// Least probability of a match.
    pub(crate) const PROBABILITY_MIN: f64 = 0.1;
    /// Weight of "nowhere" against a view of which nothing is known.
    pub(crate) const NOWHERE: f64 = 0.5;
    /// Range beyond which views are not compared in pairs, and down to which it stays so \[m\]:
    /// four and three lengths of the kernel of the cells, by which they tell more. Lasers have
    /// ranges of 1 to 8 m, Wi-Fi in a mall one of 30 m.
    pub(crate) const COARSE_M: (f64, f64) = (16.0, 12.0);
    /// Least such range in distances of views one after the other: shorter ones show how far apart
    /// views are, not how far they are alike.
    pub(crate) const COARSE_SPACINGS: f64 = 3.0;
    /// Ranges within which views are matched by a map that has been relaxed.
    pub(crate) const GATE_RANGES: f64 = 6.0;
    /// The same by a map that is right but for its details: views farther apart share nothing.
    pub(crate) const CLOSE_RANGES: f64 = 2.0;
    /// Bounds of the depth of a match: logarithm of its odds.
    pub(crate) const DEPTH: (f64, f64) = (0.05, 6.0);
}

pub(crate) mod tracking;

/// Cells of mean views. Lengths are those of channels that reach farther than a room, such as
/// Wi-Fi (docs/decisions/0072).
pub(crate) mod cells {
    /// Side of a cell, and height of its layer, less than that of a storey \[m\].
    pub(crate) const SIDE_M: f64 = 3.0;
    /// Length of the kernel by which cells about one count \[m\].
    pub(crate) const KERNEL_M: f64 = 4.0;
    /// Farthest cell that counts, in sides: beyond, the kernel is below 0.08.
    pub(crate) const REACH: i32 = 3;
    /// Most cells of all channels, those without views included: about 12 MiB, 0.15 km² in all. A
    /// cell with views takes at most 0.9 KiB.
    pub(crate) const CELLS_MAX: usize = 16_384;
    /// Sharpness of the density of views: a cosine less by its inverse counts e times less.
    pub(crate) const SHARPNESS: f32 = 30.0;
    /// Weight of views that nobody took, so that few views say little.
    pub(crate) const OPEN: f32 = 0.3;
    /// Least density.
    pub(crate) const LEAST: f32 = 1e-6;
}

/// Learning what views say of cells.
pub(crate) mod waking {
    /// Most channels.
    pub(crate) const CHANNELS_MAX: usize = 16;
    /// Information of the prior of a weight.
    pub(crate) const PRIOR: f64 = 1.0;
    /// Least variance of an outcome, so that a step stays bounded.
    pub(crate) const VARIANCE_MIN: f64 = 0.01;
    /// Factor by which what was learned fades with a view: the latest thousand count.
    pub(crate) const KEPT: f64 = 0.999;
    /// Weights of the features before anything is learned.
    pub(crate) const WEIGHTS: [f64; 2] = [3.0, 0.3];
    /// Fewest views that say what a channel tells.
    pub(crate) const VIEWS_MIN: u32 = 64;
    /// Views of a channel that tells nothing until one is tried again.
    pub(crate) const TRIED: u32 = 16;
    /// Least mean information of a view \[nats\].
    pub(crate) const TOLD_MIN: f64 = 1.0;
    /// Fewest cells among which a view is weighed.
    pub(crate) const CELLS_MIN: usize = 64;
    /// Fewest cells of a map in which agents are sought: some 70 m by 70 m. A smaller one is
    /// known by single views.
    pub(crate) const CELLS_LARGE: usize = 512;
    /// Least share of views within or outside, against large weights.
    pub(crate) const SHARE_MIN: f64 = 0.05;
    /// Share of views that were taken in another cell than that of the estimate.
    pub(crate) const MISPLACED: f64 = 0.05;
    /// Standard deviation of a position along an axis up to which its view counts \[m\]: two
    /// lengths of the kernel.
    pub(crate) const SD_M_MAX: f64 = 8.0;
    /// The same up to which it tells whether a claim is right.
    pub(crate) const SHADOW_SD_M_MAX: f64 = 4.0;
    /// The same at which a view counts half.
    pub(crate) const SURE_M: f64 = 4.0;
    /// Views that wait: a few sessions on foot.
    pub(crate) const WAITING: usize = 256;
    /// Rate at which the mean cosine of far views follows.
    pub(crate) const ALIKE_RATE: f64 = 0.02;
    /// Mean cosine of far views from which a channel shows the same everywhere.
    pub(crate) const ALIKE_MAX: f64 = 0.98;
    /// Views of an agent in a row by which claims are tried.
    pub(crate) const SHADOW_VIEWS: u32 = 32;
    /// Most agents by which claims are tried at a time.
    pub(crate) const SHADOWS_MAX: usize = 8;
    /// Views of a channel after which an agent shows that anew, and after which one that does not
    /// go on makes room for another one: at first, and once many claims were tried. Budget: trying
    /// them is half of what a view of an agent costs that knows where it is.
    pub(crate) const SHADOW_WAITS: [u32; 2] = [32, 96];
    /// Rate at which an agent's means of what is alike follow.
    pub(crate) const ALIKE_LATELY: f64 = 0.2;
    /// Views after which an agent is no longer followed.
    pub(crate) const FOLLOWED: u32 = 96;
}

pub(crate) mod particles;

pub(crate) mod claims;
