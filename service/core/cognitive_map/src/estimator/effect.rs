//! What a sample brings about beside the estimate.

use nalgebra::{Isometry3, Vector3, Vector6};

use super::outcome::Step;
use crate::input::{Label, Relation};

/// What a sample brought about beside the estimate: what those need who remember the past.
///
/// The estimator appends effects to its caller's list. They are to be applied by [`Effect::order`],
/// those of one kind as they come.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// An agent was set aside: it begins anew, in a frame of its own.
    SetAside {
        /// The agent.
        agent: u32,
    },
    /// An agent moved.
    Moved {
        /// The agent.
        agent: u32,
        /// Its motion.
        step: Step,
    },
    /// A sighting of a landmark was accepted.
    LandmarkSighted {
        /// Who saw.
        agent: u32,
        /// The landmark's one name.
        label: Label,
        /// Where.
        relation: Relation,
        /// Variances of its components: distance, azimuth and elevation \[m², rad²\], or three
        /// lengths \[m²\]. They hold what the agent's sensor was learned to get wrong, and not the
        /// loss of weight of an outlying component.
        variance: Vector3<f64>,
        /// Where the landmark is in the body frame by the estimate, once that is known \[m\].
        at: Option<Vector3<f64>>,
        /// Whether it is new in the agent's frame.
        is_new: bool,
    },
    /// A sighting of an agent was accepted or refused, once both had moved up to it.
    AgentSighted(AgentSighted),
    /// Labels turned out to be names of one landmark: of each pair the name that is given up, and
    /// the one that stays.
    LandmarksAssociated(Vec<(Label, Label)>),
    /// A frame was merged into another one.
    FramesMerged(FramesMerged),
}

impl Effect {
    /// Rank among the effects of one call. An agent that was set aside left before anything else
    /// happened; what was seen is remembered before the frames of the agents change.
    pub fn order(&self) -> u8 {
        match self {
            Self::SetAside { .. } => 0,
            Self::Moved { .. } | Self::LandmarkSighted { .. } => 1,
            Self::AgentSighted(_) => 2,
            Self::LandmarksAssociated(_) => 3,
            Self::FramesMerged(_) => 4,
        }
    }
}

/// A sighting of an agent, once both agents were in one frame and had moved up to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgentSighted {
    /// Who saw.
    pub observer: u32,
    /// Whom.
    pub target: u32,
    /// When \[ns\].
    pub stamp_ns: i64,
    /// Where.
    pub relation: Relation,
    /// Whether it was accepted.
    pub accepted: bool,
    /// Variances of its components as in [`Effect::LandmarkSighted`]; of a pose all six, of a point
    /// the first three.
    pub variance: Vector6<f64>,
}

/// A frame that was merged into another one.
#[derive(Clone, Debug, PartialEq)]
pub struct FramesMerged {
    /// Number of the frame, which is empty from now on.
    pub frame: usize,
    /// Number of the frame that it was merged into; the map's is 0.
    pub into: usize,
    /// Pose of the former in the latter, before the landmarks known in both corrected everything.
    pub pose: Isometry3<f64>,
    /// Numbers of the agents that came over.
    pub agents: Vec<u32>,
}
