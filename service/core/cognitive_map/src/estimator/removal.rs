//! Agents that leave the space.

use nalgebra::{Isometry3, Matrix6};

use super::agent_filter::AgentFilter;
use super::agent_slot::{AgentSlot, Detached};
use super::frame::Frame;
use super::joint::{Estimator, MAP};

impl Estimator {
    /// An agent of the map is gone: it stays where it was, and takes part in no joint estimate any
    /// more.
    pub fn retire(&mut self, agent: u32) {
        self.forget_pending(agent);
        let Some(number) = self.frame_of(agent) else {
            return;
        };
        if let Some(state) = self.frame_mut(number).leave(agent) {
            self.slot_mut(agent).detached = Some(Detached {
                state,
                was_joint: true,
            });
        }
    }

    /// Forgets an agent that was never in the map: its number is as it was when it enrolled, at the
    /// identity of a frame of its own. Landmarks of the frame that it leaves stay as long as others
    /// are in it.
    ///
    /// # Panics
    /// Never: beside the map's there is one frame for each agent, and this one is in none.
    pub fn clear(&mut self, agent: u32) {
        self.forget_pending(agent);
        let Some(from) = self.frame_of(agent).filter(|&frame| frame != MAP) else {
            return;
        };
        self.leave(agent);
        let frame = self.frame_mut(from);
        frame.population -= 1;
        if frame.population == 0 {
            *frame = Frame::default();
            self.forget_cross_sightings(from);
        } else {
            frame.forget_observer(agent);
        }
        let own = (1..self.frames.len()).find(|&number| self.frame(number).population == 0);
        let own = own.expect("there are as many frames as agents beside the map's");
        *self.frame_mut(own) = Frame {
            population: 1,
            ..Frame::default()
        };
        let filter = AgentFilter::new(Isometry3::identity(), &Matrix6::zeros(), &self.parameters);
        *self.slot_mut(agent) = AgentSlot::new(own, filter);
    }

    /// Forgets the sightings by and of an agent that have not been taken in.
    pub(super) fn forget_pending(&mut self, agent: u32) {
        self.pending
            .retain(|pending| pending.observer != agent && pending.target != agent);
    }
}
