//! Constants of the fold: unit, meaning and source of each.

/// Part of a field radius by which an agent moves until the places are asked again. Source:
/// confidence changes by at most a tenth over that distance, and a robot at rest asks nothing.
pub(super) const ASK_PER_FIELD_RADIUS: f64 = 0.125;
/// Confidence from which on a place answers. Source: that at one field radius.
pub(super) const ANSWER_MIN: f64 = 0.5;
/// Distance from where an agent was estimated to be from which on it did not drift there, in
/// standard deviations of both poses. Source: three deviations.
pub(super) const DRIFT_MAX: f64 = 3.0;
/// Standard deviation of the position of an agent that may be anywhere, in the space's `lost_sd_m`.
/// Without a recorded measurement.
pub(super) const KIDNAPPED_SD: f64 = 10.0;
/// Standard deviation of what an agent turned by where nothing is known of it \[rad\]. Source: no
/// rotation is off by more than half a turn.
pub(super) const UNSEEN_TURN_SD_MAX_RAD: f64 = 3.0;
/// Radius about a point in which places are looked for, in the reach of a place. Source: as far as
/// the index goes without a scan.
pub(super) const NEAR_REACHES: f64 = 3.4;
/// A place that the agent itself taught counts if it was surer then by this factor of the variance.
/// Source: at less, what it tells is mostly the agent's own error.
pub(super) const OWN_SURER: f64 = 2.0;
/// Standard deviation of the vertical of an agent that wakes up, put down upright, and of one that
/// got lost \[rad\]. Source: who is lost for long was often wrong about the vertical before.
pub(super) const UPRIGHT_SD_RAD: (f64, f64) = (0.07, 0.25);
/// Variance of the heading up to which an agent teaches whether levels tell it \[rad²\]. Source: a
/// deviation of 9 degrees is below what compasses in buildings err by.
pub(super) const TEACHING_RAD2: f64 = 0.15 * 0.15;
/// Least length of the body's x axis as seen from above for it to have a heading: 60 degrees up or
/// down.
pub(super) const UPRIGHT_MIN: f64 = 0.5;
