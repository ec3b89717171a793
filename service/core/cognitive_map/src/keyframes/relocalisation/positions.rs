//! Where the remembered views were taken, by what the map knows now.

use std::cell::RefCell;
use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::keyframes::graph::KeyframeGraph;

/// An agent, its session, and a sample of that.
type Instant = (u32, u32, u64);

/// Points of the map from which views were taken, each sought once for a question.
pub(super) struct Positions<'a> {
    chronicle: &'a KeyframeGraph,
    known: RefCell<BTreeMap<Instant, Option<Point3<f64>>>>,
}

impl<'a> Positions<'a> {
    pub(super) fn of(chronicle: &'a KeyframeGraph) -> Self {
        Self {
            chronicle,
            known: RefCell::default(),
        }
    }

    /// Where an agent was at a sample; `None` where that is forgotten, or not in the map.
    pub(super) fn at(&self, agent: u32, session: u32, seq: u64) -> Option<Point3<f64>> {
        let key = (agent, session, seq);
        if let Some(known) = self.known.borrow().get(&key) {
            return *known;
        }
        let pose = self.chronicle.pose_at(agent, session, seq);
        let found = pose.map(|pose| pose.translation.vector.into());
        self.known.borrow_mut().insert(key, found);
        found
    }
}
