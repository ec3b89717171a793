//! Agents that are set aside: their past counts no longer.

use nalgebra::Isometry3;

use super::graph::KeyframeGraph;

impl KeyframeGraph {
    /// An agent was set aside: it begins anew in a frame of its own, and what it did and saw in the
    /// map no longer counts there.
    pub fn set_aside(&mut self, agent: u32) {
        let revision = self.revision;
        let Some(life) = self.lives.get_mut(agent as usize, revision) else {
            return;
        };
        life.is_in_map = false;
        life.own_frame = None;
        life.founds = false;
        life.is_cut = true;
        life.pose = Isometry3::identity();
        let is_fresh = life.is_fresh;
        self.waiting
            .retain(|waiting| waiting.observer != agent && waiting.target != agent);
        if !is_fresh {
            self.anchor_anew(agent);
        }
    }
}
