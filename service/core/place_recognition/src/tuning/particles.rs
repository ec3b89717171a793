//! The particle filter.

/// Particles.
pub(crate) const COUNT: usize = 3000;
/// One of so many is drawn anew with each view.
pub(crate) const FRESH: usize = 25;
/// Probability at first that the agent is where nothing is known.
pub(crate) const WITHOUT: f64 = 0.5;
/// Part of independent evidence that a view is: neighbours err alike.
pub(crate) const TEMPER: f64 = 0.3;
/// The same when particles are first drawn.
pub(crate) const FIRST: f64 = 0.5;
/// Bounds of the evidence of a view for the cells \[nats\].
pub(crate) const WITHIN: (f64, f64) = (-8.0, 3.0);
/// Evidence against a particle between the cells \[nats\].
pub(crate) const HOLE: f64 = 1.0;
/// Probability that an agent is somewhere else altogether with the next view.
pub(crate) const ANEW: f64 = 0.004;
/// Part of the probability of no cell that stays with a view, and what is added.
pub(crate) const OPEN: (f64, f64) = (0.999, 0.0005);
/// Standard deviation of the heading: of a view, and of the way \[rad, rad/√m\].
pub(crate) const TURN_SD: (f64, f64) = (0.005, 0.04);
/// The same of the position \[m, m/√m\].
pub(crate) const POSITION_SD: (f64, f64) = (0.15, 0.15);
/// Standard deviation of the factor of lengths, and of its step: that of steps on foot.
pub(crate) const SCALE_SD: f64 = 0.05;
pub(crate) const SCALE_STEP: f64 = 0.004;
/// Probability that other senses mislead about the turn, and part of independent evidence that
/// they are with each view: most of their error lasts.
pub(crate) const MISLED: f64 = 0.05;
pub(crate) const TURN_TEMPER: f64 = 0.1;
/// Particles so near to the mode make up the estimate, across and up \[m\].
pub(crate) const NEAR_M: f64 = 10.0;
pub(crate) const NEAR_Z_M: f64 = 2.0;
