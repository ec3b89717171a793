//! What lies where an agent was: when the past turns out to lie elsewhere, it goes with it.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector4};

use super::graph::KeyframeGraph;
use geometry::is_somewhere;
use state::NONE;
use state::{CorruptState, State, StateReader, StateWriter};

/// Moorings that are looked at after a motion while something is to be moved: what a relaxation has to move is
/// so much at most that no single record pays for all of it.
const LOOKED_AT: u32 = 16;

/// A place that lies beside an anchor.
#[derive(Clone, Debug)]
pub(super) struct Mooring {
    pub(super) anchor: u32,
    /// The next one of the same anchor.
    pub(super) next: u32,
    /// Whose it is, by a number of who moored it.
    pub(super) place: u32,
    /// Its pose as seen from the anchor: a few metres, for which these floats do.
    offset: Isometry3<f32>,
}

impl KeyframeGraph {
    /// Moors a place where an agent of the map is now, so that [`drift`](Self::drift) tells when it lies elsewhere; answers
    /// the number of the mooring. `None` if nothing is remembered of the agent, or as much as there may be.
    pub fn moor(&mut self, agent: u32, place: u32) -> Option<u32> {
        let life = self.lives.get(agent as usize)?;
        let (number, since) = (life.newest, *life.since.motion());
        if life.is_fresh || life.is_cut || !life.is_in_map {
            return None;
        }
        let (revision, at) = (self.revision, life.pose * since.inverse());
        let anchor = self.anchors.get_mut(number, revision)?;
        // What has been seen since then has corrected the pose.
        (anchor.pose, anchor.is_in_map) = (at, true);
        let mooring = Mooring {
            anchor: number,
            next: anchor.moorings,
            place,
            offset: since.cast(),
        };
        let moored = self.moorings.insert(mooring, revision);
        if moored == NONE {
            return None;
        }
        anchor.moorings = moored;
        Some(moored)
    }

    /// Forgets a mooring.
    pub fn unmoor(&mut self, number: u32) {
        let revision = self.revision;
        let Some(gone) = self.moorings.remove(number, revision) else {
            return;
        };
        let Some(anchor) = self.anchors.get_mut(gone.anchor, revision) else {
            return;
        };
        if anchor.moorings == number {
            anchor.moorings = gone.next;
            return;
        }
        let mut at = anchor.moorings;
        while let Some(next) = self.moorings.get(at).map(|mooring| mooring.next) {
            if next == number {
                if let Some(before) = self.moorings.get_mut(at, revision) {
                    before.next = gone.next;
                }
                return;
            }
            at = next;
        }
    }

    /// Anchors have been moved, and all that is moored has to be looked at.
    pub(super) fn cast_off(&mut self) {
        self.adrift = self.moorings.numbers();
    }

    /// Number of moorings.
    pub(crate) fn n_moorings(&self) -> usize {
        self.moorings.len()
    }

    /// Whether a mooring is that of a place.
    pub(crate) fn is_moored(&self, number: u32, place: u32) -> bool {
        let mooring = self.moorings.get(number);
        mooring.is_some_and(|mooring| mooring.place == place)
    }

    /// Where some of what is moored lies by now, with its numbers: each call tells of the next few, until all have been
    /// told of since anchors were moved.
    pub fn drift(&mut self) -> Vec<(u32, Isometry3<f64>)> {
        let mut moved = Vec::new();
        for _ in 0..LOOKED_AT.min(self.adrift) {
            self.adrift -= 1;
            self.swung = if self.swung + 1 < self.moorings.numbers() {
                self.swung + 1
            } else {
                0
            };
            let Some(mooring) = self.moorings.get(self.swung) else {
                continue;
            };
            let at = self.in_map(mooring.anchor);
            let at = at.map(|at| at * mooring.offset.cast());
            if let Some(at) = at.filter(|at| is_somewhere(&at.translation.vector)) {
                moved.push((mooring.place, at));
            }
        }
        moved
    }

    /// Moors beside another anchor what was moored beside one, all where it was.
    pub(super) fn moor_beside(&mut self, was: u32, to: u32) {
        let revision = self.revision;
        let (Some(anchor), Some(other)) = (self.anchors.get(was), self.anchors.get(to)) else {
            return;
        };
        let (first, others) = (anchor.moorings, other.moorings);
        let (Some(from), Some(beside)) = (self.in_map(was), self.in_map(to)) else {
            return;
        };
        let way = beside.inv_mul(&from);
        let (mut at, mut last) = (first, NONE);
        while let Some(mooring) = self.moorings.get_mut(at, revision) {
            mooring.anchor = to;
            let mut offset = way * mooring.offset.cast();
            offset.rotation.renormalize();
            mooring.offset = offset.cast();
            (last, at) = (at, mooring.next);
        }
        let Some(mooring) = self.moorings.get_mut(last, revision) else {
            return; // nothing was
        };
        mooring.next = others;
        for (number, moorings) in [(was, NONE), (to, first)] {
            if let Some(anchor) = self.anchors.get_mut(number, revision) {
                anchor.moorings = moorings;
            }
        }
    }

    /// Whether each mooring is in the list of its anchor, and nothing else is.
    pub(super) fn moorings_are_sound(&self) -> bool {
        let mut moored = 0;
        for (number, anchor) in self.anchors.iter() {
            let mut at = anchor.moorings;
            while at != NONE {
                let mooring = self.moorings.get(at);
                let Some(mooring) = mooring.filter(|mooring| mooring.anchor == number) else {
                    return false;
                };
                moored += 1;
                if moored > self.moorings.len() {
                    return false;
                }
                at = mooring.next;
            }
        }
        let numbers = self.moorings.numbers();
        moored == self.moorings.len() && self.swung <= numbers && self.adrift <= numbers
    }
}

impl State for Mooring {
    fn write(&self, out: &mut StateWriter) {
        (self.anchor, self.next).write(out);
        self.place.write(out);
        let (shift, turn) = (&self.offset.translation, &self.offset.rotation);
        for number in shift.vector.iter().chain(turn.coords.iter()) {
            number.to_bits().write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let (anchor, next) = State::read(input)?;
        let place = State::read(input)?;
        let mut numbers = [0.0; 7];
        for number in &mut numbers {
            *number = f32::from_bits(State::read(input)?);
        }
        let [x, y, z, turn @ ..] = numbers;
        // Not normalised again: that might change the last bit.
        let turn = UnitQuaternion::new_unchecked(Vector4::from(turn).into());
        Ok(Self {
            anchor,
            next,
            place,
            offset: Isometry3::from_parts(Translation3::new(x, y, z), turn),
        })
    }
}
