//! Constants of ways: unit, meaning and source of each.

/// Standard deviations along or about an axis beyond which a measured way and its places disagree.
/// Source: one in a million measurements that follow their noise.
pub(super) const DISAGREEMENT_SD: f64 = 5.0;
/// What places have to move for it to be noted \[m\]. Source: as for a place.
pub(super) const NOTICED_M: f64 = 0.01;
/// The same for a turn \[rad\].
pub(super) const NOTICED_RAD: f64 = 0.01;
/// Most measurements that a mean counts: an older one fades. Source: the mean of 64 has an eighth
/// of the deviation of one, and still follows what changes.
pub(super) const MEASUREMENTS_MAX: u32 = 64;
/// Edges that the search for bridges looks at, for one way that is forgotten. Source: some 50 µs.
pub(super) const BRIDGE_EDGES_MAX: usize = 2048;
