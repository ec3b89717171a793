//! The bytes of the estimate. What is read back goes on to the last bit as what was written.
//!
//! The parameters are constant and not written.

mod lists;

use std::sync::Arc;

use nalgebra::Isometry3;

use lists::{read_all, read_count, read_map, write_all, write_count, write_map, write_pairs};

use super::agent_filter::{AgentFilter, BODY_DIM, Run};
use super::agent_slot::{AgentSlot, AgentState, Detached};
use super::associations::{Association, Associations};
use super::covariance::JointCovariance;
use super::frame::{Frame, LANDMARK_DIM, LandmarkState, Member};
use super::frame_match::FrameMatch;
use super::joint::Estimator;
use super::landmark_archive::{ArchivedLandmark, LandmarkArchive};
use super::observers::Observers;
use super::odometry_history::OdometryHistory;
use super::outcome::Evidence;
use super::parameters::Parameters;
use super::sensor::{Sensor, SightingTarget};
use super::sightings::{CrossFrameSighting, PendingSighting};
use super::tuning::{
    ARCHIVE_PART_MAX, ARCHIVE_PARTS, ASSOCIATIONS_MAX, CROSS_SIGHTINGS_MAX, FRAME_MATCHES_MAX,
    HISTORY_LEN, LANDMARKS_MAX, MEMBERS_MAX, OBSERVERS_MAX, PENDING_MAX, SENSOR_TARGETS_MAX,
};
use ::state::PagedVec;
use ::state::{CorruptState, State, StateReader, StateWriter, state_of_struct};

/// Most components of a joint covariance.
const DIM_MAX: usize = MEMBERS_MAX * BODY_DIM + LANDMARKS_MAX * LANDMARK_DIM;
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
state_of_struct!(AgentFilter {
    pose,
    calibration,
    at_run_start,
    tail,
    since_flush,
    is_stale,
    run,
    history,
    is_planar
});
state_of_struct!(AgentState {
    filter,
    sensor,
    refused,
    doubt
});
state_of_struct!(ArchivedLandmark {
    position,
    covariance,
    left,
    only
});

impl State for OdometryHistory {
    fn write(&self, out: &mut StateWriter) {
        write_all(self.instants.len(), &self.instants, out);
        self.latest.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let instants = read_all(input, HISTORY_LEN)?.into();
        let latest = State::read(input)?;
        Ok(Self { instants, latest })
    }
}

impl State for SightingTarget {
    fn write(&self, out: &mut StateWriter) {
        match self {
            Self::Landmark(number) => (0u8, *number).write(out),
            Self::Agent(number) => (1u8, u64::from(*number)).write(out),
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        match State::read(input)? {
            (0u8, number) => Ok(Self::Landmark(number)),
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
            latest: read_map(input, SENSOR_TARGETS_MAX)?,
        })
    }
}

impl State for Detached {
    fn write(&self, out: &mut StateWriter) {
        self.was_joint.write(out);
        self.state.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            was_joint: State::read(input)?,
            state: Arc::new(State::read(input)?),
        })
    }
}

