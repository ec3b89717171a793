//! Removal of an agent from the keyframe graph.

use super::agent_track::AgentTrack;
use super::graph::KeyframeGraph;
use state::NONE;

impl KeyframeGraph {
    /// Forgets an agent that was never in the map: its number is as it was when it enrolled. Walks
    /// the whole chain of the agent.
    pub fn clear(&mut self, agent: u32) {
        let Some(track) = self.chains.track(agent) else {
            return;
        };
        let (mut number, session) = (track.newest, track.session + 1);
        self.cut(agent);
        while let Some(keyframe) = self.chains.keyframes.get(number) {
            let previous = keyframe.previous;
            self.strip(number);
            self.chains.keyframes.remove(number, self.revision);
            let schedule = &mut self.constraints.schedule;
            schedule.keyframes = schedule.keyframes.saturating_sub(1);
            number = previous;
        }
        if let Some(track) = self.track_mut(agent) {
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
        while let Some(keyframe) = self.chains.keyframes.get(number) {
            let (made, shown) = (keyframe.sightings, keyframe.shown);
            let constraint = keyframe.constraints;
            if made != NONE {
                self.remove_sighting(made);
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
