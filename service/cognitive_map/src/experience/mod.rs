//! The experience map: nodes, what was measured between them, and the places that fit it best.

mod descent;
mod elimination;
mod equations;
mod incremental;
mod information;
mod innovation;
mod kernel;
mod linearisation;
mod link;
mod map;
mod marginals;
mod node;
mod relaxation;
mod rotation_first;

pub use incremental::{IncrementalRelaxation, IncrementalSettings, Updated};
pub use information::{InvalidInformation, PoseInformation, PositionInformation};
pub use innovation::{ExpectedPose, ExpectedPosition, Innovation};
pub use kernel::{InvalidScale, Kernel, Scale};
pub use link::{Link, LinkId, SightingTarget};
pub use map::{ExperienceMap, InvalidLink};
pub use marginals::Marginals;
pub use node::{Freedom, PointId, PoseId};
pub use relaxation::{Graduation, RelaxationSettings, Relaxed, Start};
