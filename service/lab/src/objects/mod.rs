//! Objects of coloured voxels, and an end effector that explores them: the seed paper's third
//! environment.
//!
//! The paper (Section 4.3) has "three different 3D objects […] with various geometrical structures,
//! where surface colours are used to recreate heterogeneous tactile textures", a colour being a
//! scalar value of a voxel, and an end effector that makes "random exploratory motions across the
//! surface of each simulated object". What it leaves open is settled here:
//!
//! - **Shapes**: unions of two to five boxes, ellipsoids and cylinders of random extents, in voxels
//!   of 1 cm; any number of objects for a seed.
//! - **Colours**: eight levels from 0 to 1 in equal steps, in patches of three voxels on average.
//!   All objects have all colours, so that no single value says which object it is.
//! - **Contacts**: at the middle of a voxel's free face. Position by path integration from the
//!   first contact, the level of the voxel, and the normal of the face for those who want it.
//! - **Moves**: one to three faces straight on in a random direction, around edges and up walls.
//! - **Value noise**: a standard deviation as a share of the range of levels, so that 10 % is seven
//!   tenths of a step between colours. **Motion noise**: a standard deviation along each axis as a
//!   share of a move's length, which adds up.

mod explorer;
mod shape;
mod voxel_object;

pub use explorer::{ExplorationNoise, Explorer, Felt};
pub use voxel_object::{COLOURS, EDGE_M, Face, Heading, VoxelObject};

#[cfg(test)]
mod tests;
