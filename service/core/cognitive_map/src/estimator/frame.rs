//! One frame: the agents and landmarks whose errors are estimated together.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, Point3, SMatrix, SVector, Vector3};

use super::agent_filter::{AgentFilter, BODY_DIM, make_up_for_rounding};
use super::agent_slot::AgentState;
use super::calibration::{LASTING_DIM, VEER};
use super::covariance::JointCovariance;
use super::jacobian::Block;
use super::landmark_archive::LandmarkArchive;
use super::landmark_evidence::LandmarkEvidence;
use super::observers::Observers;
use super::odometry_noise::Told;
use super::parameters::Parameters;
use super::tuning::{ANY_TURN_SD_RAD, ANY_TURN_SLACK};
use crate::input::Label;
use geometry::{OUT_OF_PLANE, from_blocks, positive, se3};

/// Components of a landmark.
pub(super) const LANDMARK_DIM: usize = 3;

/// An agent that takes part in a frame's joint estimate.
#[derive(Clone, Debug)]
pub(super) struct Member {
    /// Its number.
    pub(super) agent: u32,
    /// Where its error begins.
    pub(super) offset: usize,
    /// The sighting of the frame that it took part in last.
    pub(super) used: u64,
    pub(super) state: Arc<AgentState>,
}

/// A landmark in a frame.
#[derive(Clone, Debug)]
pub(super) struct LandmarkState {
    /// Its number in the frame, never given twice.
    pub(super) number: u64,
    pub(super) position: Point3<f64>,
    /// Where its error begins.
    pub(super) offset: usize,
    /// The sighting of the frame that saw it last.
    pub(super) used: u64,
    /// Whether it stays in the joint estimate for those that leave it.
    pub(super) is_anchor: bool,
    pub(super) evidence: LandmarkEvidence,
    /// Who has seen it.
    pub(super) observers: Observers,
}

/// One frame. A clone shares what it holds.
#[derive(Clone, Debug, Default)]
pub(super) struct Frame {
    /// Number of agents, whether they take part in the joint estimate or not.
    pub(super) population: u32,
    pub(super) members: Vec<Member>,
    pub(super) landmarks: Arc<BTreeMap<Label, LandmarkState>>,
    pub(super) archive: LandmarkArchive,
    pub(super) covariance: JointCovariance,
    /// Landmarks numbered so far.
    pub(super) numbered: u64,
    /// Sightings so far.
    pub(super) sightings: u64,
}

impl Member {
    /// Its components of the joint error.
    pub(super) fn components(&self) -> Range<usize> {
        self.offset..self.offset + BODY_DIM
    }

    /// Those of its pose.
    pub(super) fn pose_components(&self) -> Range<usize> {
        self.offset..self.offset + 6
    }

    /// Its body.
    pub(super) fn filter(&self) -> &AgentFilter {
        &self.state.filter
    }

    /// The agent itself, to be changed.
    pub(super) fn state_mut(&mut self) -> &mut AgentState {
        Arc::make_mut(&mut self.state)
    }
}

impl Frame {
    /// Makes an agent a member, with errors that are independent of the others'.
    pub(super) fn join(&mut self, agent: u32, mut state: Arc<AgentState>) {
        let offset = self.covariance.grow(BODY_DIM);
        let filter = &mut Arc::make_mut(&mut state).filter;
        self.covariance
            .set_diagonal(offset, filter.covariance_mut());
        if let Some(noise) = filter.noise.take_trial_noise(filter.history.stamp_ns()) {
            self.covariance.add_to_shares(agent, offset, &noise);
        }
        self.members.push(Member {
            agent,
            offset,
            used: self.sightings,
            state,
        });
    }

    /// An agent takes part no longer.
    pub(super) fn leave(&mut self, agent: u32) -> Option<Arc<AgentState>> {
        let index = self.member(agent)?;
        let member = self.members.remove(index);
        self.covariance.drop_shares(agent);
        self.drop_components(member.offset, BODY_DIM);
        Some(member.state)
    }

    /// The agent that saw and was seen longest ago.
    pub(super) fn idlest(&self) -> Option<u32> {
        let idlest = self.members.iter().min_by_key(|member| member.used)?;
        Some(idlest.agent)
    }

    /// Counts a sighting that an agent takes part in.
    pub(super) fn note_use(&mut self, index: usize) {
        self.sightings += 1;
        self.members[index].used = self.sightings;
    }

    /// Where an agent is in the list of members.
    pub(super) fn member(&self, agent: u32) -> Option<usize> {
        self.members.iter().position(|member| member.agent == agent)
    }

