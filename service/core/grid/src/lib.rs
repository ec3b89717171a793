//! Grid cells: the position of a body as phases of periodic lattices of several spacings.
//!
//! Each module is a face-centred cubic lattice ([`Lattice`]) with its own spacing and orientation;
//! all of them together are the [`GridModules`] of a space. Motion moves every module's phase and
//! reference grid point ([`GridState`]); the phases alone are the [`GridCode`]. A code can be
//! materialised as the activations of cells ([`population`]), compared ([`similarity`]) and turned
//! back into a position ([`mod@decode`]). [`octant`] is the seed paper's Algorithm 1, [`heading`]
//! reads out head-direction cells.
//!
//! Equation numbers are those of the seed paper, "A Novel Computational Modeling for Grid and Place
//! Neurons in Spatial Mapping and Navigation in 3-D Environment".

mod code;
pub mod decode;
mod extent;
pub mod heading;
mod inner_product;
mod joint_lattice;
mod lattice;
mod module;
mod modules;
pub mod octant;
mod phase;
pub mod population;
mod position_search;
mod reduction;
mod residuals;
pub mod similarity;
mod state;
mod tuning;

pub use code::{GridCode, InvalidCode, PartialCode};
pub use decode::{Decoded, decode, unique_range_m};
pub use extent::Extent;
pub use joint_lattice::{Ball, Search};
pub use lattice::Lattice;
pub use module::ModuleState;
pub use modules::{GridModules, GridSettings};
pub use octant::{OctantActivation, octant_activation};
pub use phase::Phase;
pub use position_search::PositionSearch;
pub use state::GridState;
