//! The landmarks of which an agent knows nothing but distances.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::doubtful_motion::DoubtfulMotion;
use super::outcome::Step;
use super::range_hypotheses::{RangeHypotheses, RangedPoint};
use super::range_places::OdometryKind;
use super::tuning::RANGED_MAX;
use crate::input::{Label, Range};

/// Where the landmarks may be of which an agent knows nothing but distances. A clone shares them.
#[derive(Clone, Debug, Default)]
pub(super) struct Ranging {
    pub(super) landmarks: Arc<BTreeMap<Label, RangeHypotheses>>,
    /// Motion since the latest distance to any of them.
    pub(super) since: DoubtfulMotion,
    /// Distances taken in.
    pub(super) taken: u64,
}

impl Ranging {
    /// The agent moved.
    #[inline]
    pub(super) fn go(&mut self, step: &Step) {
        if !self.landmarks.is_empty() {
            let assumed = step.assumed_turn.as_ref();
            self.since.append(&step.increment, &step.variance, assumed);
        }
    }

    /// Forgets them all: how the agent moved is not known.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Forgets a landmark, whose position is known.
    pub(super) fn forget(&mut self, label: &Label) {
        if self.landmarks.contains_key(label) {
            Arc::make_mut(&mut self.landmarks).remove(label);
        }
    }

    /// A distance to a landmark, with its variance \[m²\]; answers where the landmark is, once that
    /// is known.
    pub(super) fn take_in(
        &mut self,
        label: &Label,
        range: &Range,
        variance: f64,
        odometry: OdometryKind,
    ) -> Option<RangedPoint> {
        self.taken += 1;
        let landmarks = Arc::make_mut(&mut self.landmarks);
        let since = std::mem::take(&mut self.since);
        for landmark in landmarks.values_mut() {
            landmark.motion.extend(&since);
        }
        if let Some(landmark) = landmarks.get_mut(label) {
            landmark.update(range, variance, odometry);
            landmark.used = self.taken;
            return landmark.decide(range, variance, odometry);
        }
        if landmarks.len() >= RANGED_MAX {
            let oldest = landmarks.iter().min_by_key(|(_, landmark)| landmark.used);
            if let Some(oldest) = oldest.map(|(label, _)| label.clone()) {
                landmarks.remove(&oldest);
            }
        }
        let mut landmark = RangeHypotheses::new(range, variance, odometry);
        landmark.used = self.taken;
        landmarks.insert(label.clone(), landmark);
        None
    }
}
