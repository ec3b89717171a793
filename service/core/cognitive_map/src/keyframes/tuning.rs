//! Tuning: all constants of the keyframe graph, with unit and meaning. One without a reason is a
//! judgement: no measurement of it alone is recorded.
//!
//! Pairs of a length and an angle bound a motion \[m, rad\]. Limits of memory and what a space
//! sets are in [`KeyframeSettings`](super::settings::KeyframeSettings).

use super::matching::Matching;

// Keyframes and sightings.

/// Motion that counts as rest \[m, rad\].
pub(super) const REST_WITHIN: (f64, f64) = (0.005, 0.005);

/// Rest after which a keyframe is added \[ns\].
pub(super) const REST_NS: i64 = 1_000_000_000;

/// Keyframes searched back for the instant of a sighting.
pub(super) const LOOK_BACK_MAX: usize = 256;

/// Most sightings of a keyframe.
pub(super) const SIGHTINGS_PER_KEYFRAME_MAX: usize = 32;

/// Deviations by which two distances from one place may differ to be taken together. Source: one
/// that was reflected stays apart.
pub(super) const RANGES_AGREE_SD: f64 = 3.0;

/// Deviations of the position and the height of a point of which distances alone may be known, from
/// where the estimate had it \[m\]. Source: so that the equations have one solution; more than what
/// such a point is ever off, and for heights those of rooms.
pub(super) const RANGED_POINT_SD_M: (f64, f64) = (100.0, 3.0);

/// Part of the keyframes that is new since the last relaxation when what was seen relaxes the past
/// again: a past that was kept whole has then grown by 0.3. Source: so the work of all relaxations
/// is some four times that of the last one, or, of a graph that is full, of one for every quarter.
pub(super) const NEWLY_SEEN: f64 = 0.3 / 1.3;

// Attachments.

/// Most attachments that are checked with one record. The work after a relaxation is spread, so
/// that no record pays for all of it.
pub(super) const ATTACHMENTS_PER_RECORD: u32 = 16;

// Index.

/// Keyframes of an agent from one index entry to the next.
pub(super) const INDEX_SPACING: u32 = 64;

// Measurement models.

/// Least standard deviation of a sighting, so that its covariance has an inverse \[m\].
pub(super) const SIGHTING_SD_MIN_M: f64 = 1e-3;

/// Shortest distance at which a direction means something \[m\].
pub(super) const DIRECTION_DISTANCE_MIN_M: f64 = 0.02;

// Sparsification.

/// Keyframes that are compared; the one whose loss is least is removed.
pub(super) const KEYFRAMES_COMPARED: u32 = 16;

/// Most keyframes examined until one may be removed.
pub(super) const KEYFRAMES_EXAMINED_MAX: u32 = 1024;

/// Unevenness that counts as much as doubling the variance of a sighting \[m\].
pub(super) const UNEVENNESS_M: f64 = 0.05;

/// Lever by which a rotation counts as unevenness \[m\].
pub(super) const ROTATION_LEVER_M: f64 = 0.5;

// Loop closures.

/// Squared Mahalanobis distance after a relaxation from which a closure is rejected, in the gate
/// of closures. By default 25, five deviations: a relaxation that others share in must contradict
/// it more than a gate does before it is dropped.
pub(super) const REFUTED_PER_GATE: f64 = 25.0 / 11.3;

/// Earlier closures, in the order of time, with which a closure is compared.
pub(super) const CLOSURES_COMPARED: usize = 24;

/// Longest way between two closures of a run \[m\].
pub(super) const RUN_STEP_MAX_M: f64 = 3.0;

/// Way and rotation after which a run ends and another one begins \[m, rad\]: what looks alike for
/// so long, and beyond a corner, is likely to be the same.
pub(super) const RUN_LENGTH_MAX_M: f64 = 20.0;
pub(super) const RUN_TURN_MAX_RAD: f64 = 2.0;

/// Least standard deviation of the places of a map along each axis, where chance is concerned
/// \[m\]: in a room, any closure lies near any other, and a false one bends little.
pub(super) const CHANCE_SD_MIN_M: f64 = 5.0;

/// Log of the odds at which runs of closures are accepted: 99 to 1.
pub(super) const ACCEPTED_LOG_ODDS: f64 = 4.6;

