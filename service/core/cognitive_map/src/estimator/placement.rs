//! Where agents begin: the map's founder, start poses, recognised poses, restarts, kidnapped
//! agents.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix6, Vector6};

use super::agent_filter::AgentFilter;
use super::agent_slot::{AgentState, Detached};
use super::effect::Effect;
use super::frame_alignment::FrameAlignment;
use super::joint::{Estimator, MAP};
use super::recent_sightings::RecentSightings;
use super::standing::Standing;
use super::tuning::ANY_TURN_SD_RAD;
use crate::input::StartPose;
use geometry::{OUT_OF_PLANE, PoseCovariance, is_somewhere, positive, se3};

impl Estimator {
    /// Makes an agent's frame that of the map, if nobody is in that yet; answers whether it did.
    pub fn found(&mut self, agent: u32) -> bool {
        let Some(from) = self.frame_of(agent) else {
            return false;
        };
        if from == MAP || self.frame(MAP).population > 0 {
            return false;
        }
        let frame = std::mem::take(self.frame_mut(from));
        *self.frame_mut(MAP) = frame;
        self.move_slots(from, MAP);
        self.frame_matches
            .retain(|frame_match| !frame_match.frames.contains(&from));
        for cross_sighting in &mut self.cross_sightings {
            for frame in cross_sighting
                .frames
                .iter_mut()
                .filter(|frame| **frame == from)
            {
                *frame = MAP;
            }
        }
        true
    }

    /// Takes in a start pose of an agent.
    pub fn start_pose(&mut self, agent: u32, start: &StartPose, effects: &mut Vec<Effect>) {
        let sd = start.noise().sd();
        // No rotation is off by more than half a turn.
        let sd = Vector6::from_fn(|k, _| {
            if k < 3 {
                sd[k]
            } else {
                sd[k].min(ANY_TURN_SD_RAD)
            }
        });
        let covariance = PoseCovariance::from_sd(&sd);
        self.put(agent, start.pose(), covariance.matrix());
        if self.filter(agent).is_some_and(AgentFilter::is_nowhere) {
            self.set_aside(agent, effects);
        }
    }

    /// An agent turned out to be at a pose in the map, of which the error on its right has this
    /// covariance. Its frame is laid into the map's, with all that is in it; one that was in the
    /// map is put there.
    pub fn recognised(
        &mut self,
        agent: u32,
        pose: &Isometry3<f64>,
        covariance: &PoseCovariance,
        effects: &mut Vec<Effect>,
    ) {
        let (Some(own), Some(in_frame)) = (self.frame_of(agent), self.in_frame(agent).copied())
        else {
            return;
        };
        let covariance = positive(covariance.matrix());
        let is_known = covariance.iter().all(|entry| entry.is_finite());
        if !is_known || !is_somewhere(&pose.translation.vector) {
            return;
        }
        self.slot_mut(agent).is_aside = false;
        if own == MAP {
            self.put(agent, pose, &covariance);
            return;
        }
        // The error ξ of the body is Ad(T_b) ξ of the frame.
        let adjoint = se3::adjoint(&in_frame);
        let alignment = FrameAlignment {
            pose: pose * in_frame.inverse(),
            covariance: positive(&(adjoint * covariance * adjoint.transpose())),
        };
        self.merge(MAP, own, &alignment, effects);
    }

    /// An agent of the map may be anywhere, about `sd_m` from where it was estimated to be along
    /// each axis and turned in any way. One that moves in a plane stays there.
    pub fn lose(&mut self, agent: u32, sd_m: f64) {
        let Some(filter) = self.filter(agent).filter(|_| self.is_in_map(agent)) else {
            return;
        };
        let (pose, is_planar) = (filter.pose, filter.is_planar);
        let sd = Vector6::from_fn(|k, _| {
            let is_held = is_planar && OUT_OF_PLANE.contains(&k);
            match (is_held, k < 3) {
                (true, _) => 0.0,
                (false, true) => sd_m,
                (false, false) => ANY_TURN_SD_RAD,
            }
        });
        self.put(agent, &pose, PoseCovariance::from_sd(&sd).matrix());
    }

    /// An agent may have moved, or been moved, by about `sd` \[m, m, m, rad, rad, rad\] without its
    /// odometry having told: between two sessions, or while its samples were lost.
    pub fn go_unseen(&mut self, agent: u32, sd: &Vector6<f64>) {
        let Some(frame) = self.frame_of(agent) else {
            return;
        };
        let slot = self.slot_mut(agent);
        let widen = |state: &mut AgentState| {
            state.filter.history.clear();
            state.filter.noise.forget_anchors();
            state.filter.standing = Standing::default();
            state.ranging.clear();
            state.recent = RecentSightings::default();
            let covariance = state.filter.covariance_mut();
            for k in 0..6 {
                covariance[(k, k)] += sd[k] * sd[k];
            }
        };
        if let Some(detached) = &mut slot.detached {
            widen(Arc::make_mut(&mut detached.state));
        } else {
            let frame = self.frame_mut(frame);
            frame.flush();
            if let Some(index) = frame.member(agent) {
                let member = &mut frame.members[index];
                widen(member.state_mut());
                let own = member.state.filter.covariance();
                frame.covariance.set_diagonal(member.offset, own);
            }
        }
        self.forget_pending(agent);
    }

    /// Puts an agent somewhere in the map, by itself.
    pub(super) fn put(&mut self, agent: u32, pose: &Isometry3<f64>, covariance: &Matrix6<f64>) {
        let doubt = self.doubt_of_return(agent);
        let Some((from, state)) = self.leave(agent) else {
            return;
        };
        self.depart(from);
        self.frame_mut(MAP).population += 1;
        let mut state = Arc::unwrap_or_clone(state);
        // Numbers of landmarks change.
        state.forget_targets();
        let state = AgentState {
            filter: state.filter.placed(*pose, covariance),
            refused: 0,
            // Who was doubted stays so until what it sees fits.
            doubt,
            too_long: 0,
            // What it saw before was seen from elsewhere.
            recent: RecentSightings::default(),
            ..state
        };
        let slot = self.slot_mut(agent);
        slot.frame = MAP;
        slot.detached = Some(Detached::new(Arc::new(state)));
    }
}
