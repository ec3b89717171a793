//! Constants of the registration of landmarks: meaning and source of each.
//!
//! `cogmap-lab replay mrclam DIR --unknown-starts --anonymous 3` measures them together. A constant
//! without a source is a judgement: no measurement of it alone is recorded.

/// Landmarks of the newer frame that are sought in the older one. Source: work.
pub(crate) const SOUGHT_MAX: usize = 24;
/// Deviations within which two landmarks, or two distances, may be the same.
pub(crate) const GATE: f64 = 3.0;
/// Difference of squared distances over the variance from which it is sure which of two landmarks
/// is meant. Source: the ratio of the likelihoods is exp(12 / 2), 400 to 1.
pub(crate) const SURE_MARGIN: f64 = 12.0;
/// Fewest correspondences between planar frames, and between frames in space.
pub(super) const CORRESPONDENCES_MIN: (usize, usize) = (5, 6);
/// Log₁₀ of the expected number of motions that are as good by chance, for one to be accepted.
/// Source: `docs/decisions/0030-landmark-names-are-checked.md`.
pub(super) const LOG10_FALSE_ALARMS_MAX: f64 = -4.0;
/// Part of its logarithm that another motion may have. Source: as above.
pub(super) const RIVAL_MAX: f64 = 0.5;
/// By how much the logarithm of the mirror image may be better.
pub(super) const MIRRORED_MAX: f64 = 1.0;
/// Distance up to which landmarks count as one group, in their mean distance. Source: landmarks
/// close together agree together.
pub(super) const TOGETHER: f64 = 0.5;
/// Part of the landmarks among the correspondences, of the frame that has fewer there, that must be
/// correspondences.
pub(super) const AGREEING_MIN: f64 = 0.7;
/// Distance from a correspondence up to which landmarks are among them, in the landmarks' mean
/// distance.
pub(super) const AMONG: f64 = 1.5;
/// Rounds of fitting a motion and seeking its correspondences again.
pub(super) const ROUNDS: usize = 4;
/// Landmarks of the newer frame from which motions are drawn, in a plane and in space. Source:
/// work.
pub(super) const SEEDS_MAX: (usize, usize) = (10, 8);
/// Most motions that are tested; with more, a registration would not be of bounded cost.
pub(super) const HYPOTHESES_MAX: usize = 1 << 13;
/// Least distance of two landmarks that say how a frame is turned, in its own deviations.
pub(super) const DISTANCE_MIN: f64 = 5.0;
/// Rough motions that are refined.
pub(super) const CANDIDATES_MAX: usize = 16;
