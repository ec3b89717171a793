//! What odometry got wrong in the past, by what is known of it now.

use nalgebra::{Isometry3, SVector};

use super::anchor::Anchor;
use super::graph::KeyframeGraph;
use crate::estimator::Calibration;

impl KeyframeGraph {
    /// The motions to all anchors, by number, corrected by what is known now of their odometry's lasting errors.
    ///
    /// When a robot set out, little was known of them, so its first motions are the most wrong, all in one direction, and
    /// the whole map turns with them. The errors are smoothed backward along each chain, each for itself (Rauch, Tung &
    /// Striebel 1965), with variance P as it was known at an anchor and wander Q from there to the next one:
    ///
    /// ```text
    /// ĉ_k = c_k + P / (P + Q) · (ĉ_{k+1} − c_k)
    /// ```
    pub(super) fn recalibrated(&self) -> Vec<Isometry3<f64>> {
        let mut motions = vec![Isometry3::identity(); self.anchors.numbers() as usize];
        for life in self.lives.iter() {
            let mut later = life.calibrated.calibration.components();
            let mut wander = life.calibrated.wander;
            let mut number = life.newest;
            while let Some(anchor) = self.anchors.get(number) {
                later = smoothed(anchor, &later, &wander);
                let calibration = Calibration::of_components(&later);
                motions[number as usize] =
                    anchor.calibrated.corrected_by(&anchor.motion, &calibration);
                wander = anchor.calibrated.wander;
                number = anchor.previous;
            }
        }
        motions
    }
}

/// The errors at an anchor, from those later.
fn smoothed(anchor: &Anchor, later: &SVector<f64, 5>, wander: &SVector<f64, 5>) -> SVector<f64, 5> {
    let then = anchor.calibrated.calibration.components();
    let gain = anchor.calibrated.variance.zip_map(wander, |known, wander| {
        if known > 0.0 {
            known / (known + wander)
        } else {
            0.0
        }
    });
    then + gain.component_mul(&(later - then))
}
