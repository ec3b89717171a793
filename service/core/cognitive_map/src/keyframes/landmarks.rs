//! The landmarks of sightings, by number and by label.

use std::sync::Arc;

use crate::input::Label;
use state::state_of_struct;
use state::{NONE, Slab};

/// Landmarks per page.
pub(super) const PAGE: usize = 64;
/// Most landmarks in a run of the order by label; a longer run is halved.
const RUN_MAX: usize = 256;

/// A landmark.
#[derive(Clone, Debug)]
pub(super) struct Landmark {
    pub(super) label: Label,
    /// Sightings that show it.
    pub(super) sightings: u32,
}

state_of_struct!(Landmark { label, sightings });

/// The landmarks, each kept as long as its sightings.
#[derive(Clone, Debug, Default)]
pub(super) struct Landmarks {
    pub(super) slots: Slab<Landmark, PAGE>,
    /// The numbers in the order of the labels, in runs, none of them empty; not part of a
    /// checkpoint.
    by_label: Arc<Vec<Arc<Vec<u32>>>>,
}

impl Landmarks {
    /// Counts a sighting of a landmark; answers its number.
    pub(super) fn show(&mut self, label: &Label, revision: u64) -> Option<u32> {
        let run = self.run_of(label);
        let members = self.by_label.get(run).map_or(&[][..], |run| &run[..]);
        let place = members.partition_point(|&number| self.label(number) < Some(label));
        if let Some(&number) = members.get(place)
            && self.label(number) == Some(label)
        {
            self.count(number, revision);
            return Some(number);
        }
        let landmark = Landmark {
            label: label.clone(),
            sightings: 1,
        };
        let number = self.slots.insert(landmark, revision);
        if number == NONE {
            return None;
        }
        self.sort_in(number);
        Some(number)
    }

    /// Counts another sighting of a known landmark.
    pub(super) fn count(&mut self, number: u32, revision: u64) {
        if let Some(landmark) = self.slots.get_mut(number, revision) {
            landmark.sightings += 1;
        }
    }

    /// Counts a sighting less; without any the landmark is removed.
    pub(super) fn release(&mut self, number: u32, revision: u64) {
        let Some(landmark) = self.slots.get_mut(number, revision) else {
            return;
        };
        landmark.sightings = landmark.sightings.saturating_sub(1);
        if landmark.sightings > 0 {
            return;
        }
        let label = landmark.label.clone();
        let run = self.run_of(&label);
        let runs = Arc::make_mut(&mut self.by_label);
        if let Some(members) = runs.get_mut(run) {
            let members = Arc::make_mut(members);
            members.retain(|&member| member != number);
            if members.is_empty() {
                runs.remove(run);
            }
        }
        self.slots.remove(number, revision);
    }

    /// Builds the order by label of what a checkpoint held; answers whether no label comes twice.
    pub(super) fn sort(&mut self) -> bool {
        self.by_label = Arc::default();
        let numbers: Vec<u32> = self.slots.iter().map(|(number, _)| number).collect();
        for number in numbers {
            self.sort_in(number);
        }
        let all: Vec<u32> = self
            .by_label
            .iter()
            .flat_map(|run| run.iter().copied())
            .collect();
        all.windows(2)
            .all(|pair| self.label(pair[0]) < self.label(pair[1]))
    }

    fn label(&self, number: u32) -> Option<&Label> {
        self.slots.get(number).map(|landmark| &landmark.label)
    }

    /// The run in which a label belongs: the last one that does not start after it.
    fn run_of(&self, label: &Label) -> usize {
        let starts_up_to = |run: &Arc<Vec<u32>>| {
            run.first()
                .is_some_and(|&first| self.label(first) <= Some(label))
        };
        self.by_label
            .partition_point(starts_up_to)
            .saturating_sub(1)
    }

    /// Puts a landmark where its label belongs.
    fn sort_in(&mut self, number: u32) {
        let Some(label) = self.label(number) else {
            return;
        };
        let run = self.run_of(label);
        if self.by_label.is_empty() {
            Arc::make_mut(&mut self.by_label).push(Arc::new(vec![number]));
            return;
        }
        let place = self.by_label[run].partition_point(|&other| self.label(other) < Some(label));
        let runs = Arc::make_mut(&mut self.by_label);
        let members = Arc::make_mut(&mut runs[run]);
        members.insert(place, number);
        if members.len() > RUN_MAX {
            let upper = members.split_off(members.len() / 2);
            runs.insert(run + 1, Arc::new(upper));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn behaves_like_a_map(
            steps in prop::collection::vec(("[a-c]{1,5}", any::<bool>()), 0..900),
        ) {
            let mut landmarks = Landmarks::default();
            let mut plain: BTreeMap<String, (u32, u32)> = BTreeMap::new();
            for (text, shows) in steps {
                let label = Label::new(&text).unwrap();
                if shows {
                    let number = landmarks.show(&label, 1).unwrap();
                    let known = plain.entry(text).or_insert((number, 0));
                    prop_assert_eq!(known.0, number);
                    known.1 += 1;
                } else if let Some(&(number, count)) = plain.get(&text) {
                    landmarks.release(number, 1);
                    if count == 1 {
                        plain.remove(&text);
                    } else {
                        plain.insert(text, (number, count - 1));
                    }
                }
            }
            prop_assert_eq!(landmarks.slots.len(), plain.len());
            for (text, (number, count)) in plain {
                let landmark = landmarks.slots.get(number).unwrap();
                prop_assert_eq!((landmark.label.as_str(), landmark.sightings), (&text[..], count));
            }
            prop_assert!(landmarks.slots.is_sound() && landmarks.sort());
        }
    }
}