    /// Covariance of a landmark \[m²\].
    pub(super) fn landmark_covariance(&self, landmark: &LandmarkState) -> Matrix3<f64> {
        positive(&self.covariance.block(landmark.offset, landmark.offset))
    }

    /// Whether all motion was in the plane.
    pub(super) fn is_planar(&self) -> bool {
        self.members.iter().all(|member| member.filter().is_planar)
    }

    /// Removes components and closes the gap.
    pub(super) fn drop_components(&mut self, offset: usize, width: usize) {
        self.covariance.remove(offset, width);
        let behind = |own: &mut usize| {
            if *own > offset {
                *own -= width;
            }
        };
        for member in &mut self.members {
            behind(&mut member.offset);
        }
        for landmark in Arc::make_mut(&mut self.landmarks).values_mut() {
            behind(&mut landmark.offset);
        }
    }

    /// Forgets where a landmark is.
    pub(super) fn forget(&mut self, label: &Label) {
        if let Some(landmark) = Arc::make_mut(&mut self.landmarks).remove(label) {
            self.drop_components(landmark.offset, LANDMARK_DIM);
        }
        self.archive.remove(label);
    }

    /// Takes a landmark out of the list, and leaves its components.
    pub(super) fn take_out(&mut self, label: &Label) -> Option<LandmarkState> {
        self.landmarks
            .contains_key(label)
            .then(|| Arc::make_mut(&mut self.landmarks).remove(label))?
    }

    /// Forgets that an agent saw landmarks, whose number will be another one's: it may have been
    /// anybody.
    pub(super) fn forget_observer(&mut self, agent: u32) {
        for landmark in Arc::make_mut(&mut self.landmarks).values_mut() {
            landmark.observers.forget(agent);
        }
        self.archive.forget_observer(agent);
    }

    /// Brings all cross terms up to date.
    ///
    /// Between sightings a moving body keeps only its own covariance and its transition; what ties
    /// it to the others waits until it is needed.
    pub(super) fn flush(&mut self) {
        for member in &mut self.members {
            if member.filter().is_stale() {
                let transition = member.state_mut().filter.flush();
                let own = member.state.filter.covariance();
                self.covariance.transform(member.offset, &transition, own);
                let filter = &mut member.state_mut().filter;
                match filter.noise.take_trial_noise(filter.history.stamp_ns()) {
                    Some(noise) => {
                        let (agent, offset) = (member.agent, member.offset);
                        self.covariance.add_to_shares(agent, offset, &noise);
                    }
                    None => self.covariance.drop_shares(member.agent),
                }
            }
        }
        self.hold_turns();
    }

    /// Takes into account that no rotation is off by more than half a turn, wherever motion or
    /// doubt have made one less certain.
    ///
    /// It is a measurement that finds what is expected, so that all that is correlated with the
    /// rotation becomes more certain with it.
    fn hold_turns(&mut self) {
        let most = ANY_TURN_SD_RAD * ANY_TURN_SD_RAD;
        let turns = |member: &Member| member.offset + 3..member.offset + 6;
        let turns: Vec<usize> = self.members.iter().flat_map(turns).collect();
        let mut has_changed = false;
        for component in turns {
            let variance = self.covariance.variance(component);
            if variance > ANY_TURN_SLACK * most {
                let mut jacobian = SMatrix::<f64, 1, 6>::zeros();
                jacobian[0] = 1.0;
                let block = Block {
                    offset: component,
                    width: 1,
                    jacobian,
                };
                let projection = self.covariance.project(&[block]);
                let noise = most * variance / (variance - most);
                let s = projection.spread + SMatrix::<f64, 1, 1>::new(noise);
                let all = self.covariance.all();
                self.covariance
                    .update(projection, &SVector::zeros(), &s, &all);
                has_changed = true;
            }
        }
        if has_changed {
            self.tell_members();
        }
    }

    /// From the first landmark on that a member sees with its direction it is not taken for granted
    /// that it drives straight: only such landmarks tell that in time. What views say of it comes
    /// with the past.
    pub(super) fn begin_veer(&mut self, index: usize, parameters: &Parameters) {
        let component = self.members[index].offset + BODY_DIM - LASTING_DIM + VEER;
        let sd = parameters.calibration_sd()[VEER];
        if sd == 0.0 || self.covariance.variance(component) > 0.0 {
            return;
        }
        self.flush();
        let variance = SMatrix::<f64, 1, 1>::new(sd * sd);
        self.covariance.set_diagonal(component, &variance);
        self.tell_members();
    }