/// Fewest closures of a run that others support; one alone may be any mistake.
pub(super) const RUN_CLOSURES_MIN: usize = 3;

/// Log of the odds at which fewer are accepted.
pub(super) const ACCEPTED_ALONE_LOG_ODDS: f64 = 2.0 * ACCEPTED_LOG_ODDS;

/// Seeds that are tried, where no run is evident by itself.
pub(super) const SEEDS_MAX: usize = 3;

/// Rounds in which runs are accepted by those accepted before, and keyframes that are relaxed in
/// all of them together: each relaxes the map and asks for its covariances. Source: on a sphere of
/// 2,500 poses (`sphere2500`) with four rounds a third of the closures waited for the others.
pub(super) const ACCEPTANCE_ROUNDS: std::ops::RangeInclusive<usize> = 4..=16;
pub(super) const ACCEPTANCE_KEYFRAMES: usize = 16_384;

/// Standard deviation of an unknown angle \[rad\].
pub(super) const UNKNOWN_ANGLE_SD_RAD: f64 = 3.0;

/// Least standard deviation of a closure \[m, rad\].
pub(super) const CLOSURE_SD_MIN: f64 = 1e-3;

/// Keyframes for each record between two relaxations: so the amortised cost of a relaxation is that
/// of so many keyframes a record.
pub(super) const KEYFRAMES_PER_RECORD: usize = 8;

/// Stream time from the record at which a relaxation begins to the one at which it comes into
/// force \[ns\]: enough for one of ten thousand keyframes, which takes 0.2 s, on a busy machine,
/// and little enough for a closure to reach the pose within a second.
pub(super) const RELAXATION_DELAY_NS: i64 = 500_000_000;

/// Most records between the two, whatever their stamps say: two seconds of twenty robots that send
/// a hundred samples a second.
pub(super) const RELAXATION_RECORDS_MAX: u32 = 4096;

/// Keyframes up to which these two hold; with more both are longer in proportion.
pub(super) const RELAXED_IN_TIME: u32 = 10_000;

/// Keyframes that move with one record, once a relaxation is in force: about 0.2 ms.
pub(super) const KEYFRAMES_MOVED_PER_RECORD: usize = 1024;

/// Most rounds of relaxation and rejection.
pub(super) const RELAXATION_ROUNDS_MAX: usize = 3;

// The coarse graph.

/// Motion between keyframes of the coarse graph \[m, rad\]. Over so short a way the noise of
/// odometry is below that of closures, and is added to what moves to a neighbour.
pub(super) const COARSE_STEP: (f64, f64) = (1.0, 0.5);

/// Keyframes of the coarse graph beyond which its steps are longer: so that a relaxation of a map
/// of many kilometres takes seconds, too.
pub(super) const COARSE_KEYFRAMES_MAX: usize = 4096;

/// Factor of a step with which too many keyframes are left to the next one that is tried.
pub(super) const THINNED_LONGER: f64 = 2.0;

/// Keyframes of the coarse graph beyond which those with sightings are dissolved as well. Source: a
/// relaxation of so many takes a second, and its time grows with their number.
pub(super) const COARSE_SIGHTED_MAX: usize = 16384;

/// The step of these that is tried first \[m\], and the factor to the next one.
pub(super) const COARSE_SIGHTED_STEPS_M: (f64, f64) = (0.25, 1.4);

/// Keyframes on either side of a tie to the map that stay. Source: the heading of decent odometry
/// is lost over some hundred, and with it what they say of how the map lies.
pub(super) const KEPT_NEAR_TIES: usize = 128;

/// How often what the motions between two keyframes of the coarse graph miss is shared among them.
/// Source: by then what is left is of third order.
pub(super) const BRIDGE_ROUNDS: usize = 2;

/// Most pending closures of the coarse graph, the latest ones. Earlier ones have been judged many
/// times; a refinement of the whole past judges them again.
pub(super) const COARSE_PENDING_MAX: usize = 512;

// Calibrations of odometry.

/// Motions between keyframes that share a calibration. More would be coupled needlessly in the
/// solver, and fewer would be as many calibrations as poses.
pub(super) const CALIBRATED_TOGETHER: u32 = 32;

/// Least change of a calibration from one to the next, as a part of the variance that is expected
/// of it: for the information to be finite.
pub(super) const WANDER_MIN: f64 = 1e-6;

