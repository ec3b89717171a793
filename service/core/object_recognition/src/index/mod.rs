//! Search structures over the places of one model.

pub(crate) mod block_grid;
pub(crate) mod buckets;
pub(crate) mod cell_lists;
pub(crate) mod lattice_index;
pub(crate) mod nearest_grid;
pub(crate) mod nearest_place;
pub(crate) mod packed_places;
pub(crate) mod shortlist;
pub(crate) mod wide_places;