impl State for Member {
    fn write(&self, out: &mut StateWriter) {
        self.agent.write(out);
        write_count(self.offset, out);
        self.used.write(out);
        self.state.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            agent: State::read(input)?,
            offset: read_count(input, DIM_MAX)?,
            used: State::read(input)?,
            state: Arc::new(State::read(input)?),
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

impl State for LandmarkState {
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

impl State for LandmarkArchive {
    fn write(&self, out: &mut StateWriter) {
        write_pairs(self.len(), self.iter(), out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let mut landmarks = Self::default();
        for _ in 0..read_count(input, ARCHIVE_PARTS * ARCHIVE_PART_MAX)? {
            let (label, landmark) = State::read(input)?;
            // In their own order, none twice, and none that drives out another.
            if !landmarks.append(label, landmark) {
                return Err(CorruptState::Invalid);
            }
        }
        Ok(landmarks)
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
        write_map(&self.landmarks, out);
        self.archive.write(out);
        self.covariance.write(out);
        self.numbered.write(out);
        self.sightings.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let frame = Self {
            population: State::read(input)?,
            members: read_all(input, MEMBERS_MAX)?,
            landmarks: Arc::new(read_map(input, LANDMARKS_MAX)?),
            archive: State::read(input)?,
            covariance: State::read(input)?,
            numbered: State::read(input)?,
            sightings: State::read(input)?,
        };
        // Everybody has components of his own, and there are no others.
        let bodies = frame.members.iter().map(|member| (member.offset, BODY_DIM));
        let landmarks = frame
            .landmarks
            .values()
            .map(|landmark| (landmark.offset, LANDMARK_DIM));
        let mut parts: Vec<(usize, usize)> = bodies.chain(landmarks).collect();
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

state_of_struct!(PendingSighting {
    observer,
    target,
    stamp_ns,
    relation
});

impl State for CrossFrameSighting {
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

impl State for FrameMatch {
    fn write(&self, out: &mut StateWriter) {
        let [older, newer] = self.frames;
        write_count(older, out);
        write_count(newer, out);
        self.pose.write(out);
        self.n_found.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let frames = [
            read_count(input, AGENTS_MAX)?,
            read_count(input, AGENTS_MAX)?,
        ];
        Ok(Self {
            frames,
            pose: State::read(input)?,
            n_found: State::read(input)?,
        })
    }
}

state_of_struct!(Association { name, refused });

impl State for Estimator {
    fn write(&self, out: &mut StateWriter) {
        write_count(self.slots.len(), out);
        for (slot, agent) in self.slots.iter().zip(0..) {
            self.write_slot(agent, slot, out);
        }
        write_all(self.frames.len(), self.frames.iter(), out);
        write_all(self.pending.len(), &self.pending, out);
        write_all(self.cross_sightings.len(), &self.cross_sightings, out);
        write_count(self.turn, out);
        write_all(self.frame_matches.len(), &self.frame_matches, out);
        write_map(&self.associations.names, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let (mut slots, mut odometry) = (PagedVec::default(), Vec::new());
        for _ in 0..read_count(input, AGENTS_MAX)? {
            let (slot, latest) = read_slot(input)?;
            slots.push(slot, 0);
            odometry.push(latest);
        }
        let mut frames = PagedVec::default();
        for _ in 0..read_count(input, AGENTS_MAX + 1)? {
            frames.push(Frame::read(input)?, 0);
        }
        let estimator = Self {
            parameters: Parameters::default(),
            frames,
            slots,
            pending: read_all(input, PENDING_MAX)?,
            cross_sightings: read_all(input, CROSS_SIGHTINGS_MAX)?,
            turn: read_count(input, AGENTS_MAX)?,
            frame_matches: read_all(input, FRAME_MATCHES_MAX)?,
            associations: Associations {
                names: Arc::new(read_map(input, ASSOCIATIONS_MAX)?),
            },
        };
        if estimator.is_sound() && estimator.has_odometry(&odometry) {
            Ok(estimator)
        } else {
            Err(CorruptState::Invalid)
        }
    }
}

/// Pose and stamp \[ns\] of an agent's latest odometry.
type Odometry = (Isometry3<f64>, Option<i64>);

/// Reads a slot, and the odometry beside it, which repeats the history of the agent's filter.
fn read_slot(input: &mut StateReader<'_>) -> Result<(AgentSlot, Odometry), CorruptState> {
    let frame = read_count(input, AGENTS_MAX)?;
    let odometry = State::read(input)?;
    let slot = AgentSlot {
        frame,
        evidence: State::read(input)?,
        is_aside: State::read(input)?,
        detached: State::read(input)?,
    };
    Ok((slot, odometry))
}

impl Estimator {
    /// Writes a slot, with the pose and the stamp of the agent's latest odometry.
    fn write_slot(&self, agent: u32, slot: &AgentSlot, out: &mut StateWriter) {
        write_count(slot.frame, out);
        self.latest_odometry(agent).write(out);
        slot.evidence.write(out);
        slot.is_aside.write(out);
        slot.detached.write(out);
    }

    fn latest_odometry(&self, agent: u32) -> Odometry {
        let history = self.filter(agent).map(|filter| &filter.history);
        let pose = history.map_or_else(Isometry3::identity, OdometryHistory::pose);
        (pose, history.and_then(OdometryHistory::stamp_ns))
    }

    /// Whether the odometry that was read with the slots is that of the agents' filters, to the
    /// last bit.
    fn has_odometry(&self, read: &[Odometry]) -> bool {
        let bytes = |odometry: &Odometry| {
            let mut out = StateWriter::default();
            odometry.write(&mut out);
            out.into_bytes()
        };
        let mut agents = read.iter().zip(0..);
        agents.all(|(read, agent)| bytes(read) == bytes(&self.latest_odometry(agent)))
    }

    /// Whether slots, frames and what waits belong together.
    fn is_sound(&self) -> bool {
        let (slots, frames) = (self.slots.len(), self.frames.len());
        let is_slot = |agent: u32| (agent as usize) < slots;
        // How many agents each frame has, and how many of them take part.
        let mut agents = vec![(0u32, 0usize); frames];
        for (slot, agent) in self.slots.iter().zip(0..) {
            let Some(count) = agents.get_mut(slot.frame) else {
                return false;
            };
            count.0 += 1;
            if slot.detached.is_none() {
                count.1 += 1;
                if self.frame(slot.frame).member(agent).is_none() {
                    return false;
                }
            }
        }
        let is_whole = |(frame, &(population, members)): (&Frame, &(u32, usize))| {
            frame.population == population && frame.members.len() == members
        };
        let mut pending = self.pending.iter();
        let mut cross_sightings = self.cross_sightings.iter();
        let mut frame_matches = self.frame_matches.iter();
        let names = &self.associations.names;
        frames == slots + 1
            && self.frames.iter().zip(&agents).all(is_whole)
            && pending.all(|one| {
                is_slot(one.observer) && is_slot(one.target) && one.observer != one.target
            })
            && cross_sightings.all(|one| one.frames.iter().all(|&frame| frame < frames))
            && frame_matches.all(|one| one.frames[0] < one.frames[1] && one.frames[1] < frames)
            && names
                .values()
                .all(|association| !names.contains_key(&association.name))
    }
}

#[cfg(test)]
mod tests;
