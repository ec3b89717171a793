//! What routes are to be like.

use std::collections::BTreeSet;

use super::region::Region;
use crate::memory::ids::PlaceId;
use state::state_of_enum;

/// What is to be least on a route.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RouteCost {
    /// Length \[m\].
    #[default]
    Length,
    /// Mean duration \[s\]; of a way that was only travelled the other way, that.
    Time,
    /// Variance of the position at the end \[m²\]: that of the mean of what was measured, summed
    /// over the axes and the ways.
    Uncertainty,
    /// Length \[m\], twice as much for each half-life of memories since the way was travelled, in
    /// samples of the space.
    Recency,
}

/// Whether ways may be taken in a direction in which nobody has travelled them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reverse {
    /// They may.
    #[default]
    Allowed,
    /// They may not.
    Never,
}

/// What a route is to be like.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RouteOptions {
    /// What is to be least.
    pub cost: RouteCost,
    /// Whether ways may be taken backwards.
    pub reverse: Reverse,
    /// Places that it does not lead through.
    pub avoid_places: BTreeSet<PlaceId>,
    /// Boxes that it does not lead into.
    pub avoid_regions: Vec<Region>,
    /// Half the width of the bodies that travelled \[m\], where the route may cut corners: by
    /// straight lines that are wholly within this distance of ways.
    pub shortcuts_within_m: Option<f64>,
    /// Most other routes to answer, each of which shares at most half its length with any before.
    pub alternatives: usize,
}

state_of_enum!(Reverse {
    Allowed = 0,
    Never = 1,
});
state_of_enum!(RouteCost {
    Length = 0,
    Time = 1,
    Uncertainty = 2,
    Recency = 3,
});
