//! The sightings of the keyframe graph, each in the lists of its keyframe and of the one that it
//! shows, and the landmarks that they show.

use state::{NONE, Slab};

use super::keyframe::{Keyframe, KeyframeSlab};
use super::landmarks::Landmarks;
use super::list::unlink;
use super::sighting::{Seen, Sighting};
use super::tuning;
use crate::input::Label;

/// The sightings, and the landmarks that they show.
#[derive(Clone, Debug, Default)]
pub(super) struct Sightings {
    pub(super) slab: Slab<Sighting, 64>,
    pub(super) landmarks: Landmarks,
}

/// How many sightings a keyframe has, and which of them is the least certain.
pub(super) struct Crowd {
    pub(super) count: u32,
    /// Trace of its covariance \[m²\].
    spread: f64,
    /// Its number; [`NONE`] without any.
    pub(super) least_certain: u32,
}

impl Sightings {
    /// The sightings made at a keyframe, with their numbers.
    pub(super) fn made_at(&self, keyframe: &Keyframe) -> impl Iterator<Item = (u32, &Sighting)> {
        let item = |number: u32| Some((number, self.slab.get(number)?));
        std::iter::successors(item(keyframe.sightings), move |(_, sighting)| {
            item(sighting.next)
        })
    }

    /// The sightings that show a keyframe.
    pub(super) fn showing(&self, keyframe: &Keyframe) -> impl Iterator<Item = &Sighting> {
        let first = self.slab.get(keyframe.shown);
        std::iter::successors(first, |sighting| self.slab.get(sighting.next_shown))
    }

    /// The sightings of a keyframe, counted.
    pub(super) fn crowd(&self, keyframe: &Keyframe) -> Crowd {
        let mut crowd = Crowd {
            count: 0,
            spread: 0.0,
            least_certain: NONE,
        };
        for (number, sighting) in self.made_at(keyframe) {
            let spread = sighting.seen.spread();
            if spread > crowd.spread {
                (crowd.spread, crowd.least_certain) = (spread, number);
            }
            crowd.count += 1;
        }
        crowd
    }

    /// Adds a sighting, of at most `most`, to the lists of its keyframe and of the one that it
    /// shows. It is merged with one of the same landmark, if both are of one kind; in a full list
    /// it replaces the least certain one. Answers whether there is one more.
    pub(super) fn add(
        &mut self,
        sighting: Sighting,
        keyframes: &mut KeyframeSlab,
        most: u32,
        revision: u64,
    ) -> bool {
        let Some(keyframe) = keyframes.get(sighting.keyframe) else {
            return false;
        };
        let is_same = |other: &Sighting| {
            matches!(other.shown, Seen::Landmark(_)) && other.shown == sighting.shown
        };
        let same = |(number, other): (u32, &Sighting)| {
            let mean = is_same(other).then(|| other.seen.mean(&sighting.seen));
            Some((number, mean.flatten()?))
        };
        let mean = self.made_at(keyframe).find_map(same);
        if let Some((number, mean)) = mean {
            if let Some(other) = self.slab.get_mut(number, revision) {
                other.seen = mean;
            }
            return false;
        }
        let crowd = self.crowd(keyframe);
        let is_full = crowd.count as usize >= tuning::SIGHTINGS_PER_KEYFRAME_MAX
            || self.slab.len() >= most as usize;
        if is_full {
            let spread = sighting.seen.spread();
            if crowd.least_certain == NONE || spread >= crowd.spread {
                return false;
            }
            self.remove(crowd.least_certain, keyframes, revision);
        }
        self.link(sighting, keyframes, revision);
        true
    }

    /// Puts a sighting at the head of its lists.
    fn link(&mut self, mut sighting: Sighting, keyframes: &mut KeyframeSlab, revision: u64) {
        let (at, shown) = (sighting.keyframe, sighting.shown_keyframe());
        sighting.next = { keyframes.get(at) }.map_or(NONE, |keyframe| keyframe.sightings);
        sighting.next_shown = { keyframes.get(shown) }.map_or(NONE, |keyframe| keyframe.shown);
        let number = self.slab.insert(sighting, revision);
        if let Some(keyframe) = keyframes.get_mut(at, revision) {
            keyframe.sightings = number;
        }
        if let Some(keyframe) = keyframes.get_mut(shown, revision) {
            keyframe.shown = number;
        }
    }

