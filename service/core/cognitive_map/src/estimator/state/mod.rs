//! The bytes of the estimate. What is read back goes on to the last bit as what was written.
//!
//! The parameters are constant and not written.

mod codecs;
mod square;

use std::sync::Arc;

use nalgebra::Isometry3;

use square::{read_square, write_square};

use codecs::{ListUpTo, MapUpTo, Shared, SortedUpTo, UpTo};

use super::agent_filter::{AgentFilter, BODY_DIM, Run};
use super::agent_slot::{AgentSlot, AgentState, Detached};
use super::archived_landmark::{ArchivedLandmark, Tie};
use super::associations::{Association, Associations};
use super::covariance::JointCovariance;
use super::doubtful_motion::DoubtfulMotion;
use super::frame::{Frame, LANDMARK_DIM, LandmarkState, Member};
use super::frame_match::FrameMatch;
use super::joint::Estimator;
use super::landmark_archive::LandmarkArchive;
use super::landmark_evidence::{LandmarkEvidence, Rival};
use super::noise_part::NoisePart;
use super::noise_share::NoiseShare;
use super::observers::Observers;
use super::odometry_history::OdometryHistory;
use super::odometry_noise::{NoiseTrial, OdometryNoise};
use super::outcome::Evidence;
use super::parameters::Parameters;
use super::range_hypotheses::RangeHypotheses;
use super::range_places::PointHypothesis;
use super::range_sensor::RangeSensor;
use super::ranging::Ranging;
use super::recent_sightings::{RecentSighting, RecentSightings};
use super::sensor::{Sensor, SightingTarget};
use super::sighting_pair::{Anchor, NoisyMotion};
use super::sightings::{CrossFrameSighting, PendingSighting};
use super::standing::{Read, Standing};
use super::tuning::{
    ARCHIVE_PART_MAX, ARCHIVE_PARTS, ASSOCIATIONS_MAX, CROSS_SIGHTINGS_MAX, FRAME_MATCHES_MAX,
    HISTORY_LEN, LANDMARKS_MAX, MEMBERS_MAX, NOISE_SHARES_MAX, NOISE_TARGETS_MAX, OBSERVERS_MAX,
    PENDING_MAX, RANGE_POINTS_MAX, RANGED_MAX, RECENT_SIGHTINGS_MAX, SENSOR_TARGETS_MAX, TIES_MAX,
};
use super::understated_noise::UnderstatedNoise;
use ::state::{
    Codec, CorruptState, PagedVec, State, StateReader, StateWriter, state_of_enum, state_of_struct,
};

/// Most components of a joint covariance.
const DIM_MAX: usize = MEMBERS_MAX * BODY_DIM + LANDMARKS_MAX * LANDMARK_DIM;
/// Most agents of a space, against counts that no bytes can follow.
const AGENTS_MAX: usize = 1 << 24;
/// Most frames: the map's, and one for each agent.
const FRAMES_MAX: usize = AGENTS_MAX + 1;
/// Most archived landmarks of a frame.
const ARCHIVED_MAX: usize = ARCHIVE_PARTS * ARCHIVE_PART_MAX;

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
    is_planar,
    noise,
    standing
});
state_of_struct!(Read {
    turned,
    went_m,
    time_s,
    turning_s
});
state_of_struct!(Standing {
    window,
    stood,
    windows,
    squares,
    since_m
});
state_of_struct!(NoisyMotion {
    by_lengths,
    by_angles,
    as_stated
});
state_of_struct!(Anchor {
    label,
    stamp_ns,
    seen,
    point,
    spread,
    is_polar,
    motion,
    noise
});
state_of_struct!(OdometryNoise {
    log_scales,
    information,
    factors,
    understated,
    is_stated,
    motion,
    anchors as ListUpTo<NOISE_TARGETS_MAX>,
    trial
});
state_of_struct!(UnderstatedNoise { log_factors, pairs });
state_of_struct!(NoiseTrial {
    seen_ns,
    followed_ns,
    by_lengths,
    by_angles
});
state_of_enum!(NoisePart {
    All = 0,
    Less = 1,
    Least = 2
});
state_of_struct!(PointHypothesis {
    log_weight,
    position,
    covariance,
    noise_part
});
state_of_struct!(DoubtfulMotion { certain, assumed });
state_of_struct!(RangeHypotheses {
    points as ListUpTo<RANGE_POINTS_MAX>,
    motion,
    path_m,
    used,
    taken,
    outlying,
    decided,
    log_evidence,
    at_most_m
});
state_of_struct!(Ranging {
    landmarks as MapUpTo<RANGED_MAX>,
    since,
    taken
});
state_of_struct!(RangeSensor {
    scale,
    count,
    product,
    square,
    latest as MapUpTo<SENSOR_TARGETS_MAX>
});
state_of_struct!(RecentSighting {
    label,
    point,
    distance_m,
    variance,
    noise,
    number,
    is_refused
});
state_of_struct!(RecentSightings {
    seen as ListUpTo<RECENT_SIGHTINGS_MAX>,
    way,
    noise,
    count
});
state_of_struct!(AgentState {
    filter,
    sensor,
    range_sensor,
    ranging,
    recent,
    refused,
    doubt,
    too_long
});
state_of_struct!(Tie {
    anchor,
    number,
    position,
    covariance,
    gain
});
state_of_struct!(ArchivedLandmark {
    number,
    position,
    covariance,
    ties as ListUpTo<TIES_MAX>,
    rest,
    left,
    only,
    evidence
});

