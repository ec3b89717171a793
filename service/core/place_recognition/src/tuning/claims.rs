//! Claims where an agent is.

/// Fewest views.
pub(crate) const VIEWS_MIN: u32 = 3;
/// A claim is right up to this error, across and up \[m\].
pub(crate) const NEAR_M: f64 = 15.0;
pub(crate) const NEAR_Z_M: f64 = 2.5;
/// Weight of a view in what is learned: neighbours err alike.
pub(crate) const WEIGHT: f64 = 0.3;
/// Log odds from which on a claim is made \[nats\]. They are learned from agents whose own
/// poses err and while the map grows, and understate how often later claims are right.
pub(crate) const SURE: f64 = 0.8;
/// Views one after the other that must be so sure: chance does not last.
pub(crate) const TIMES: u8 = 4;
/// Log odds down to which the pose of an agent that was found is corrected \[nats\].
pub(crate) const FOLLOWED: f64 = 0.0;
/// Factor by which what was learned fades with a claim: the latest fifty count.
pub(crate) const KEPT: f64 = 0.98;
/// Fewest claims that say how often they are right.
pub(crate) const COUNT_MIN: f64 = 10.0;
/// First claims, the older ones faded, after which they are tried less often.
pub(crate) const COUNT_MANY: f64 = 25.0;
/// Largest share of wrong ones at which claims are made at all.
pub(crate) const WRONG_MAX: f64 = 0.2;
/// Squared error of a claim in its variances: at first, and the largest that counts.
pub(crate) const RATIO: f64 = 2.0;
pub(crate) const RATIO_MAX: f64 = 10.0;
/// Least variance of a component \[m², rad²\].
pub(crate) const FLOOR: f64 = 1e-4;
