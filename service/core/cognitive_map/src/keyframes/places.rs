//! Places that move with the keyframes of the graph.

use nalgebra::Isometry3;

use super::graph::KeyframeGraph;

impl KeyframeGraph {
    /// Attaches a place at the pose of an agent of the map; answers the number of the attachment.
    /// [`moved_places`](Self::moved_places) then tells when it moves. `None` if the agent has no
    /// keyframe yet, or memory is full.
    pub fn attach_place(&mut self, agent: u32, place: u32) -> Option<u32> {
        let track = self.chains.track(agent)?;
        let (number, since) = (track.newest, *track.since.motion());
        if track.needs_keyframe || track.begins_anew || !track.is_in_map() {
            return None;
        }
        let (revision, at) = (self.revision, track.pose * since.inverse());
        let keyframe = self.chains.keyframes.get_mut(number, revision)?;
        // The estimator has corrected the pose since.
        (keyframe.pose, keyframe.is_in_map) = (at, true);
        self.attachments
            .attach(place, &since, (number, keyframe), revision)
    }

    /// Removes an attachment.
    pub fn detach_place(&mut self, number: u32) {
        let keyframes = &mut self.chains.keyframes;
        self.attachments.detach(number, keyframes, self.revision);
    }

    /// The poses of the next few attached places, by number, as long as some are to be checked
    /// since keyframes were moved.
    pub fn moved_places(&mut self) -> Vec<(u32, Isometry3<f64>)> {
        self.attachments.next_moved(&self.chains)
    }

    /// Number of attachments.
    pub(crate) fn n_attachments(&self) -> usize {
        self.attachments.slab.len()
    }

    /// Whether an attachment is that of a place.
    pub(crate) fn is_attached(&self, number: u32, place: u32) -> bool {
        let attachment = self.attachments.slab.get(number);
        attachment.is_some_and(|attachment| attachment.place == place)
    }
}
