//! Motion of an agent.

use std::sync::Arc;

use super::agent_slot::AgentState;
use super::effect::Effect;
use super::joint::Estimator;
use super::outcome::Step;
use super::tuning::MOTION_INTERVAL_S_MAX;
use crate::input::Motion;

impl Estimator {
    /// An agent moved.
    ///
    /// Costs the same however much is known, but for the one that ends a stand, which costs as much
    /// as a sighting.
    pub fn motion(
        &mut self,
        agent: u32,
        stamp_ns: i64,
        motion: &Motion,
        effects: &mut Vec<Effect>,
    ) -> Step {
        let Some(slot) = self.slots.get_mut(agent as usize, 0) else {
            return Step::none();
        };
        let state = if let Some(detached) = &mut slot.detached {
            Arc::make_mut(&mut detached.state)
        } else if let Some(frame) = self.frames.get_mut(slot.frame, 0)
            && let Some(index) = frame.member(agent)
        {
            frame.members[index].state_mut()
        } else {
            return Step::none();
        };
        let AgentState {
            filter,
            ranging,
            recent,
            ..
        } = state;
        let duration_s = filter.history.stamp_ns().map_or(0.0, |before| {
            let interval_s = stamp_ns.saturating_sub(before) as f64 * 1e-9;
            interval_s.clamp(0.0, MOTION_INTERVAL_S_MAX)
        });
        let step = filter.step(motion, duration_s, &self.parameters);
        ranging.go(&step);
        recent.go(&step);
        filter.history.advance(stamp_ns, motion.increment());
        effects.push(Effect::Moved { agent, step });
        if filter.is_nowhere() {
            self.set_aside(agent, effects);
        } else if let Some(measured) = &step.measured_bias {
            self.learn_bias(agent, measured, effects);
        }
        if !self.pending.is_empty() {
            self.take_in_pending(effects);
        }
        step
    }
}
