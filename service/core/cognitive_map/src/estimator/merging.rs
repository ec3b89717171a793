//! Merging of frames whose relative pose has become known.

use std::sync::Arc;

use super::agent_filter::AgentFilter;
use super::effect::{Effect, FramesMerged};
use super::frame::Frame;
use super::frame_alignment::{FrameAlignment, PointPair, align_frames};
use super::joint::{Estimator, MAP};
use super::tuning::{FRAMES_COMPARED_MAX, MEMBERS_MAX};
use crate::input::Label;

impl Estimator {
    /// Merges an agent's frame with another one if their alignment is known, after a sighting
    /// of a landmark, or of another agent.
    pub(super) fn merge_with(
        &mut self,
        agent: u32,
        label: Option<&Label>,
        effects: &mut Vec<Effect>,
    ) {
        let (Some(own), count) = (self.frame_of(agent), self.frames.len()) else {
            return;
        };
        let start = if count <= FRAMES_COMPARED_MAX {
            0
        } else {
            self.turn
        };
        let others = (0..count.min(FRAMES_COMPARED_MAX)).map(|k| (start + k) % count);
        // The map's frame is always among them.
        let others: Vec<usize> = std::iter::once(MAP)
            .chain(others.filter(|&other| other != MAP))
            .collect();
        self.turn = (start + FRAMES_COMPARED_MAX) % count;
        for other in others {
            let frame = self.frame(other);
            let knows = |frame: &Frame| label.is_none_or(|label| frame.has_name(label));
            let is_empty = frame.population == 0 && frame.landmarks.is_empty();
            if other == own || is_empty || !knows(frame) {
                continue;
            }
            let (older, newer) = (own.min(other), own.max(other));
            if let Some(alignment) = self.alignment_of(older, newer) {
                self.merge(older, newer, &alignment, effects);
                return;
            }
        }
    }

    /// How one frame lies in an older one, if that is known.
    fn alignment_of(&self, older: usize, newer: usize) -> Option<FrameAlignment> {
        let [one, other] = [older, newer].map(|number| self.frame(number));
        let mut pairs = one.shared(other);
        for cross_sighting in &self.cross_sightings {
            let [a, b] = cross_sighting.points;
            let (in_older, in_newer) = match cross_sighting.frames {
                frames if frames == [older, newer] => (a, b),
                frames if frames == [newer, older] => (b, a),
                _ => continue,
            };
            pairs.push(PointPair {
                older: in_older,
                newer: in_newer,
                variance: cross_sighting.variance,
            });
        }
        align_frames(&pairs, one.is_planar() && other.is_planar())
    }

    /// Merges a frame into an older one.
    pub(super) fn merge(
        &mut self,
        older: usize,
        newer: usize,
        alignment: &FrameAlignment,
        effects: &mut Vec<Effect>,
    ) {
        let moved = std::mem::take(self.frame_mut(newer));
        let parameters = self.parameters.clone();
        let agents = self.move_slots(newer, older);
        let is_trusted = |&agent: &u32| older != MAP || !self.was_contradicted(agent);
        if agents.iter().any(is_trusted) {
            self.frame_mut(older).merge(moved, alignment, &parameters);
        } else {
            self.frame_mut(older).merge_doubted(moved, alignment);
        }
        for &agent in &agents {
            if let Some(detached) = &mut self.slot_mut(agent).detached {
                let filter = &mut Arc::make_mut(&mut detached.state).filter;
                filter.transform_by(alignment);
                // All of them share the error of the alignment.
                detached.was_joint = true;
            }
        }
        if older == MAP {
            for &agent in &agents {
                let doubt = self.doubt_of_return(agent);
                if let Some(state) = self.agent_state_mut(agent) {
                    state.doubt = doubt;
                }
                // Doubt remains only if its sightings had been refused.
                let is_doubted = self.was_contradicted(agent);
                self.slot_mut(agent).is_aside &= is_doubted;
            }
        }
        let is_nowhere = |&agent: &u32| self.filter(agent).is_some_and(AgentFilter::is_nowhere);
        let (lost, agents) = agents.into_iter().partition::<Vec<u32>, _>(is_nowhere);
        while self.frame(older).members.len() > MEMBERS_MAX {
            self.detach_idlest(older);
        }
        self.forget_cross_sightings(newer);
        effects.push(Effect::FramesMerged(FramesMerged {
            frame: newer,
            into: older,
            pose: alignment.pose,
            agents,
        }));
        for agent in lost {
            self.set_aside(agent, effects);
        }
        self.sweep(older, effects);
    }

    /// Forgets the sightings between a frame and others, and how it resembles them.
    pub(super) fn forget_cross_sightings(&mut self, frame: usize) {
        self.cross_sightings
            .retain(|cross_sighting| !cross_sighting.frames.contains(&frame));
        self.frame_matches
            .retain(|frame_match| !frame_match.frames.contains(&frame));
    }
}
