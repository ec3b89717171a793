//! The landmarks of sightings, by number and by label.

use crate::input::Label;
use crate::label_index::LabelIndex;
use state::state_of_struct;
use state::{NONE, Slab};

/// Landmarks by number.
pub(super) type LandmarkSlab = Slab<Landmark, 64>;

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
    pub(super) slots: LandmarkSlab,
    /// Not part of a checkpoint.
    by_label: LabelIndex,
}

impl Landmarks {
    /// Counts a sighting of a landmark; answers its number.
    pub(super) fn show(&mut self, label: &Label, revision: u64) -> Option<u32> {
        if let Some(number) = self.number(label) {
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

    /// Number of the landmark with a label.
    pub(super) fn number(&self, label: &Label) -> Option<u32> {
        self.by_label
            .find(label.as_str(), |number| label_in(&self.slots, number))
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
        let slots = &self.slots;
        self.by_label
            .remove(number, |number| label_in(slots, number));
        self.slots.remove(number, revision);
    }

    /// Builds the order by label of what a checkpoint held; answers whether no label comes twice.
    pub(super) fn sort(&mut self) -> bool {
        self.by_label = LabelIndex::default();
        let numbers: Vec<u32> = self.slots.iter().map(|(number, _)| number).collect();
        for number in numbers {
            self.sort_in(number);
        }
        let label_of = |number| label_in(&self.slots, number);
        let labels = self.by_label.after(None, label_of).map(label_of);
        labels.is_sorted_by(|one, next| one < next)
    }

    /// Puts a landmark where its label belongs.
    fn sort_in(&mut self, number: u32) {
        let slots = &self.slots;
        self.by_label
            .insert(number, |number| label_in(slots, number));
    }
}

/// The label of a landmark.
fn label_in(slots: &LandmarkSlab, number: u32) -> &str {
    let landmark = slots.get(number);
    landmark.map_or("", |landmark| landmark.label.as_str())
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
