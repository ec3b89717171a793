//! The attachments of the keyframe graph, each in the list of its keyframe.

use geometry::is_somewhere;
use nalgebra::Isometry3;
use state::{NONE, Slab};

use super::attachment::Attachment;
use super::chains::Chains;
use super::keyframe::{Keyframe, KeyframeSlab};
use super::list::unlink;
use super::tuning;

/// The attachments, and how far they have been checked.
#[derive(Clone, Debug, Default)]
pub(super) struct Attachments {
    pub(super) slab: Slab<Attachment, 32>,
    /// The latest one that was checked.
    pub(super) cursor: u32,
    /// How many are to be checked, since keyframes were moved.
    pub(super) n_unchecked: u32,
}

impl Attachments {
    /// Attaches a place to a keyframe; answers the number of the attachment. `None` if memory is
    /// full.
    pub(super) fn attach(
        &mut self,
        place: u32,
        offset: &Isometry3<f64>,
        (number, keyframe): (u32, &mut Keyframe),
        revision: u64,
    ) -> Option<u32> {
        let attachment = Attachment {
            keyframe: number,
            next: keyframe.attachments,
            place,
            offset: offset.cast(),
        };
        let attached = self.slab.insert(attachment, revision);
        if attached == NONE {
            return None;
        }
        keyframe.attachments = attached;
        Some(attached)
    }

    /// Removes an attachment.
    pub(super) fn detach(&mut self, number: u32, keyframes: &mut KeyframeSlab, revision: u64) {
        let Some(gone) = self.slab.remove(number, revision) else {
            return;
        };
        let Some(keyframe) = keyframes.get_mut(gone.keyframe, revision) else {
            return;
        };
        let (slab, head) = (&mut self.slab, &mut keyframe.attachments);
        let next = |attachment: &Attachment| attachment.next;
        let set_next = |attachment: &mut Attachment, number| attachment.next = number;
        unlink(slab, head, number, gone.next, revision, next, set_next);
    }

    /// Marks all attachments to be checked, since keyframes were moved.
    pub(super) fn check_all(&mut self) {
        self.n_unchecked = self.slab.numbers();
    }

    /// The poses of the next few attached places, by number, as long as some are to be checked.
    pub(super) fn next_moved(&mut self, chains: &Chains) -> Vec<(u32, Isometry3<f64>)> {
        let mut moved = Vec::new();
        for _ in 0..tuning::ATTACHMENTS_PER_RECORD.min(self.n_unchecked) {
            self.n_unchecked -= 1;
            self.cursor = if self.cursor + 1 < self.slab.numbers() {
                self.cursor + 1
            } else {
                0
            };
            let Some(attachment) = self.slab.get(self.cursor) else {
                continue;
            };
            let at = chains.in_map(attachment.keyframe);
            let at = at.map(|at| at * attachment.offset.cast());
            if let Some(at) = at.filter(|at| is_somewhere(&at.translation.vector)) {
                moved.push((attachment.place, at));
            }
        }
        moved
    }

    /// Moves all attachments of a keyframe to another one. The places stay where they are.
    pub(super) fn move_all(&mut self, was: u32, to: u32, chains: &mut Chains, revision: u64) {
        let (Some(from), Some(offset)) = (chains.in_map(was), chains.in_map(to)) else {
            return;
        };
        let first = |number: u32| Some(chains.keyframes.get(number)?.attachments);
        let (Some(first), Some(others)) = (first(was), first(to)) else {
            return;
        };
        let way = offset.inv_mul(&from);
        let (mut at, mut last) = (first, NONE);
        while let Some(attachment) = self.slab.get_mut(at, revision) {
            attachment.keyframe = to;
            let mut offset = way * attachment.offset.cast();
            offset.rotation.renormalize();
            attachment.offset = offset.cast();
            (last, at) = (at, attachment.next);
        }
        let Some(attachment) = self.slab.get_mut(last, revision) else {
            return; // nothing was
        };
        attachment.next = others;
        for (number, attachments) in [(was, NONE), (to, first)] {
            if let Some(keyframe) = chains.keyframes.get_mut(number, revision) {
                keyframe.attachments = attachments;
            }
        }
    }

    /// Whether all numbers lead somewhere, and each attachment is in the list of its keyframe.
    pub(super) fn is_sound(&self, keyframes: &KeyframeSlab) -> bool {
        if !self.slab.is_sound() {
            return false;
        }
        let mut attached = 0;
        for (number, keyframe) in keyframes.iter() {
            let mut at = keyframe.attachments;
            while at != NONE {
                let attachment = self.slab.get(at);
                let Some(attachment) =
                    attachment.filter(|attachment| attachment.keyframe == number)
                else {
                    return false;
                };
                attached += 1;
                if attached > self.slab.len() {
                    return false;
                }
                at = attachment.next;
            }
        }
        let numbers = self.slab.numbers();
        attached == self.slab.len() && self.cursor <= numbers && self.n_unchecked <= numbers
    }
}
