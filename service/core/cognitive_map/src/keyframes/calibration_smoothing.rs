//! Smoothing of odometry's calibration over the past.

use nalgebra::{Isometry3, SVector};

use super::chains::Chains;
use super::keyframe::Keyframe;
use crate::estimator::Calibration;

impl Chains {
    /// The motions to all keyframes, by number, corrected by odometry's lasting errors as they are
    /// known now.
    ///
    /// When a robot set out, these errors were hardly known, so its first motions are the most
    /// wrong, all in one direction, and the whole map turns with them. The errors are smoothed
    /// backward along each chain, component by component (Rauch, Tung & Striebel 1965), with their
    /// variance P at a keyframe and process noise Q from there to the next one:
    ///
    /// ```text
    /// ĉ_k = c_k + P / (P + Q) · (ĉ_{k+1} − c_k)
    /// ```
    pub(super) fn recalibrated(&self) -> Vec<Isometry3<f64>> {
        let mut motions = vec![Isometry3::identity(); self.keyframes.numbers() as usize];
        for track in self.tracks.iter() {
            let mut later = track.calibrated.calibration.components();
            let mut wander = track.calibrated.wander;
            for (number, keyframe) in self.back_from(track.newest) {
                later = smoothed(keyframe, &later, &wander);
                let calibration = Calibration::of_components(&later);
                motions[number as usize] = keyframe
                    .calibrated
                    .corrected_by(&keyframe.motion, &calibration);
                wander = keyframe.calibrated.wander;
            }
        }
        motions
    }
}

/// The smoothed errors at a keyframe, from those at the next one.
fn smoothed(
    keyframe: &Keyframe,
    later: &SVector<f64, 5>,
    wander: &SVector<f64, 5>,
) -> SVector<f64, 5> {
    let then = keyframe.calibrated.calibration.components();
    let gain = keyframe
        .calibrated
        .variance
        .zip_map(wander, |known, wander| {
            if known > 0.0 {
                known / (known + wander)
            } else {
                0.0
            }
        });
    then + gain.component_mul(&(later - then))
}
