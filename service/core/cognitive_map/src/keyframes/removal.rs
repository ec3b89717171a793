//! Agents that leave the space.

use super::graph::KeyframeGraph;
use super::life::Life;
use state::NONE;

impl KeyframeGraph {
    /// An agent of the map is gone. What it did stays part of the past.
    pub fn retire(&mut self, agent: u32) {
        self.waiting
            .retain(|waiting| waiting.observer != agent && waiting.target != agent);
    }

    /// Forgets an agent that was never in the map: its number is as it was when it enrolled. Walks the
    /// whole chain of the agent.
    pub fn clear(&mut self, agent: u32) {
        self.retire(agent);
        let Some(life) = self.lives.get(agent as usize) else {
            return;
        };
        let (mut number, session) = (life.newest, life.session + 1);
        while let Some(anchor) = self.anchors.get(number) {
            let previous = anchor.previous;
            self.strip(number);
            self.anchors.remove(number, self.revision);
            number = previous;
        }
        if let Some(life) = self.lives.get_mut(agent as usize, self.revision) {
            // Runs are counted on: milestones and searches of earlier ones must not pass for the next agent's.
            *life = Life {
                session,
                ..Life::new()
            };
        }
    }

    /// Takes off an anchor all that hangs on it.
    fn strip(&mut self, number: u32) {
        let first = |this: &Self| {
            let anchor = this.anchors.get(number)?;
            Some((anchor.sightings, anchor.shown, anchor.ties))
        };
        while let Some((sighting, shown, tie)) = first(self) {
            if sighting != NONE {
                self.detach(sighting);
            } else if shown != NONE {
                self.detach(shown);
            } else if tie != NONE {
                self.untie(tie);
            } else {
                return;
            }
        }
    }
}
