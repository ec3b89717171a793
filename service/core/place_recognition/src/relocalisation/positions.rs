//! Positions from which the remembered views were taken, as the map has them now.

use std::cell::RefCell;
use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::keyframes::{Keyframes, SampleKey};

/// Positions in the map of samples, each looked up once for a question.
pub(crate) struct Positions<'a> {
    keyframes: &'a dyn Keyframes,
    known: RefCell<BTreeMap<SampleKey, Option<Point3<f64>>>>,
}

impl<'a> Positions<'a> {
    pub(crate) fn of(keyframes: &'a dyn Keyframes) -> Self {
        Self {
            keyframes,
            known: RefCell::default(),
        }
    }

    /// Position at a sample; `None` where that is forgotten, or not in the map.
    pub(super) fn at(&self, sample: SampleKey) -> Option<Point3<f64>> {
        if let Some(known) = self.known.borrow().get(&sample) {
            return *known;
        }
        let pose = self.keyframes.pose_at(sample);
        let found = pose.map(|pose| pose.translation.vector.into());
        self.known.borrow_mut().insert(sample, found);
        found
    }
}
