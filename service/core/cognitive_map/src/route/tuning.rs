//! Constants of routes: unit, meaning and source of each.

/// Millionths of a cost's unit.
pub(super) const MICRO: f64 = 1e6;
/// Places of which distances along the ways are kept, as lower bounds. Source: Goldberg & Harrelson
/// 2005 use 16; of 32 a search in a hall of 100,000 places looks at a third fewer. Their coarse
/// distances fill a line of the processor's cache for each place.
pub(super) const PIVOTS: usize = 32;
/// Ways of a waypoint that have room in a line of the processor's cache. Others are looked up.
pub(super) const LINKS: usize = 6;
/// Waypoints of a page of what a search reads. Source: the heads of pages stay in the processor's
/// cache, and a page is copied in some microseconds.
pub(super) const PAGE: usize = 256;
/// Unit of these distances \[µm\]: 32 bits reach 43 km.
pub(super) const BOUND_UNIT_UM: u64 = 10;
/// Coarse units of the longest of these distances. Source: 16 bits, with room for ways to come.
pub(super) const COARSE_UNITS: u32 = 50_000;
/// Waypoints between two questions whether the search is given up. Source: about a millisecond.
pub(super) const ASK_EVERY: usize = 4096;
/// Share of an alternative's length that it may have in common with a route before it.
pub(super) const SHARED_MAX: f64 = 0.5;
/// Part of its cost by which a way becomes dearer with each route that leads along it, while
/// alternatives are looked for. Source: a detour of half as much is worth being told.
pub(super) const PENALTY_PERCENT: u64 = 50;
/// Searches for one alternative. Source: after four penalties a shared way costs threefold.
pub(super) const TRIALS_PER_ALTERNATIVE: usize = 4;
/// Half-lives after which a way's age counts no more.
pub(super) const HALF_LIVES_MAX: f64 = 20.0;
/// Part of a field radius that is tolerated at a step.
pub(super) const TOLERANCE_PER_FIELD_RADIUS: f64 = 0.5;
/// Standard deviations that are tolerated at a step.
pub(super) const TOLERANCE_SD: f64 = 2.0;
/// Places of a path that a shortcut may leave out. Source: with places a field radius apart, as far
/// as codes of the default spacings are unambiguous.
pub(super) const SHORTCUT_PLACES_MAX: usize = 32;
/// What one step fewer is worth \[m\]. Source: robots slow down at goals; far below their size.
pub(super) const STEP_M: f64 = 1e-3;
/// Edge of the cubes in which swept ways are looked up \[m\].
pub(super) const CORRIDOR_CELL_M: f64 = 0.5;
/// Steps ahead of the one that an agent is on, among which it is looked for: it may cut a corner,
/// or its samples may be far apart.
pub(super) const STEPS_AHEAD: usize = 8;
/// Field radii beyond which an agent has left its route. Source: so far away none of its places
/// answers.
pub(super) const LEFT_FIELD_RADII: f64 = 2.0;
