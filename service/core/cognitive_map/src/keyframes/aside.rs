//! Detached agents: what they did in the map no longer counts.

use nalgebra::Isometry3;

use super::graph::KeyframeGraph;

impl KeyframeGraph {
    /// Detaches an agent: it begins anew in a frame of its own, and what it did in the map no
    /// longer counts there.
    pub fn set_aside(&mut self, agent: u32) {
        let revision = self.revision;
        let Some(track) = self.tracks.get_mut(agent as usize, revision) else {
            return;
        };
        track.is_in_map = false;
        track.own_frame = None;
        track.is_origin = false;
        track.begins_anew = true;
        track.pose = Isometry3::identity();
        let needs_keyframe = track.needs_keyframe;
        self.pending
            .retain(|pending| pending.observer != agent && pending.target != agent);
        if !needs_keyframe {
            self.add_keyframe(agent);
        }
    }
}
