//! Point clouds of objects with normals: learned from random contacts, recognised from others in an
//! unknown pose.
//!
//! A [`Cloud`] is a file with the header `x,y,z,nx,ny,nz`, metres in the object's own frame. A part
//! of its points are felt, with noise, to learn the object; contacts of a trial come from the
//! others, with noise, in a frame that is turned and shifted at random. [`run`] gives a [`Report`].

mod cloud;
mod probe;
mod report;
mod run;
mod symmetry;

pub use cloud::{Cloud, InvalidCloud, Oriented};
pub use probe::Exploration;
pub use report::{OneObject, Report, Rotation, Stop};
pub use run::{PointsSettings, run};
