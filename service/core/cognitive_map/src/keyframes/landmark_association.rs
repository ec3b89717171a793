//! Association of landmarks that are known by two names.

use super::KeyframeGraph;
use super::sighting::Seen;
use crate::input::Label;

impl KeyframeGraph {
    /// Merges landmarks: of each pair of names the first is given up. Walks all sightings.
    pub fn merge_landmarks(&mut self, names: &[(Label, Label)]) {
        let revision = self.revision;
        let renamed = |shown: &Seen| {
            let Seen::Landmark(number) = shown else {
                return None;
            };
            let label = &self.landmarks.slots.get(*number)?.label;
            let (_, name) = names.iter().find(|(other, _)| other == label)?;
            Some((*number, name))
        };
        let sightings = self.sightings.iter();
        let moved = sightings.filter_map(|(at, one)| Some((at, renamed(&one.shown)?)));
        let moved: Vec<(u32, (u32, &Label))> = moved.collect();
        for (at, (before, name)) in moved {
            let Some(after) = self.landmarks.show(name, revision) else {
                return;
            };
            if let Some(sighting) = self.sightings.get_mut(at, revision) {
                sighting.shown = Seen::Landmark(after);
            }
            self.landmarks.release(before, revision);
        }
    }
}