state_of_struct!(OdometryHistory {
    instants as ListUpTo<HISTORY_LEN>,
    latest
});
state_of_enum!(SightingTarget {
    Landmark(number) = 0,
    Agent(number) = 1
});
state_of_struct!(Sensor {
    scales,
    counts,
    product,
    square,
    latest as MapUpTo<SENSOR_TARGETS_MAX>
});
state_of_struct!(Detached {
    was_joint,
    state as Shared
});
state_of_struct!(Member {
    agent,
    offset as UpTo<DIM_MAX>,
    used,
    state as Shared
});
state_of_struct!(Observers {
    agents as SortedUpTo<OBSERVERS_MAX>,
    are_more
});
state_of_struct!(Rival {
    position,
    covariance,
    votes
});
state_of_struct!(LandmarkEvidence {
    is_confirmed,
    refused_ranges,
    rival
});
state_of_struct!(LandmarkState {
    number,
    position,
    offset as UpTo<DIM_MAX>,
    used,
    is_anchor,
    evidence,
    observers
});
state_of_struct!(Frame {
    population,
    members as ListUpTo<MEMBERS_MAX>,
    landmarks as MapUpTo<LANDMARKS_MAX>,
    archive,
    covariance,
    numbered,
    sightings
});
state_of_struct!(PendingSighting {
    observer,
    target,
    stamp_ns,
    relation
});
state_of_struct!(CrossFrameSighting {
    frames as UpTo<AGENTS_MAX>,
    points,
    variance
});
state_of_struct!(FrameMatch {
    frames as UpTo<AGENTS_MAX>,
    pose,
    n_found
});
state_of_struct!(Association { name, refused });

impl State for LandmarkArchive {
    fn write(&self, out: &mut StateWriter) {
        UpTo::<ARCHIVED_MAX>::write(&self.len(), out);
        for (label, landmark) in self.iter() {
            label.write(out);
            landmark.write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let mut landmarks = Self::default();
        let count: usize = UpTo::<ARCHIVED_MAX>::read(input)?;
        for _ in 0..count {
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
    fn write(&self, out: &mut StateWriter) {
        UpTo::<DIM_MAX>::write(&self.dim(), out);
        write_square(self.dim(), self.entries(), out);
        UpTo::<NOISE_SHARES_MAX>::write(&self.shares().len(), out);
        for share in self.shares() {
            (share.agent, share.is_of_angles).write(out);
            write_square(self.dim(), &share.entries, out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let dim: usize = UpTo::<DIM_MAX>::read(input)?;
        let entries = read_square(dim, input)?;
        let mut joint = Self::from_entries(dim, entries).ok_or(CorruptState::Invalid)?;
        let n_shares: usize = UpTo::<NOISE_SHARES_MAX>::read(input)?;
        for _ in 0..n_shares {
            let (agent, is_of_angles) = State::read(input)?;
            joint.shares_mut().push(NoiseShare {
                agent,
                is_of_angles,
                entries: Arc::new(read_square(dim, input)?),
            });
        }
        Ok(joint)
    }
}

impl State for Estimator {
    fn write(&self, out: &mut StateWriter) {
        UpTo::<AGENTS_MAX>::write(&self.slots.len(), out);
        for (slot, agent) in self.slots.iter().zip(0..) {
            self.write_slot(agent, slot, out);
        }
        UpTo::<FRAMES_MAX>::write(&self.frames.len(), out);
        for frame in self.frames.iter() {
            frame.write(out);
        }
        ListUpTo::<PENDING_MAX>::write(&self.pending, out);
        ListUpTo::<CROSS_SIGHTINGS_MAX>::write(&self.cross_sightings, out);
        UpTo::<AGENTS_MAX>::write(&self.turn, out);
        ListUpTo::<FRAME_MATCHES_MAX>::write(&self.frame_matches, out);
        MapUpTo::<ASSOCIATIONS_MAX>::write(&self.associations.names, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let (mut slots, mut odometry) = (PagedVec::default(), Vec::new());
        let n_agents: usize = UpTo::<AGENTS_MAX>::read(input)?;
        for _ in 0..n_agents {
            let (slot, latest) = read_slot(input)?;
            slots.push(slot, 0);
            odometry.push(latest);
        }
        let mut frames = PagedVec::default();
        let n_frames: usize = UpTo::<FRAMES_MAX>::read(input)?;
        for _ in 0..n_frames {
            frames.push(Frame::read(input)?, 0);
        }
        let estimator = Self {
            parameters: Parameters::default(),
            frames,
            slots,
            pending: ListUpTo::<PENDING_MAX>::read(input)?,
            cross_sightings: ListUpTo::<CROSS_SIGHTINGS_MAX>::read(input)?,
            turn: UpTo::<AGENTS_MAX>::read(input)?,
            frame_matches: ListUpTo::<FRAME_MATCHES_MAX>::read(input)?,
            associations: Associations {
                names: MapUpTo::<ASSOCIATIONS_MAX>::read(input)?,
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
    let frame = UpTo::<AGENTS_MAX>::read(input)?;
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
        UpTo::<AGENTS_MAX>::write(&slot.frame, out);
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
            frame.population == population
                && frame.members.len() == members
                && components_are_sound(frame)
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

/// Whether each member and landmark of a frame has components of its own, and there are no others.
fn components_are_sound(frame: &Frame) -> bool {
    let bodies = frame.members.iter().map(|member| (member.offset, BODY_DIM));
    let landmarks = frame.landmarks.values();
    let landmarks = landmarks.map(|landmark| (landmark.offset, LANDMARK_DIM));
    let mut parts: Vec<(usize, usize)> = bodies.chain(landmarks).collect();
    parts.sort_unstable();
    let end = parts.iter().try_fold(0, |end, &(offset, width)| {
        (offset == end).then_some(end + width)
    });
    end == Some(frame.covariance.dim())
}

#[cfg(test)]
mod tests;