/// Least variance of a component of a calibration \[1, 1, rad²/s²\].
pub(super) const CALIBRATION_VARIANCE_MIN: f64 = 1e-12;

/// Factor of an agent's noise of rotations, as closures may show it.
pub(super) const TURN_NOISE_BOUNDS: std::ops::RangeInclusive<f64> = 0.01..=10.0;

/// Fewest closures for which a noise is supposed: fewer hardly tell one from another.
pub(super) const CLOSURES_SUPPOSED_MIN: u64 = 16;

/// Factors of it with which closures are judged, where the noise is not stated: what is assumed is
/// that of modest wheels, and good ones have a twentieth of it.
pub(super) const TURN_NOISES_TRIED: &[f64] = &[1.0, 0.25, 0.0625];

/// Factors of it with which views are matched, where the noise is not stated.
pub(super) const MATCHED_TURN_NOISES: &[f64] = &[1.0, 0.4];

/// Factor that is one deviation off what is expected of that.
pub(super) const TURN_NOISE_PRIOR_SD: f64 = 10.0;

// Kernels of the relaxation.

/// Least standard deviation of a motion, so that its covariance has an inverse \[m, rad\].
pub(super) const MOTION_SD_MIN: f64 = 1e-4;

/// Scale of the Cauchy kernel of sightings, in standard deviations.
pub(super) const SIGHTING_SCALE: f64 = 3.0;

/// Scale of the Geman–McClure kernel of loop closures, in standard deviations.
pub(super) const CLOSURE_SCALE: f64 = 3.0;

/// Variance of a motion of which nothing is known \[m²\].
pub(super) const UNKNOWN_MOTION_VARIANCE_M2: f64 = 1e12;

// Matches of views.

/// Keyframes for each sighting up to which sightings hold a map together: they say to decimetres
/// what views say to metres.
pub(super) const KEYFRAMES_PER_SIGHTING: usize = 4;

/// How views are matched while samples come in, from where the map has them.
pub(super) const LIVE_MATCHING: Matching = Matching {
    views_max: 1024,
    keyframes_max: 1024,
    widths: &[4.0, 2.0, 1.0],
    close_matchings: 0,
    prefers_more: true,
    needs_news: true,
    veers: &[],
};

/// The same whenever their number has grown by two fifths: a map that was taken for another one
/// stays near to it otherwise.
pub(super) const LIVE_MATCHING_ANEW: Matching = Matching {
    views_max: 512,
    keyframes_max: 1024,
    close_matchings: 0,
    prefers_more: true,
    ..REFINED_MATCHING
};

/// How views are matched for the refined past. A robot that has turned by radians too much before
/// its first loop lies in another basin of attraction: so other veers are tried.
pub(super) const REFINED_MATCHING: Matching = Matching {
    views_max: usize::MAX,
    keyframes_max: 8192,
    widths: &[32.0, 16.0, 8.0, 4.0, 2.0, 1.0],
    close_matchings: 2,
    prefers_more: false,
    needs_news: false,
    veers: &[0.0, -1.0, 1.0, -2.0, 2.0],
};

/// Least distance between keyframes where there are too many to match views by, in the range of the
/// channel: half the standard deviation of a match. Two maps whose keyframes lie within it are one.
pub(super) const MATCHED_STEP: f64 = 0.25;

/// Step beyond which a longer one would thin a map no further \[m\]: what is left by then are
/// keyframes that a coarse graph keeps.
pub(super) const THINNED_STEP_MAX_M: f64 = 1e3;

/// Widths of kernels where views are matched near to where a relaxed map has them, and how often.
pub(super) const GATED_WIDTHS: &[f64] = &[4.0, 2.0, 1.0];
pub(super) const GATED_MATCHINGS: usize = 2;

/// The same widths where they are matched close to where the best map has them.
pub(super) const CLOSE_WIDTHS: &[f64] = &[2.0, 1.0];

/// Standard deviation of the veer that is expected \[rad/m\]: wheels whose diameters differ by a
/// part in a hundred, half a metre apart.
pub(super) const VEER_SD_RAD_M: f64 = 0.03;

/// Most steps of a relaxation with one width, and its tolerance: the next one begins where it ends.
pub(super) const MATCHED_STEPS_MAX: usize = 10;
pub(super) const MATCHED_TOLERANCE: f64 = 1e-3;
