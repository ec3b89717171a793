//! Whether a graph that was read from a checkpoint is sound: damaged bytes must not pass for one.

use super::graph::KeyframeGraph;
use super::sighting::{Seen, Sighting};
use state::NONE;

impl KeyframeGraph {
    /// Whether all numbers lead somewhere, and all lists come to an end.
    pub(super) fn is_sound(&self) -> bool {
        let slots = self.keyframes.is_sound()
            && self.sightings.is_sound()
            && self.constraints.is_sound()
            && self.landmarks.slots.is_sound()
            && self.attachments.slab.is_sound();
        let is_agent = |agent: u32| (agent as usize) < self.tracks.len();
        let pending = self
            .pending
            .iter()
            .all(|pending| is_agent(pending.observer) && is_agent(pending.target));
        slots
            && pending
            && self.sweep <= self.keyframes.numbers()
            && self.chains_are_sound()
            && self.sightings_are_sound()
            && self.constraints_are_sound()
            && self.attachments_are_sound()
    }

    fn chains_are_sound(&self) -> bool {
        let mut visited = 0;
        for (agent, track) in (0..).zip(self.tracks.iter()) {
            let (mut number, mut next) = (track.newest, NONE);
            while number != NONE {
                let Some(keyframe) = self.keyframes.get(number) else {
                    return false;
                };
                visited += 1;
                if keyframe.next != next
                    || keyframe.agent != agent
                    || visited > self.keyframes.len()
                {
                    return false;
                }
                (next, number) = (number, keyframe.previous);
            }
        }
        visited == self.keyframes.len()
    }

    fn sightings_are_sound(&self) -> bool {
        let (mut made, mut shown, mut agents_shown) = (0, 0, 0);
        let mut of_landmark = vec![0; self.landmarks.slots.numbers() as usize];
        for (number, keyframe) in self.keyframes.iter() {
            let mut at = keyframe.sightings;
            while at != NONE {
                let sighting = self.sightings.get(at);
                let Some(sighting) = sighting.filter(|sighting| sighting.keyframe == number) else {
                    return false;
                };
                match sighting.shown {
                    Seen::Agent(..) => agents_shown += 1,
                    Seen::Landmark(landmark) => match of_landmark.get_mut(landmark as usize) {
                        Some(count) => *count += 1,
                        None => return false,
                    },
                }
                made += 1;
                if made > self.sightings.len() {
                    return false;
                }
                at = sighting.next;
            }
            let mut at = keyframe.shown;
            while at != NONE {
                let is_shown =
                    |shown: &Seen| matches!(shown, Seen::Agent(target, _) if *target == number);
                let shows = |sighting: &&Sighting| is_shown(&sighting.shown);
                let Some(sighting) = self.sightings.get(at).filter(shows) else {
                    return false;
                };
                shown += 1;
                if shown > self.sightings.len() {
                    return false;
                }
                at = sighting.next_shown;
            }
        }
        let landmarks = self.landmarks.slots.iter();
        made == self.sightings.len() && shown == agents_shown && { landmarks }
            .all(|(number, landmark)| of_landmark[number as usize] == landmark.sightings)
    }

    fn constraints_are_sound(&self) -> bool {
        let mut ends = 0;
        for (number, keyframe) in self.keyframes.iter() {
            let mut at = keyframe.constraints;
            while at != NONE {
                let Some(constraint) = self.constraints.get(at) else {
                    return false;
                };
                ends += 1;
                if (constraint.from != number && constraint.to != number)
                    || ends > 2 * self.constraints.len()
                {
                    return false;
                }
                at = self.next_constraint(at, number);
            }
        }
        let expected: usize = self
            .constraints
            .iter()
            .map(|(_, constraint)| if constraint.from == NONE { 1 } else { 2 })
            .sum();
        ends == expected
    }
}
