//! What lies where an agent was: when the past turns out to lie elsewhere, it goes with it.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector4};

use super::graph::KeyframeGraph;
use geometry::is_somewhere;
use state::{CorruptState, NONE, Slab, State, StateReader, StateWriter};

/// Moorings that are looked at after a motion while something is to be moved: what a relaxation has to move is
/// so much at most that no single record pays for all of it.
const LOOKED_AT: u32 = 16;

/// A place that lies beside a keyframe.
#[derive(Clone, Debug)]
pub(super) struct Attachment {
    pub(super) keyframe: u32,
    /// The next one of the same keyframe.
    pub(super) next: u32,
    /// Whose it is, by a number of who moored it.
    pub(super) place: u32,
    /// Its pose as seen from the keyframe: a few metres, for which these floats do.
    offset: Isometry3<f32>,
}

/// The attachments, and how far they have been checked.
#[derive(Clone, Debug, Default)]
pub(super) struct Attachments {
    pub(super) slab: Slab<Attachment, 32>,
    /// The latest one that was checked.
    pub(super) cursor: u32,
    /// How many are to be checked, since keyframes were moved.
    pub(super) n_unchecked: u32,
}

impl KeyframeGraph {
    /// Moors a place where an agent of the map is now, so that [`drift`](Self::drift) tells when it lies elsewhere; answers
    /// the number of the attachment. `None` if nothing is remembered of the agent, or as much as there may be.
    pub fn attach_place(&mut self, agent: u32, place: u32) -> Option<u32> {
        let track = self.tracks.get(agent as usize)?;
        let (number, since) = (track.newest, *track.since.motion());
        if track.needs_keyframe || track.begins_anew || !track.is_in_map {
            return None;
        }
        let (revision, at) = (self.revision, track.pose * since.inverse());
        let keyframe = self.keyframes.get_mut(number, revision)?;
        // What has been seen since then has corrected the pose.
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

    /// Forgets a attachment.
    pub fn detach_place(&mut self, number: u32) {
        let revision = self.revision;
        let Some(gone) = self.attachments.slab.remove(number, revision) else {
            return;
        };
        let Some(keyframe) = self.keyframes.get_mut(gone.keyframe, revision) else {
            return;
        };
        if keyframe.attachments == number {
            keyframe.attachments = gone.next;
            return;
        }
        let mut at = keyframe.attachments;
        while let Some(next) = self
            .attachments
            .slab
            .get(at)
            .map(|attachment| attachment.next)
        {
            if next == number {
                if let Some(before) = self.attachments.slab.get_mut(at, revision) {
                    before.next = gone.next;
                }
                return;
            }
            at = next;
        }
    }

    /// Keyframes have been moved, and all that is moored has to be looked at.
    pub(super) fn check_attachments(&mut self) {
        self.attachments.n_unchecked = self.attachments.slab.numbers();
    }

    /// Number of attachments.
    pub(crate) fn n_attachments(&self) -> usize {
        self.attachments.slab.len()
    }

    /// Whether a attachment is that of a place.
    pub(crate) fn is_attached(&self, number: u32, place: u32) -> bool {
        let attachment = self.attachments.slab.get(number);
        attachment.is_some_and(|attachment| attachment.place == place)
    }

    /// Where some of what is moored lies by now, with its numbers: each call tells of the next few, until all have been
    /// told of since keyframes were moved.
    pub fn moved_places(&mut self) -> Vec<(u32, Isometry3<f64>)> {
        let mut moved = Vec::new();
        for _ in 0..LOOKED_AT.min(self.attachments.n_unchecked) {
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

    /// Moors beside another keyframe what was moored beside one, all where it was.
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

impl State for Attachment {
    fn write(&self, out: &mut StateWriter) {
        (self.keyframe, self.next).write(out);
        self.place.write(out);
        let (shift, turn) = (&self.offset.translation, &self.offset.rotation);
        for number in shift.vector.iter().chain(turn.coords.iter()) {
            number.to_bits().write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let (keyframe, next) = State::read(input)?;
        let place = State::read(input)?;
        let mut numbers = [0.0; 7];
        for number in &mut numbers {
            *number = f32::from_bits(State::read(input)?);
        }
        let [x, y, z, turn @ ..] = numbers;
        // Not normalised again: that might change the last bit.
        let turn = UnitQuaternion::new_unchecked(Vector4::from(turn).into());
        Ok(Self {
            keyframe,
            next,
            place,
            offset: Isometry3::from_parts(Translation3::new(x, y, z), turn),
        })
    }
}
