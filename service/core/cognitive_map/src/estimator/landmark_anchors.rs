//! What ties a landmark that leaves the joint estimate to others that stay.
//!
//! Landmarks that lie near one another share most of their errors: what a robot was off by when it
//! came there. *Anchors* are landmarks of a frame, spread over it, that stay in the joint estimate.
//! Of a landmark that leaves, it is kept what its nearest anchors say of it, with the errors e and
//! aₖ, and what they leave open:
//!
//! ```text
//! e = Σ Gₖ aₖ + r      G = P_ea P_aa⁻¹      R = P_ee − G P_ae
//! ```
//!
//! When it comes back, its error goes with theirs again, and what has moved them since has moved
//! it. Taken for independent instead, landmarks that left and came back would make everybody surer
//! each time.

use nalgebra::{Matrix3, SMatrix};

use super::archived_landmark::Tie;
use super::frame::{Frame, LANDMARK_DIM, LandmarkState};
use super::tuning::{ANCHORS_MAX, TIE_VARIANCE_MIN_M2, TIE_VARIANCE_SHARE, TIES_MAX};
use crate::input::Label;
use geometry::{positive, symmetric};

/// Components of the anchors of a landmark.
const TIES_DIM: usize = TIES_MAX * LANDMARK_DIM;

impl Frame {
    /// What a landmark's nearest anchors say of its error, and the covariance of what they leave
    /// open.
    pub(super) fn ties(&self, landmark: &LandmarkState) -> (Vec<Tie>, Matrix3<f64>) {
        let apart_m2 = |one: &LandmarkState| (one.position - landmark.position).norm_squared();
        let mut anchors: Vec<(&Label, &LandmarkState)> = self.anchors().collect();
        anchors.retain(|(_, anchor)| anchor.number != landmark.number);
        anchors.sort_by(|(_, one), (_, other)| apart_m2(one).total_cmp(&apart_m2(other)));
        anchors.truncate(TIES_MAX);
        let own = self.landmark_covariance(landmark);
        let mut of_anchors = SMatrix::<f64, TIES_DIM, TIES_DIM>::identity();
        let mut across = SMatrix::<f64, LANDMARK_DIM, TIES_DIM>::zeros();
        for (k, (_, one)) in anchors.iter().enumerate() {
            let row = k * LANDMARK_DIM;
            let block: Matrix3<f64> = self.covariance.block(landmark.offset, one.offset);
            across.fixed_columns_mut::<3>(row).copy_from(&block);
            for (j, (_, other)) in anchors.iter().enumerate() {
                let block: Matrix3<f64> = self.covariance.block(one.offset, other.offset);
                let mut cell = of_anchors.fixed_view_mut::<3, 3>(row, j * LANDMARK_DIM);
                cell.copy_from(&block);
            }
            for entry in row..row + LANDMARK_DIM {
                let variance = of_anchors[(entry, entry)];
                of_anchors[(entry, entry)] += TIE_VARIANCE_SHARE * variance + TIE_VARIANCE_MIN_M2;
            }
        }
        let Some(lower) = of_anchors.cholesky() else {
            return (Vec::new(), own);
        };
        let gain = lower.solve(&across.transpose()).transpose();
        let rest = positive(&symmetric(&(own - gain * across.transpose())));
        let tie = |(k, (label, anchor)): (usize, (&Label, &LandmarkState))| Tie {
            anchor: label.clone(),
            number: anchor.number,
            position: anchor.position,
            covariance: self.landmark_covariance(anchor),
            gain: gain.fixed_columns::<3>(k * LANDMARK_DIM).into_owned(),
        };
        (anchors.into_iter().enumerate().map(tie).collect(), rest)
    }

    fn anchors(&self) -> impl Iterator<Item = (&Label, &LandmarkState)> {
        let landmarks = self.landmarks.iter();
        landmarks.filter(|(_, landmark)| landmark.is_anchor)
    }

    /// Whether a landmark that is about to leave should rather stay as an anchor, and which one is
    /// none any more then: one of the two that are closest to one another, if the landmark is
    /// farther from all. One that was seen once may not be there.
    pub(super) fn as_anchor(&self, landmark: &LandmarkState) -> Option<AnchorChange> {
        if !landmark.evidence.is_confirmed {
            return None;
        }
        let anchors: Vec<(&Label, &LandmarkState)> = self.anchors().collect();
        if anchors.len() < ANCHORS_MAX {
            return Some(AnchorChange { instead_of: None });
        }
        let apart_m2 = |one: &LandmarkState, other: &LandmarkState| {
            (one.position - other.position).norm_squared()
        };
        let nearest = anchors.iter().map(|(_, anchor)| apart_m2(anchor, landmark));
        let nearest_m2 = nearest.fold(f64::INFINITY, f64::min);
        let pairs = anchors.iter().enumerate().flat_map(|(k, one)| {
            let others = anchors[..k].iter();
            others.map(move |other| (apart_m2(one.1, other.1), one, other))
        });
        let (closest_m2, one, other) = pairs.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let older = if one.1.used < other.1.used {
            one
        } else {
            other
        };
        (nearest_m2 > closest_m2).then(|| AnchorChange {
            instead_of: Some(older.0.clone()),
        })
    }
}

/// A landmark becomes an anchor.
#[derive(Clone, Debug)]
pub(super) struct AnchorChange {
    /// The one that is none any more.
    pub(super) instead_of: Option<Label>,
}
