//! Revisits: an agent has come where it, or another one, has been before.

use geometry::{PoseCovariance, se3, symmetric};
use nalgebra::{Isometry3, Matrix6, Point3};

use super::PlaceRecognition;
use crate::appearance::{
    AlignedPose, LocalQuery, Prior, ReferenceView, ReferenceViews, ViewAlignment, mixture, weighted,
};
use crate::keyframes::{Keyframes, SampleKey};
use crate::sequences::{SequenceMatch, align_roughly};
use crate::tuning::{ranges, revisit as tuning};
use crate::view::{View, spread};
use crate::views::Kernel;

/// Two samples of one place, with their relative pose.
#[derive(Clone, Copy, Debug)]
pub struct Revisit {
    /// A sample of the present stretch.
    pub now: SampleKey,
    /// A sample of the earlier stretch.
    pub then: SampleKey,
    /// Pose at the earlier sample in the frame of the body at the present one.
    pub transform: Isometry3<f64>,
    /// Covariance of the error on the right of the transform.
    pub covariance: PoseCovariance,
}

impl PlaceRecognition {
    /// Remembers what an agent in the map sees, where single views say too little for revisits.
    pub fn remember(&mut self, view: &View<'_>) {
        self.views.add(view, self.revision);
    }

    /// Remembers what an agent in the map sees. Answers the revisits that end with this view: an
    /// earlier stretch was seen along the present one, and many views agree.
    pub fn view(&mut self, view: &View<'_>, keyframes: &dyn Keyframes) -> Vec<Revisit> {
        let ended = self.views.add(view, self.revision);
        let revisits = ended.iter();
        revisits
            .filter_map(|matched| self.revisit(matched, view, keyframes))
            .collect()
    }

    /// The relative pose of both stretches of a sequence match, if that says something new.
    fn revisit(
        &self,
        matched: &SequenceMatch,
        view: &View<'_>,
        keyframes: &dyn Keyframes,
    ) -> Option<Revisit> {
        let (now, then) = (matched.now.sample, matched.then.sample);
        let expected = keyframes.motion_between(now, then)?;
        let either = [0, 1].map(|k| matched.now.spread[k].hypot(matched.then.spread[k]));
        // A place far away that only looks similar is dismissed before the alignment, which costs
        // more.
        let reach_m = self.views.reach_m(matched.channel()).unwrap_or(0.0);
        if expected.translation.vector.norm() > tuning::AWAY * either[0] + 2.0 * reach_m {
            return None;
        }
        let is_planar = keyframes.is_planar(now.agent);
        let (transform, covariance) = self.align(matched, &expected, either, is_planar)?;
        if view.spread()[0] * tuning::SURER < spread(&covariance)[0] {
            return None;
        }
        Some(Revisit {
            now,
            then,
            transform,
            covariance,
        })
    }

    /// Aligns the present stretch of a sequence match with the views of the earlier one; answers
    /// the earlier frame in the present one, with the covariance of the error on the right.
    /// `spread` is the deviation of that before \[m, rad\].
    fn align(
        &self,
        matched: &SequenceMatch,
        expected: &Isometry3<f64>,
        spread: [f64; 2],
        is_planar: bool,
    ) -> Option<(Isometry3<f64>, PoseCovariance)> {
        let kernel = self.views.kernel(matched.channel())?;
        let alignment = self.stretch_alignment(matched, kernel, is_planar);
        let information = Prior::inverse_variances(spread);
        let prior = Prior {
            pose: Some(expected.inverse()),
            information: Matrix6::from_diagonal(&information),
            open: Prior::unknown(kernel.length_m),
        };
        let mut aligned: Vec<(AlignedPose, f64)> = align_roughly(matched, expected, spread)
            .iter()
            .filter_map(|start| alignment.align(&start.inverse(), &prior))
            .map(|aligned| {
                let off = se3::twist(&(expected * aligned.pose));
                let cost = off.dot(&information.component_mul(&off));
                (aligned, cost)
            })
            .filter(|(aligned, cost)| {
                aligned.evidence.total() > tuning::AGREE && *cost < ranges::NEAR
            })
            .collect();
        let best = aligned
            .iter()
            .map(|(aligned, cost)| aligned.evidence.total() - 0.5 * cost)
            .max_by(f64::total_cmp)?;
        for (aligned, cost) in &mut aligned {
            *cost = (aligned.evidence.total() - 0.5 * *cost - best).exp();
        }
        let (pose, covariance) = mixture(&weighted(&aligned));
        // The error ξ of T = T̂ exp(ξ) is −Ad(T̂) ξ of its inverse.
        let adjoint = se3::adjoint(&pose);
        let covariance = symmetric(&(adjoint * covariance * adjoint.transpose()));
        Some((pose.inverse(), PoseCovariance::from_matrix(&covariance)))
    }

    /// The views of the present stretch among those of the earlier one, each stretch in its own
    /// frame.
    fn stretch_alignment<'a>(
        &'a self,
        matched: &'a SequenceMatch,
        kernel: Kernel,
        is_planar: bool,
    ) -> ViewAlignment<'a, impl Fn(&[Point3<f64>]) -> ReferenceViews<'a>> {
        let (now, then) = (
            matched.now.in_odom.inverse(),
            matched.then.in_odom.inverse(),
        );
        let views: ReferenceViews<'a> = { self.views.beside(matched) }
            .map(|view| {
                let at = then * Point3::from(view.in_odom.translation.vector);
                let vector = &*view.vector;
                (view.channel, ReferenceView { at, vector })
            })
            .collect();
        let queries = matched.queries.iter().map(|query| LocalQuery {
            at: now * Point3::from(query.in_odom.translation.vector),
            drift_m: 0.0,
            channel: matched.channel(),
            kernel: Some(kernel),
            vector: &query.vector,
        });
        ViewAlignment {
            queries: queries.collect(),
            views: move |_: &[Point3<f64>]| views.clone(),
            is_planar,
        }
    }
}
