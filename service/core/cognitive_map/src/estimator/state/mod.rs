//! The bytes of the estimate. What is read back goes on to the last bit as what was written.
//!
//! The parameters are constant and not written. Neither is what the latest call settled and merged: it
//! does not influence the future.

mod lists;

use std::sync::Arc;

use lists::{read_all, read_count, read_map, write_all, write_count, write_map, write_pairs};

use super::alias::{ALIASES_MAX, Alias, Aliases};
use super::covariance::JointCovariance;
use super::dormant::{Dormant, DormantMarks, PART_MAX, PARTS};
use super::frame::{Frame, MARK_DIM, MARKS_MAX, MEMBERS_MAX, Mark, Member};
use super::history::{History, KEPT};
use super::joint::Estimator;
use super::meeting::{MEETINGS_MAX, Meeting, PENDING_MAX, Pending};
use super::mover::{BODY_DIM, Mover, Run};
use super::observers::{OBSERVERS_MAX, Observers};
use super::outcome::Evidence;
use super::parameters::Parameters;
use super::resemblance::{RESEMBLANCES_MAX, Resemblance};
use super::seat::{Apart, Seat, Traveller};
use super::sensor::{Seen, Sensor, TARGETS_MAX};
use ::state::PagedVec;
use ::state::{CorruptState, State, StateReader, StateWriter, state_of_struct};

/// Most components of a joint covariance.
const DIM_MAX: usize = MEMBERS_MAX * BODY_DIM + MARKS_MAX * MARK_DIM;
/// Most agents of a space, against counts that no bytes can follow.
const AGENTS_MAX: usize = 1 << 24;

state_of_struct!(Evidence {
    accepted,
    refused,
    refused_in_a_row,
    nis,
    components
});
state_of_struct!(Run {
    motion,
    tail,
    wander,
    steps
});
state_of_struct!(Mover {
    pose,
    calibration,
    settled,
    tail,
    since_flush,
    is_stale,
    run,
    history,
    is_planar
});
state_of_struct!(Traveller {
    mover,
    sensor,
    refused,
    doubt
});
state_of_struct!(Dormant {
    position,
    covariance,
    left,
    only
});

impl State for History {
    fn write(&self, out: &mut StateWriter) {
        write_all(self.instants.len(), &self.instants, out);
        self.latest.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let instants = read_all(input, KEPT)?.into();
        let latest = State::read(input)?;
        Ok(Self { instants, latest })
    }
}

impl State for Seen {
    fn write(&self, out: &mut StateWriter) {
        match self {
            Self::Mark(number) => (0u8, *number).write(out),
            Self::Agent(number) => (1u8, u64::from(*number)).write(out),
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        match State::read(input)? {
            (0u8, number) => Ok(Self::Mark(number)),
            (1u8, number) => u32::try_from(number)
                .map(Self::Agent)
                .map_err(|_| CorruptState::Invalid),
            _ => Err(CorruptState::Invalid),
        }
    }
}

impl State for Sensor {
    fn write(&self, out: &mut StateWriter) {
        self.scales.write(out);
        self.counts.write(out);
        self.product.write(out);
        self.square.write(out);
        write_map(&self.latest, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            scales: State::read(input)?,
            counts: State::read(input)?,
            product: State::read(input)?,
            square: State::read(input)?,
            latest: read_map(input, TARGETS_MAX)?,
        })
    }
}

impl State for Apart {
    fn write(&self, out: &mut StateWriter) {
        self.was_joint.write(out);
        self.traveller.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            was_joint: State::read(input)?,
            traveller: Arc::new(State::read(input)?),
        })
    }
}

impl State for Seat {
    fn write(&self, out: &mut StateWriter) {
        write_count(self.frame, out);
        self.in_odom.write(out);
        self.stamp_ns.write(out);
        self.evidence.write(out);
        self.is_aside.write(out);
        self.apart.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            frame: read_count(input, AGENTS_MAX)?,
            in_odom: State::read(input)?,
            stamp_ns: State::read(input)?,
            evidence: State::read(input)?,
            is_aside: State::read(input)?,
            apart: State::read(input)?,
        })
    }
}

