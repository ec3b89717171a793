//! Attachments: places that keep their pose relative to a keyframe when a relaxation moves it.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector4};

use super::graph::KeyframeGraph;
use geometry::is_somewhere;
use state::{CorruptState, NONE, Slab, State, StateReader, StateWriter};

/// Most attachments that are checked with one record. The work after a relaxation is spread, so
/// that no record pays for all of it.
const LOOKED_AT: u32 = 16;

/// A place with its pose relative to a keyframe.
#[derive(Clone, Debug)]
pub(super) struct Attachment {
    pub(super) keyframe: u32,
    /// The next attachment of the same keyframe.
    pub(super) next: u32,
    /// Number of the place.
    pub(super) place: u32,
    /// Its pose relative to the keyframe: for a few metres single precision suffices.
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
