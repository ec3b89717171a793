//! The constraints of the keyframe graph, each in the lists of its two keyframes.

use state::{CorruptState, NONE, Slab, State, StateReader, StateWriter};

use super::constraint::Constraint;
use super::keyframe::{Keyframe, KeyframeSlab};
use super::list::unlink;

/// The constraints, and when the closures among them are judged next.
#[derive(Clone, Debug, Default)]
pub(super) struct Constraints {
    pub(super) slab: Slab<Constraint, 32>,
    pub(super) schedule: Schedule,
}

/// What has come in since the last relaxation.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Schedule {
    /// Motions.
    pub(super) records: u32,
    /// Loop closures that were kept.
    pub(super) new_closures: u32,
    /// Those of them that were accepted at once.
    pub(super) accepted: u32,
    /// Landmarks of which distances alone are known that were found.
    pub(super) found: u32,
    /// Distances of targets whose place is known.
    pub(super) ranges: u32,
    /// Sightings of where targets are.
    pub(super) points: u32,
    /// Keyframes that were made, without those of agents that were forgotten.
    pub(super) keyframes: u32,
}

/// Bit of the number of accepted closures that says that more follows: an empty graph has the bytes
/// that it had before what is seen relaxed the past.
const FOLLOWS: u32 = 1 << 31;

impl State for Schedule {
    fn write(&self, out: &mut StateWriter) {
        let seen = [self.found, self.ranges, self.points, self.keyframes];
        let follows = seen != [0; 4];
        let flag = if follows { FOLLOWS } else { 0 };
        self.records.write(out);
        self.new_closures.write(out);
        (self.accepted.min(FOLLOWS - 1) | flag).write(out);
        if follows {
            seen.write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let (records, new_closures) = (u32::read(input)?, u32::read(input)?);
        let accepted = u32::read(input)?;
        let mut seen = [0; 4];
        if accepted & FOLLOWS != 0 {
            seen = State::read(input)?;
            if seen == [0; 4] {
                return Err(CorruptState::Invalid);
            }
        }
        let [found, ranges, points, keyframes] = seen;
        Ok(Self {
            records,
            new_closures,
            accepted: accepted & !FOLLOWS,
            found,
            ranges,
            points,
            keyframes,
        })
    }
}

impl Constraints {
    /// The constraints that end at a keyframe.
    pub(super) fn of(&self, number: u32, keyframe: &Keyframe) -> impl Iterator<Item = &Constraint> {
        let first = self.slab.get(keyframe.constraints);
        std::iter::successors(first, move |constraint| {
            self.slab.get(constraint.next_of(number))
        })
    }

    /// The first candidate by number; [`NONE`] without any.
    pub(super) fn first_candidate(&self) -> u32 {
        let mut all = self.slab.iter();
        let first = all.find(|(_, constraint)| constraint.is_candidate());
        first.map_or(NONE, |(number, _)| number)
    }

    /// Number of loop closures that count.
    pub(super) fn n_accepted(&self) -> usize {
        let all = self.slab.iter();
        all.filter(|(_, constraint)| constraint.is_accepted())
            .count()
    }

    /// Adds a constraint, of at most `most`; answers its number, or [`NONE`] if memory is full or
    /// an end is gone.
    pub(super) fn add(
        &mut self,
        mut constraint: Constraint,
        keyframes: &mut KeyframeSlab,
        most: u32,
        revision: u64,
    ) -> u32 {
        let (from, to) = (constraint.from, constraint.to);
        let first = |end: u32| keyframes.get(end).map(|keyframe| keyframe.constraints);
        let Some(next_to) = first(to) else {
            return NONE;
        };
        if self.slab.len() >= most as usize || (from != NONE && first(from).is_none()) || from == to
        {
            return NONE;
        }
        constraint.next_to = next_to;
        constraint.next_from = first(from).unwrap_or(NONE);
        let number = self.slab.insert(constraint, revision);
        for end in [from, to] {
            if let Some(keyframe) = keyframes.get_mut(end, revision) {
                keyframe.constraints = number;
            }
        }
        number
    }

    /// Removes a constraint; answers it.
    pub(super) fn remove(
        &mut self,
        number: u32,
        keyframes: &mut KeyframeSlab,
        revision: u64,
    ) -> Option<Constraint> {
        let constraint = self.slab.get(number)?.clone();
        for (end, next) in [
            (constraint.from, constraint.next_from),
            (constraint.to, constraint.next_to),
        ] {
            let Some(keyframe) = keyframes.get_mut(end, revision) else {
                continue;
            };
            let set_next = |other: &mut Constraint, number| {
                if other.from == end {
                    other.next_from = number;
                } else {
                    other.next_to = number;
                }
            };
            let (head, next_of) = (&mut keyframe.constraints, |other: &Constraint| {
                other.next_of(end)
            });
            unlink(
                &mut self.slab,
                head,
                number,
                next,
                revision,
                next_of,
                set_next,
            );
        }
        self.slab.remove(number, revision)
    }

    /// Adopts the states that the same constraints have in a copy.
    pub(super) fn adopt(&mut self, copy: &Self, revision: u64) {
        let changed = |(number, constraint): (u32, &Constraint)| {
            let state = copy.slab.get(number)?.state;
            (state != constraint.state).then_some((number, state))
        };
        let changed: Vec<_> = self.slab.iter().filter_map(changed).collect();
        for (number, state) in changed {
            if let Some(constraint) = self.slab.get_mut(number, revision) {
                constraint.state = state;
            }
        }
    }

    /// Whether all numbers lead somewhere, and each constraint is in the lists of its keyframes.
    pub(super) fn is_sound(&self, keyframes: &KeyframeSlab) -> bool {
        if !self.slab.is_sound() {
            return false;
        }
        let mut ends = 0;
        for (number, keyframe) in keyframes.iter() {
            let mut at = keyframe.constraints;
            while at != NONE {
                let Some(constraint) = self.slab.get(at) else {
                    return false;
                };
                ends += 1;
                if (constraint.from != number && constraint.to != number)
                    || ends > 2 * self.slab.len()
                {
                    return false;
                }
                at = constraint.next_of(number);
            }
        }
        let n_ends = |constraint: &Constraint| if constraint.from == NONE { 1 } else { 2 };
        let expected: usize = { self.slab.iter() }
            .map(|(_, constraint)| n_ends(constraint))
            .sum();
        ends == expected
    }
}
