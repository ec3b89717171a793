//! A model's surface as surfels: oriented, curved patches about its places.

mod build;
pub(crate) mod coverage_test;
pub(crate) mod deformation_test;
mod fit;
mod local_surface;
pub(crate) mod map;
pub(crate) mod point_pairs;
pub(crate) mod pose_fit;
pub(crate) mod surfel;
