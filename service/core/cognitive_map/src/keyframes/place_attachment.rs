//! Places that move with the keyframes of the graph.

use geometry::is_somewhere;
use nalgebra::Isometry3;
use state::NONE;

use super::attachment::Attachment;
use super::graph::KeyframeGraph;
use super::list::unlink;
use super::tuning;

impl KeyframeGraph {
    /// Attaches a place at the pose of an agent of the map; answers the number of the attachment.
    /// [`moved_places`](Self::moved_places) then tells when it moves. `None` if the agent has no
    /// keyframe yet, or memory is full.
    pub fn attach_place(&mut self, agent: u32, place: u32) -> Option<u32> {
        let track = self.tracks.get(agent as usize)?;
        let (number, since) = (track.newest, *track.since.motion());
        if track.needs_keyframe || track.begins_anew || !track.is_in_map {
            return None;
        }
        let (revision, at) = (self.revision, track.pose * since.inverse());
        let keyframe = self.keyframes.get_mut(number, revision)?;
        // The estimator has corrected the pose since.
        (keyframe.pose, keyframe.is_in_map) = (at, true);
        let attachment = Attachment {
            keyframe: number,
            next: keyframe.attachments,
            place,
            offset: since.cast(),
        };
        let attached = self.attachments.slab.insert(attachment, revision);
        if attached == NONE {
            return None;
        }
        keyframe.attachments = attached;
        Some(attached)
    }

    /// Removes an attachment.
    pub fn detach_place(&mut self, number: u32) {
        let revision = self.revision;
        let Some(gone) = self.attachments.slab.remove(number, revision) else {
            return;
        };
        let Some(keyframe) = self.keyframes.get_mut(gone.keyframe, revision) else {
            return;
        };
        let (slab, head) = (&mut self.attachments.slab, &mut keyframe.attachments);
        let next = |attachment: &Attachment| attachment.next;
        let set_next = |attachment: &mut Attachment, number| attachment.next = number;
        unlink(slab, head, number, gone.next, revision, next, set_next);
    }

    /// Marks all attachments to be checked, since keyframes were moved.
    pub(super) fn check_attachments(&mut self) {
        self.attachments.n_unchecked = self.attachments.slab.numbers();
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

    /// The poses of the next few attached places, by number, as long as some are to be checked
    /// since keyframes were moved.
    pub fn moved_places(&mut self) -> Vec<(u32, Isometry3<f64>)> {
        let mut moved = Vec::new();
        for _ in 0..tuning::ATTACHMENTS_PER_RECORD.min(self.attachments.n_unchecked) {
            self.attachments.n_unchecked -= 1;
            self.attachments.cursor =
                if self.attachments.cursor + 1 < self.attachments.slab.numbers() {
                    self.attachments.cursor + 1
                } else {
                    0
                };
            let Some(attachment) = self.attachments.slab.get(self.attachments.cursor) else {
                continue;
            };
            let at = self.in_map(attachment.keyframe);
            let at = at.map(|at| at * attachment.offset.cast());
            if let Some(at) = at.filter(|at| is_somewhere(&at.translation.vector)) {
                moved.push((attachment.place, at));
            }
        }
        moved
    }

    /// Moves all attachments of a keyframe to another one. The places stay where they are.
    pub(super) fn move_attachments(&mut self, was: u32, to: u32) {
        let revision = self.revision;
        let (Some(keyframe), Some(other)) = (self.keyframes.get(was), self.keyframes.get(to))
        else {
            return;
        };
        let (first, others) = (keyframe.attachments, other.attachments);
        let (Some(from), Some(offset)) = (self.in_map(was), self.in_map(to)) else {
            return;
        };
        let way = offset.inv_mul(&from);
        let (mut at, mut last) = (first, NONE);
        while let Some(attachment) = self.attachments.slab.get_mut(at, revision) {
            attachment.keyframe = to;
            let mut offset = way * attachment.offset.cast();
            offset.rotation.renormalize();
            attachment.offset = offset.cast();
            (last, at) = (at, attachment.next);
        }
        let Some(attachment) = self.attachments.slab.get_mut(last, revision) else {
            return; // nothing was
        };
        attachment.next = others;
        for (number, attachments) in [(was, NONE), (to, first)] {
            if let Some(keyframe) = self.keyframes.get_mut(number, revision) {
                keyframe.attachments = attachments;
            }
        }
    }

    /// Whether each attachment is in the list of its keyframe, and nothing else is.
    pub(super) fn attachments_are_sound(&self) -> bool {
        let mut attached = 0;
        for (number, keyframe) in self.keyframes.iter() {
            let mut at = keyframe.attachments;
            while at != NONE {
                let attachment = self.attachments.slab.get(at);
                let Some(attachment) =
                    attachment.filter(|attachment| attachment.keyframe == number)
                else {
                    return false;
                };
                attached += 1;
                if attached > self.attachments.slab.len() {
                    return false;
                }
                at = attachment.next;
            }
        }
        let numbers = self.attachments.slab.numbers();
        attached == self.attachments.slab.len()
            && self.attachments.cursor <= numbers
            && self.attachments.n_unchecked <= numbers
    }
}
