//! Refined trajectories: where agents were, given all that has been remembered since.

use std::collections::BTreeMap;
use std::sync::{Arc, Weak};
use std::time::Instant;

use ::trajectory::StampedPose;
use cognitive_map::{Agent, AgentId, CognitiveMap};
use tokio::sync::Mutex;

/// A space's latest relaxations, and the places where those queue who want another one.
#[derive(Debug, Default)]
pub(super) struct Refinements {
    pub(super) trajectories: Arc<Mutex<Option<Arc<Refinement>>>>,
    pub(super) graph: Arc<Mutex<Option<Graph>>>,
}

/// A relaxed map as a text. Who holds it keeps it; the space does not.
#[derive(Debug)]
pub(super) struct Graph {
    pub(super) taken: Instant,
    pub(super) text: Weak<String>,
}

/// A text that others hold too.
#[derive(Clone, Debug)]
pub struct SharedText(pub(super) Arc<String>);

impl AsRef<[u8]> for SharedText {
    fn as_ref(&self) -> &[u8] {
        self.0.as_bytes()
    }
}

/// The trajectories of a relaxed map.
#[derive(Debug)]
pub(super) struct Refinement {
    pub(super) revision: u64,
    /// Before the map was taken that it is of.
    pub(super) taken: Instant,
    pub(super) made: Instant,
    pub(super) agents: BTreeMap<String, Vec<StampedPose>>,
}

/// The refined trajectory of each agent of a map that has not been removed, by name; empty where it
/// is not placed. Takes up to seconds.
pub fn refined_trajectories(map: &CognitiveMap) -> BTreeMap<String, Vec<StampedPose>> {
    let mut refined = map.refined().agents.into_iter();
    let of_agent = |(_, agent): (AgentId, &Agent)| {
        // Those of removed agents are among them.
        let poses = refined.next().filter(|refined| refined.is_in_map);
        let poses = poses.map(|refined| refined.poses).unwrap_or_default();
        let rows = poses.iter().map(|row| StampedPose {
            stamp_ns: row.stamp_ns,
            pose: row.pose,
        });
        let name = agent
            .is_enrolled()
            .then(|| agent.name().as_str().to_owned())?;
        Some((name, rows.collect()))
    };
    map.agents_ever().filter_map(of_agent).collect()
}
