//! The landmarks of a space, by number and by label.

use super::{Landmark, LandmarkId, PositionEstimate};
use crate::input::Label;
use crate::label_index::LabelIndex;
use state::CorruptState;
use state::PagedVec;

/// Landmarks per page.
const PAGE: usize = 64;

/// All landmarks, in the order of learning.
#[derive(Clone, Debug, Default)]
pub(crate) struct LandmarkMap {
    landmarks: PagedVec<Landmark, PAGE>,
    by_label: LabelIndex,
}

impl LandmarkMap {
    /// The landmarks.
    pub(crate) fn landmarks(&self) -> &PagedVec<Landmark, PAGE> {
        &self.landmarks
    }

    /// A landmark.
    pub(crate) fn get(&self, landmark: LandmarkId) -> Option<&Landmark> {
        self.landmarks.get(landmark.0 as usize)
    }

    /// The landmark with a label.
    pub(crate) fn by_label(&self, label: &str) -> Option<LandmarkId> {
        let label_of = |number| label_in(&self.landmarks, number);
        self.by_label.find(label, label_of).map(LandmarkId)
    }

    /// The landmarks in the order of their labels, from the first one whose label is larger.
    pub(crate) fn after(&self, label: Option<&str>) -> impl Iterator<Item = LandmarkId> {
        let label_of = |number| label_in(&self.landmarks, number);
        self.by_label.after(label, label_of).map(LandmarkId)
    }

    /// Learns a landmark whose label is not known yet. None when there are 2³² already.
    pub(crate) fn learn(&mut self, landmark: Landmark, revision: u64) -> Option<LandmarkId> {
        let id = LandmarkId(u32::try_from(self.landmarks.len()).ok()?);
        self.landmarks.push(landmark, revision);
        self.sort_in(id.0);
        Some(id)
    }

    /// A landmark was seen again.
    pub(crate) fn see(&mut self, landmark: LandmarkId, stamp_ns: i64, agent: u32, revision: u64) {
        if let Some(landmark) = self.landmarks.get_mut(landmark.0 as usize, revision) {
            landmark.see(stamp_ns, agent);
        }
    }

    /// A landmark turned out to be one that has another name: it was seen as often as both.
    pub(crate) fn unite(&mut self, label: &Label, name: &Label, revision: u64) {
        let both = [label, name].map(|label| self.by_label(label.as_str()));
        if let [Some(one), Some(other)] = both
            && let Some(seen) = self.get(one).cloned()
            && let Some(landmark) = self.landmarks.get_mut(other.0 as usize, revision)
        {
            landmark.join(&seen);
        }
    }

    /// More is known about where a landmark is.
    pub(crate) fn place(
        &mut self,
        landmark: LandmarkId,
        estimate: PositionEstimate,
        revision: u64,
    ) {
        let index = landmark.0 as usize;
        let known = self.landmarks.get(index);
        // Where nothing changes, no page is copied.
        if known.is_some_and(|known| known.estimate != estimate)
            && let Some(landmark) = self.landmarks.get_mut(index, revision)
        {
            landmark.estimate = estimate;
        }
    }

    /// Appends a checkpoint's page of landmarks; two with the same label are refused.
    pub(crate) fn push_page(&mut self, bytes: &[u8], revision: u64) -> Result<(), CorruptState> {
        let start = self.landmarks.len();
        self.landmarks.push_page(bytes, revision)?;
        for index in start..self.landmarks.len() {
            let number = u32::try_from(index).map_err(|_| CorruptState::Invalid)?;
            if self.by_label(label_in(&self.landmarks, number)).is_some() {
                return Err(CorruptState::Invalid);
            }
            self.sort_in(number);
        }
        Ok(())
    }

    /// Puts a landmark where its label belongs.
    fn sort_in(&mut self, number: u32) {
        let landmarks = &self.landmarks;
        self.by_label
            .insert(number, |number| label_in(landmarks, number));
    }
}

/// The label of a landmark.
fn label_in(landmarks: &PagedVec<Landmark, PAGE>, number: u32) -> &str {
    let landmark = landmarks.get(number as usize);
    landmark.map_or("", |landmark| landmark.label().as_str())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::Observers;
    use nalgebra::{Matrix3, Point3};
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    fn landmark(label: &str) -> Landmark {
        let estimate = PositionEstimate {
            position: Point3::origin(),
            covariance: Matrix3::identity(),
        };
        Landmark::learn(
            Label::new(label).unwrap(),
            estimate,
            0,
            Observers::default(),
        )
    }

    proptest! {
        #[test]
        fn order_equals_that_of_a_sorted_map(
            labels in prop::collection::vec("[a-c]{1,7}", 0..600),
            after in "[a-c]{0,7}",
        ) {
            let mut map = LandmarkMap::default();
            let mut sorted = BTreeMap::new();
            for label in labels {
                prop_assert_eq!(map.by_label(&label), sorted.get(&label).copied());
                let learn = || map.learn(landmark(&label), 1).unwrap();
                sorted.entry(label.clone()).or_insert_with(learn);
            }
            let all: Vec<_> = map.after(None).collect();
            prop_assert_eq!(all, sorted.values().copied().collect::<Vec<_>>());
            let rest: Vec<_> = map.after(Some(&after)).collect();
            let larger = sorted.iter().filter(|(label, _)| **label > after).map(|(_, id)| *id);
            prop_assert_eq!(rest, larger.collect::<Vec<_>>());
            for (label, id) in &sorted {
                prop_assert_eq!(map.by_label(label), Some(*id));
            }
        }
    }
}
