#![doc = include_str!("../README.md")]

pub mod g2o;

mod calibration;
mod descent;
mod elimination;
mod equations;
mod graph;
mod information;
mod kernel;
mod linearisation;
mod link;
mod marginals;
mod node;
mod normal_blocks;
mod range_blocks;
mod relaxation;
mod rotation_first;

pub use calibration::{Calibration, Exposure, Reading};
pub use graph::{InvalidLink, PoseGraph};
pub use information::{
    Information, InvalidInformation, PoseInformation, PositionInformation, RangeInformation,
};
pub use kernel::{InvalidScale, Kernel, Scale};
pub use link::{CalibrationInformation, Link, LinkId, SightingTarget};
pub use marginals::Marginals;
pub use node::{CalibrationId, Freedom, Lengths, PointId, PoseId, Veer};
pub use relaxation::{Graduation, RelaxationSettings, Relaxed, Start};
