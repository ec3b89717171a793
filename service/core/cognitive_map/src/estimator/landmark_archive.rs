//! Landmarks that left the joint estimate.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::archived_landmark::ArchivedLandmark;
use super::tuning::{ARCHIVE_PART_MAX, ARCHIVE_PARTS};
use crate::input::Label;
use ::state::PagedVec;

/// One part.
pub(super) type Part = BTreeMap<Label, ArchivedLandmark>;

/// The landmarks that left a joint estimate, a bounded number. A clone shares them.
#[derive(Clone, Debug, Default)]
pub(super) struct LandmarkArchive {
    /// None, or as many as there are.
    parts: PagedVec<Arc<Part>, 32>,
}

impl LandmarkArchive {
    /// Archives a landmark.
    pub(super) fn insert(&mut self, label: Label, landmark: ArchivedLandmark) {
        while self.parts.len() < ARCHIVE_PARTS {
            self.parts.push(Arc::default(), 0);
        }
        let Some(part) = self.parts.get_mut(part_of(&label), 0) else {
            return;
        };
        let part = Arc::make_mut(part);
        if part.len() >= ARCHIVE_PART_MAX && !part.contains_key(&label) {
            let oldest = part.iter().min_by_key(|(_, landmark)| landmark.left);
            if let Some(oldest) = oldest.map(|(label, _)| label.clone()) {
                part.remove(&oldest);
            }
        }
        part.insert(label, landmark);
    }

    /// Archives a landmark that comes after all others in their order; answers whether it does, and
    /// whether there was room.
    pub(super) fn append(&mut self, label: Label, landmark: ArchivedLandmark) -> bool {
        let number = part_of(&label);
        let later = self.parts.iter_from(number + 1).all(|part| part.is_empty());
        let fits = self.parts.get(number).is_none_or(|part| {
            part.len() < ARCHIVE_PART_MAX
                && part.last_key_value().is_none_or(|(last, _)| *last < label)
        });
        let is_next = later && fits;
        if is_next {
            self.insert(label, landmark);
        }
        is_next
    }

    /// Forgets that an agent was the one that had seen landmarks. Walks them all.
    pub(super) fn forget_observer(&mut self, agent: u32) {
        let is_its = |landmark: &ArchivedLandmark| landmark.only == Some(agent);
        for number in 0..self.parts.len() {
            let part = self.parts.get(number);
            if !part.is_some_and(|part| part.values().any(is_its)) {
                continue;
            }
            if let Some(part) = self.parts.get_mut(number, 0) {
                let landmarks = Arc::make_mut(part).values_mut();
                landmarks
                    .filter(|landmark| is_its(landmark))
                    .for_each(|landmark| landmark.only = None);
            }
        }
    }

    /// A landmark that sleeps here.
    pub(super) fn get(&self, label: &Label) -> Option<&ArchivedLandmark> {
        self.parts.get(part_of(label))?.get(label)
    }

    /// Whether a landmark sleeps here.
    pub(super) fn contains(&self, label: &Label) -> bool {
        let part = self.parts.get(part_of(label));
        part.is_some_and(|part| part.contains_key(label))
    }

    /// Takes a landmark out.
    pub(super) fn remove(&mut self, label: &Label) -> Option<ArchivedLandmark> {
        if !self.contains(label) {
            return None;
        }
        Arc::make_mut(self.parts.get_mut(part_of(label), 0)?).remove(label)
    }

    /// All, in an order of their own.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&Label, &ArchivedLandmark)> {
        self.parts.iter().flat_map(|part| part.iter())
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.parts.iter().map(|part| part.len()).sum()
    }
}

/// Which part a label belongs to: FNV-1a over its bytes.
fn part_of(label: &Label) -> usize {
    let hash = label
        .as_str()
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3_u64)
        });
    // The high bits depend on every byte, too.
    usize::try_from((hash ^ (hash >> 32)) % ARCHIVE_PARTS as u64).expect("fewer than 1024")
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Point3};

    use super::super::landmark_evidence::LandmarkEvidence;
    use super::*;

    fn landmark(left: u64) -> ArchivedLandmark {
        ArchivedLandmark {
            number: left,
            position: Point3::new(left as f64, 0.0, 0.0),
            covariance: Matrix3::identity(),
            ties: Vec::new(),
            rest: Matrix3::identity(),
            left,
            only: None,
            evidence: LandmarkEvidence::default(),
        }
    }

    fn label(number: u64) -> Label {
        Label::new(&format!("post-{number}")).unwrap()
    }

    #[test]
    fn a_bounded_number_is_kept_and_the_latest_ones_are() {
        let mut landmarks = LandmarkArchive::default();
        for number in 0..100_000 {
            landmarks.insert(label(number), landmark(number));
        }
        assert!(
            landmarks.len() <= ARCHIVE_PARTS * ARCHIVE_PART_MAX
                && landmarks.len() > ARCHIVE_PARTS * ARCHIVE_PART_MAX * 9 / 10
        );
        let latest = (60_000..100_000).filter(|&number| landmarks.contains(&label(number)));
        assert!(latest.count() > 39_000);
        let earliest = (0..20_000).filter(|&number| landmarks.contains(&label(number)));
        assert!(earliest.count() < 1000);
    }

    #[test]
    fn a_snapshot_stays_as_it_was() {
        let mut landmarks = LandmarkArchive::default();
        for number in 0..500 {
            landmarks.insert(label(number), landmark(number));
        }
        let snapshot = landmarks.clone();
        assert_eq!(landmarks.remove(&label(7)), Some(landmark(7)));
        assert_eq!(landmarks.remove(&label(7)), None);
        landmarks.insert(label(900), landmark(900));
        assert!(snapshot.contains(&label(7)) && !snapshot.contains(&label(900)));
        assert_eq!((snapshot.len(), landmarks.len()), (500, 500));
    }
}