    /// Takes back what was assumed of a member's odometry, as soon as it is known to be better.
    /// `told` is what has just been learned from.
    pub(super) fn take_back_noise(&mut self, index: usize, stamp_ns: i64, told: Told) {
        if self.members[index].filter().noise.trial.is_none() {
            return;
        }
        self.flush();
        let member = &mut self.members[index];
        let Some(parts) = member.state_mut().filter.noise.end_trial(stamp_ns, told) else {
            return;
        };
        if self.covariance.take_back(member.agent, parts) {
            self.tell_members();
        }
    }

    /// Tells the members their own parts of the joint covariance.
    pub(super) fn tell_members(&mut self) {
        for member in &mut self.members {
            let own = self.covariance.block(member.offset, member.offset);
            *member.state_mut().filter.covariance_mut() = own;
        }
    }

    /// Adds to the uncertainty of an agent's pose: it is not where it should be.
    pub(super) fn widen(&mut self, index: usize, sd_m: f64, sd_rad: f64) {
        self.flush();
        let member = &mut self.members[index];
        let filter = &mut member.state_mut().filter;
        for k in 0..6 {
            if !(filter.is_planar && OUT_OF_PLANE.contains(&k)) {
                let sd = if k < 3 { sd_m } else { sd_rad };
                filter.covariance_mut()[(k, k)] += sd * sd;
            }
        }
        self.covariance
            .set_diagonal(member.offset, member.state.filter.covariance());
    }

    /// Corrects everything by what an observer's sighting tells, and carries the errors over to the
    /// corrected estimate.
    ///
    /// What nobody can know is where the whole map lies: an error θ of the observer's rotation goes
    /// with errors θ × (x − x̂₀) of all positions. Errors are therefore counted relative to the
    /// observer's rotation (the right-invariant error of Barrau & Bonnabel 2015), which makes them
    /// independent of the estimate: a correction Δ of a position changes its error by θ × Δ.
    /// Without this, corrections would feign knowledge of the whole map's direction (Huang,
    /// Mourikis & Roumeliotis 2010).
    ///
    /// Landmarks go along the arcs on which that rotation takes them, as they do in the group of
    /// that filter, and not along tangents: or else each large correction of a rotation would
    /// enlarge the map.
    ///
    /// Answers how much of a correction of a position is left along the arc.
    pub(super) fn correct(
        &mut self,
        index: usize,
        correction: &[f64],
        parameters: &Parameters,
    ) -> Matrix3<f64> {
        let observer = &self.members[index];
        let world = observer
            .filter()
            .pose
            .rotation
            .to_rotation_matrix()
            .into_inner();
        let source = observer.offset + 3;
        let turn = world * Vector3::from_fn(|k, _| correction[source + k]);
        let along = |axis: Vector3<f64>| se3::exp(&axis, &turn).translation.vector;
        let arc = Matrix3::from_columns(&[Vector3::x(), Vector3::y(), Vector3::z()].map(along));
        let mut levers: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; correction.len()]);
        let mut lever = |offset: usize, matrix: Matrix3<f64>| {
            for (column, lever) in levers.iter_mut().enumerate() {
                for row in 0..3 {
                    lever[offset + row] = matrix[(row, column)];
                }
            }
        };
        let mut turns = Vec::with_capacity(self.members.len());
        for member in &mut self.members {
            let error = SVector::from_fn(|k, _| correction[member.offset + k]);
            let filter = &mut Arc::make_mut(&mut member.state).filter;
            let before = filter.pose;
            filter.correct(&error, parameters);
            let moved = filter.pose.translation.vector - before.translation.vector;
            let to_body = before
                .rotation
                .to_rotation_matrix()
                .into_inner()
                .transpose();
            lever(member.offset, -(to_body * moved.cross_matrix() * world));
            turns.push(filter.pose.rotation.inverse() * before.rotation);
        }
        for landmark in Arc::make_mut(&mut self.landmarks).values_mut() {
            let moved = arc * Vector3::from_fn(|k, _| correction[landmark.offset + k]);
            landmark.position += moved;
            lever(landmark.offset, -(moved.cross_matrix() * world));
        }
        self.covariance.shear(source, &levers);
        // Errors of a body are stated along its axes, which a correction has turned.
        for (member, turn) in self.members.iter_mut().zip(turns) {
            let turn = turn.to_rotation_matrix().into_inner();
            let axes = from_blocks(&turn, &Matrix3::zeros(), &Matrix3::zeros(), &turn);
            let own = self.covariance.block(member.offset, member.offset);
            let mut own = axes * own * axes.transpose();
            let position = (0..3).map(|k| own[(k, k)]).sum();
            let turn = (3..6).map(|k| own[(k, k)]).sum();
            make_up_for_rounding(&mut own, position, turn);
            self.covariance.transform(member.offset, &axes, &own);
        }
        self.tell_members();
        arc
    }
}
