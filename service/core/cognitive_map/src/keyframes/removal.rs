//! Agents that leave the space.

use super::agent_track::AgentTrack;
use super::graph::KeyframeGraph;
use state::NONE;

impl KeyframeGraph {
    /// An agent of the map has left. What it did stays part of the past.
    pub fn retire(&mut self, agent: u32) {
        self.pending
            .retain(|pending| pending.observer != agent && pending.target != agent);
    }

    /// Forgets an agent that was never in the map: its number is as it was when it enrolled. Walks
    /// the whole chain of the agent.
    pub fn clear(&mut self, agent: u32) {
        self.retire(agent);
        let Some(track) = self.tracks.get(agent as usize) else {
            return;
        };
        let (mut number, session) = (track.newest, track.session + 1);
        while let Some(keyframe) = self.keyframes.get(number) {
            let previous = keyframe.previous;
            self.strip(number);
            self.keyframes.remove(number, self.revision);
            number = previous;
        }
        if let Some(track) = self.tracks.get_mut(agent as usize, self.revision) {
            // The session numbers go on: index entries and searches of earlier ones must not pass
            // for the next agent's.
            *track = AgentTrack {
                session,
                ..AgentTrack::new()
            };
        }
    }

    /// Removes all sightings and constraints of a keyframe.
    fn strip(&mut self, number: u32) {
        let first = |this: &Self| {
            let keyframe = this.keyframes.get(number)?;
            Some((keyframe.sightings, keyframe.shown, keyframe.constraints))
        };
        while let Some((sighting, shown, constraint)) = first(self) {
            if sighting != NONE {
                self.remove_sighting(sighting);
            } else if shown != NONE {
                self.remove_sighting(shown);
            } else if constraint != NONE {
                self.remove_constraint(constraint);
            } else {
                return;
            }
        }
    }
}
