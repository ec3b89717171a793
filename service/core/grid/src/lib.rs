#![doc = include_str!("../README.md")]

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