impl State for Member {
    fn write(&self, out: &mut StateWriter) {
        self.agent.write(out);
        write_count(self.offset, out);
        self.used.write(out);
        self.traveller.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            agent: State::read(input)?,
            offset: read_count(input, DIM_MAX)?,
            used: State::read(input)?,
            traveller: Arc::new(State::read(input)?),
        })
    }
}

impl State for Observers {
    fn write(&self, out: &mut StateWriter) {
        write_all(self.agents.len(), &self.agents, out);
        self.are_more.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let observers = Self {
            agents: read_all(input, OBSERVERS_MAX)?,
            are_more: State::read(input)?,
        };
        let are_sorted = observers.agents.is_sorted_by(|one, next| one < next);
        are_sorted.then_some(observers).ok_or(CorruptState::Invalid)
    }
}

impl State for Mark {
    fn write(&self, out: &mut StateWriter) {
        self.number.write(out);
        self.position.write(out);
        write_count(self.offset, out);
        self.used.write(out);
        self.refused.write(out);
        self.observers.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            number: State::read(input)?,
            position: State::read(input)?,
            offset: read_count(input, DIM_MAX)?,
            used: State::read(input)?,
            refused: State::read(input)?,
            observers: State::read(input)?,
        })
    }
}

impl State for DormantMarks {
    fn write(&self, out: &mut StateWriter) {
        write_pairs(self.len(), self.iter(), out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let mut marks = Self::default();
        for _ in 0..read_count(input, PARTS * PART_MAX)? {
            let (label, mark) = State::read(input)?;
            // In their own order, none twice, and none that drives out another.
            if !marks.append(label, mark) {
                return Err(CorruptState::Invalid);
            }
        }
        Ok(marks)
    }
}

impl State for JointCovariance {
    /// One half of it, unless rounding made the halves differ.
    fn write(&self, out: &mut StateWriter) {
        let (dim, entries) = (self.dim(), self.entries());
        let mirror = |at: usize| entries[at % dim * dim + at / dim];
        let is_symmetric =
            (0..entries.len()).all(|at| entries[at].to_bits() == mirror(at).to_bits());
        write_count(dim, out);
        is_symmetric.write(out);
        for row in 0..dim {
            let first = if is_symmetric { row } else { 0 };
            for entry in &entries[row * dim + first..(row + 1) * dim] {
                entry.write(out);
            }
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let dim = read_count(input, DIM_MAX)?;
        let is_symmetric = bool::read(input)?;
        let mut entries = vec![0.0; dim * dim];
        for row in 0..dim {
            let first = if is_symmetric { row } else { 0 };
            for column in first..dim {
                let entry = f64::read(input)?;
                entries[row * dim + column] = entry;
                if is_symmetric {
                    entries[column * dim + row] = entry;
                }
            }
        }
        Self::from_entries(dim, entries).ok_or(CorruptState::Invalid)
    }
}

impl State for Frame {
    fn write(&self, out: &mut StateWriter) {
        self.population.write(out);
        write_all(self.members.len(), &self.members, out);
        write_map(&self.marks, out);
        self.dormant.write(out);
        self.covariance.write(out);
        self.numbered.write(out);
        self.sightings.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let frame = Self {
            population: State::read(input)?,
            members: read_all(input, MEMBERS_MAX)?,
            marks: Arc::new(read_map(input, MARKS_MAX)?),
            dormant: State::read(input)?,
            covariance: State::read(input)?,
            numbered: State::read(input)?,
            sightings: State::read(input)?,
        };
        // Everybody has components of his own, and there are no others.
        let bodies = frame.members.iter().map(|member| (member.offset, BODY_DIM));
        let marks = frame.marks.values().map(|mark| (mark.offset, MARK_DIM));
        let mut parts: Vec<(usize, usize)> = bodies.chain(marks).collect();
        parts.sort_unstable();
        let end = parts.iter().try_fold(0, |end, &(offset, width)| {
            (offset == end).then_some(end + width)
        });
        if end == Some(frame.covariance.dim()) {
            Ok(frame)
        } else {
            Err(CorruptState::Invalid)
        }
    }
}

state_of_struct!(Pending {
    observer,
    target,
    stamp_ns,
    relation
});

impl State for Meeting {
    fn write(&self, out: &mut StateWriter) {
        let [from, to] = self.frames;
        write_count(from, out);
        write_count(to, out);
        let [a, b] = self.points;
        (a, b).write(out);
        self.variance.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let frames = [
            read_count(input, AGENTS_MAX)?,
            read_count(input, AGENTS_MAX)?,
        ];
        let (a, b) = State::read(input)?;
        Ok(Self {
            frames,
            points: [a, b],
            variance: State::read(input)?,
        })
    }
}

impl State for Resemblance {
    fn write(&self, out: &mut StateWriter) {
        let [older, newer] = self.frames;
        write_count(older, out);
        write_count(newer, out);
        self.pose.write(out);
        self.looks.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let frames = [
            read_count(input, AGENTS_MAX)?,
            read_count(input, AGENTS_MAX)?,
        ];
        Ok(Self {
            frames,
            pose: State::read(input)?,
            looks: State::read(input)?,
        })
    }
}

state_of_struct!(Alias { name, refused });

impl State for Estimator {
    fn write(&self, out: &mut StateWriter) {
        write_all(self.seats.len(), self.seats.iter(), out);
        write_all(self.frames.len(), self.frames.iter(), out);
        write_all(self.pending.len(), &self.pending, out);
        write_all(self.meetings.len(), &self.meetings, out);
        write_count(self.turn, out);
        write_all(self.resemblances.len(), &self.resemblances, out);
        write_map(&self.aliases.names, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let mut seats = PagedVec::default();
        for _ in 0..read_count(input, AGENTS_MAX)? {
            seats.push(Seat::read(input)?, 0);
        }
        let mut frames = PagedVec::default();
        for _ in 0..read_count(input, AGENTS_MAX + 1)? {
            frames.push(Frame::read(input)?, 0);
        }
        let estimator = Self {
            parameters: Parameters::default(),
            frames,
            seats,
            pending: read_all(input, PENDING_MAX)?,
            meetings: read_all(input, MEETINGS_MAX)?,
            turn: read_count(input, AGENTS_MAX)?,
            resemblances: read_all(input, RESEMBLANCES_MAX)?,
            aliases: Aliases {
                names: Arc::new(read_map(input, ALIASES_MAX)?),
            },
            settled: Vec::new(),
            merged: Vec::new(),
            same: Vec::new(),
            set_aside: Vec::new(),
        };
        if estimator.is_sound() {
            Ok(estimator)
        } else {
            Err(CorruptState::Invalid)
        }
    }
}

impl Estimator {
    /// Whether seats, frames and what waits belong together.
    fn is_sound(&self) -> bool {
        let (seats, frames) = (self.seats.len(), self.frames.len());
        let is_seat = |agent: u32| (agent as usize) < seats;
        // How many agents each frame has, and how many of them take part.
        let mut agents = vec![(0u32, 0usize); frames];
        for (seat, agent) in self.seats.iter().zip(0..) {
            let Some(count) = agents.get_mut(seat.frame) else {
                return false;
            };
            count.0 += 1;
            if seat.apart.is_none() {
                count.1 += 1;
                if self.frame(seat.frame).member(agent).is_none() {
                    return false;
                }
            }
        }
        let is_whole = |(frame, &(population, members)): (&Frame, &(u32, usize))| {
            frame.population == population && frame.members.len() == members
        };
        let mut pending = self.pending.iter();
        let mut meetings = self.meetings.iter();
        let mut resemblances = self.resemblances.iter();
        let names = &self.aliases.names;
        frames == seats + 1
            && self.frames.iter().zip(&agents).all(is_whole)
            && pending.all(|one| {
                is_seat(one.observer) && is_seat(one.target) && one.observer != one.target
            })
            && meetings.all(|one| one.frames.iter().all(|&frame| frame < frames))
            && resemblances.all(|one| one.frames[0] < one.frames[1] && one.frames[1] < frames)
            && names.values().all(|alias| !names.contains_key(&alias.name))
    }
}

#[cfg(test)]
mod tests;
