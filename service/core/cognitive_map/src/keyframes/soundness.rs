//! Whether a graph that was read from a checkpoint is sound: damaged bytes must not pass for one.

use super::graph::KeyframeGraph;
use super::sighting::{Shown, Sighting};
use state::NONE;

impl KeyframeGraph {
    /// Whether all numbers lead somewhere, and all lists come to an end.
    pub(super) fn is_sound(&self) -> bool {
        let slots = self.anchors.is_sound()
            && self.sightings.is_sound()
            && self.ties.is_sound()
            && self.landmarks.slots.is_sound()
            && self.moorings.is_sound();
        let is_agent = |agent: u32| (agent as usize) < self.lives.len();
        let waiting = self
            .waiting
            .iter()
            .all(|waiting| is_agent(waiting.observer) && is_agent(waiting.target));
        slots
            && waiting
            && self.hand <= self.anchors.numbers()
            && self.chains_are_sound()
            && self.sightings_are_sound()
            && self.ties_are_sound()
            && self.moorings_are_sound()
    }

    fn chains_are_sound(&self) -> bool {
        let mut visited = 0;
        for (agent, life) in (0..).zip(self.lives.iter()) {
            let (mut number, mut next) = (life.newest, NONE);
            while number != NONE {
                let Some(anchor) = self.anchors.get(number) else {
                    return false;
                };
                visited += 1;
                if anchor.next != next || anchor.agent != agent || visited > self.anchors.len() {
                    return false;
                }
                (next, number) = (number, anchor.previous);
            }
        }
        visited == self.anchors.len()
    }

    fn sightings_are_sound(&self) -> bool {
        let (mut made, mut shown, mut agents_shown) = (0, 0, 0);
        let mut of_landmark = vec![0; self.landmarks.slots.numbers() as usize];
        for (number, anchor) in self.anchors.iter() {
            let mut at = anchor.sightings;
            while at != NONE {
                let sighting = self.sightings.get(at);
                let Some(sighting) = sighting.filter(|sighting| sighting.anchor == number) else {
                    return false;
                };
                match sighting.shown {
                    Shown::Agent(..) => agents_shown += 1,
                    Shown::Landmark(landmark) => match of_landmark.get_mut(landmark as usize) {
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
            let mut at = anchor.shown;
            while at != NONE {
                let shows = |sighting: &&Sighting| matches!(sighting.shown, Shown::Agent(target, _) if target == number);
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

    fn ties_are_sound(&self) -> bool {
        let mut ends = 0;
        for (number, anchor) in self.anchors.iter() {
            let mut at = anchor.ties;
            while at != NONE {
                let Some(tie) = self.ties.get(at) else {
                    return false;
                };
                ends += 1;
                if (tie.from != number && tie.to != number) || ends > 2 * self.ties.len() {
                    return false;
                }
                at = self.next_tie(at, number);
            }
        }
        let expected: usize = self
            .ties
            .iter()
            .map(|(_, tie)| if tie.from == NONE { 1 } else { 2 })
            .sum();
        ends == expected
    }
}