    /// Removes a sighting; answers it.
    pub(super) fn remove(
        &mut self,
        number: u32,
        keyframes: &mut KeyframeSlab,
        revision: u64,
    ) -> Option<Sighting> {
        let sighting = self.slab.get(number)?.clone();
        let slab = &mut self.slab;
        if let Some(keyframe) = keyframes.get_mut(sighting.keyframe, revision) {
            let next = |sighting: &Sighting| sighting.next;
            let set_next = |sighting: &mut Sighting, number| sighting.next = number;
            let (head, after) = (&mut keyframe.sightings, sighting.next);
            unlink(slab, head, number, after, revision, next, set_next);
        }
        if let Some(keyframe) = keyframes.get_mut(sighting.shown_keyframe(), revision) {
            let next = |sighting: &Sighting| sighting.next_shown;
            let set_next = |sighting: &mut Sighting, number| sighting.next_shown = number;
            let (head, after) = (&mut keyframe.shown, sighting.next_shown);
            unlink(slab, head, number, after, revision, next, set_next);
        }
        self.slab.remove(number, revision);
        if let Seen::Landmark(landmark) = sighting.shown {
            self.landmarks.release(landmark, revision);
        }
        Some(sighting)
    }

    /// Takes a sighting out to move it: its landmark stays in memory.
    pub(super) fn take(
        &mut self,
        number: u32,
        keyframes: &mut KeyframeSlab,
        revision: u64,
    ) -> Option<Sighting> {
        if let Seen::Landmark(landmark) = self.slab.get(number)?.shown {
            self.landmarks.count(landmark, revision);
        }
        self.remove(number, keyframes, revision)
    }

    /// Merges landmarks: of each pair of names the first is given up. Walks all sightings.
    pub(super) fn merge_landmarks(&mut self, names: &[(Label, Label)], revision: u64) {
        let renamed = |shown: &Seen| {
            let Seen::Landmark(number) = shown else {
                return None;
            };
            let label = &self.landmarks.slots.get(*number)?.label;
            let (_, name) = names.iter().find(|(other, _)| other == label)?;
            Some((*number, name))
        };
        let moved = self.slab.iter();
        let moved = moved.filter_map(|(at, one)| Some((at, renamed(&one.shown)?)));
        let moved: Vec<(u32, (u32, &Label))> = moved.collect();
        for (at, (before, name)) in moved {
            let Some(after) = self.landmarks.show(name, revision) else {
                return;
            };
            if let Some(sighting) = self.slab.get_mut(at, revision) {
                sighting.shown = Seen::Landmark(after);
            }
            self.landmarks.release(before, revision);
        }
    }

    /// Whether all numbers lead somewhere, and each sighting is in its lists.
    pub(super) fn is_sound(&self, keyframes: &KeyframeSlab) -> bool {
        self.slab.is_sound()
            && self.landmarks.slots.is_sound()
            && self.lists_are_sound(keyframes) == Some(true)
    }

    /// `None` where a number leads nowhere, or a list has no end.
    fn lists_are_sound(&self, keyframes: &KeyframeSlab) -> Option<bool> {
        let (mut made, mut shown, mut agents_shown) = (0, 0, 0);
        let mut of_landmark = vec![0; self.landmarks.slots.numbers() as usize];
        for (number, keyframe) in keyframes.iter() {
            let mut at = keyframe.sightings;
            while at != NONE {
                let sighting = self.slab.get(at);
                let sighting = sighting.filter(|sighting| sighting.keyframe == number)?;
                match sighting.shown {
                    Seen::Agent(..) => agents_shown += 1,
                    Seen::Landmark(landmark) => *of_landmark.get_mut(landmark as usize)? += 1,
                }
                made += 1;
                if made > self.slab.len() {
                    return None;
                }
                at = sighting.next;
            }
            let mut at = keyframe.shown;
            while at != NONE {
                let shows = |sighting: &&Sighting| sighting.shown_keyframe() == number;
                let sighting = self.slab.get(at).filter(shows)?;
                shown += 1;
                if shown > self.slab.len() {
                    return None;
                }
                at = sighting.next_shown;
            }
        }
        let mut landmarks = self.landmarks.slots.iter();
        let are_counted =
            landmarks.all(|(number, landmark)| of_landmark[number as usize] == landmark.sightings);
        Some(made == self.slab.len() && shown == agents_shown && are_counted)
    }
}
