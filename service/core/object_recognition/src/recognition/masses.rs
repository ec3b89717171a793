//! Masses of an episode's hypotheses and objects, in one measure.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use geometry::{PoseCovariance, se3, symmetric};
use nalgebra::{Isometry3, Matrix6, Translation3, Vector3, Vector6};

use crate::library::ObjectLibrary;
use crate::numeric::log_sum;
use crate::object_id::ObjectId;
use crate::poses::PoseHypothesis;
use crate::posterior::PoseEstimate;
use crate::recognition::episode::Hypotheses;
use crate::recognition::episode::Recognition;
use crate::recognition::likelihoods::walk_log;
use crate::translations::TranslationHypothesis;
use crate::tuning::{LISTED_SHARE_MIN, LIVE_MASS, OTHER_POSES_MAX, SAME_POSE_SDS};
use crate::variant::{Variant, VariantId};

/// One hypothesis of either kind.
pub(super) struct PoseMass {
    /// Its model.
    pub(super) of: VariantId,
    pub(super) map_from_episode: Isometry3<f64>,
    covariance: Matrix6<f64>,
    /// Log of its mass.
    pub(super) log: f64,
}

impl Recognition {
    /// Log of each object's mass, in one measure.
    pub(crate) fn object_logs(&self, library: &ObjectLibrary) -> Vec<(ObjectId, f64)> {
        match &self.hypotheses {
            Hypotheses::Translations(translations) => {
                let logs = translations.variant_logs();
                let log = |(object, _)| (object, object_log(&logs, object));
                library.iter().map(log).collect()
            }
            Hypotheses::Poses(_) => sums(library, &self.pose_logs(library)),
        }
    }

    /// Logs of the factors that the masses of each model's translations have for its size, with its
    /// prior given its object.
    pub(super) fn translation_sizes(&self, library: &ObjectLibrary) -> BTreeMap<VariantId, f64> {
        let reach_m = self.reach_m();
        let sizes = self.variant_priors.iter().filter_map(|(id, prior_log)| {
            let indexed = library.variant(*id)?;
            let aimed = self.aimed as f64 * indexed.area_m2.ln();
            let walked = walk_log(indexed, self.steps_m.len(), reach_m);
            Some((*id, prior_log + aimed + walked))
        });
        sizes.collect()
    }

    /// Log of the mass of each pose, in one measure.
    pub(super) fn pose_logs(&self, library: &ObjectLibrary) -> Vec<(ObjectId, f64)> {
        let Hypotheses::Poses(poses) = &self.hypotheses else {
            return Vec::new();
        };
        let logs = poses.all.iter().filter_map(|hypothesis| {
            let log = self.pose_log(library, hypothesis)?;
            Some((hypothesis.object, log))
        });
        logs.collect()
    }

    /// How many hypotheses hold `LIVE_MASS` of the mass of all.
    pub(super) fn live_hypotheses(&self, library: &ObjectLibrary) -> usize {
        if let Hypotheses::Translations(translations) = &self.hypotheses {
            return translations.holding(LIVE_MASS, |of| library.variant(of).is_some());
        }
        let mut logs = self.pose_logs(library);
        logs.sort_unstable_by(|a, b| b.1.total_cmp(&a.1));
        let all = log_sum(logs.iter().map(|(_, log)| *log));
        let mut sum = 0.0;
        let live = logs.iter().position(|(_, log)| {
            sum += (log - all).exp();
            sum >= LIVE_MASS
        });
        live.map_or(logs.len(), |at| at + 1)
    }

    pub(super) fn pose_log(
        &self,
        library: &ObjectLibrary,
        hypothesis: &PoseHypothesis,
    ) -> Option<f64> {
        let indexed = library.indexed(hypothesis.object)?;
        let surfel_map = indexed.surfel_map.as_ref()?;
        let count = (self.count - self.aimed) as f64;
        Some(
            hypothesis.evidence() - (8.0 * PI * PI).ln()
                + walk_log(indexed, self.steps_m.len(), self.reach_m())
                - count * surfel_map.area_m2.ln(),
        )
    }

    /// The `most` heaviest hypotheses of an object, heaviest first.
    pub(super) fn masses(
        &self,
        library: &ObjectLibrary,
        object: ObjectId,
        most: usize,
    ) -> Vec<PoseMass> {
        let Some(indexed) = library.indexed(object) else {
            return Vec::new();
        };
        match &self.hypotheses {
            Hypotheses::Translations(translations) => {
                let mass = |hypothesis: TranslationHypothesis| {
                    let mut covariance = Matrix6::zeros();
                    let mut corner = covariance.fixed_view_mut::<3, 3>(0, 0);
                    corner.fill_diagonal(hypothesis.variance_m2);
                    PoseMass {
                        of: hypothesis.of(),
                        map_from_episode: hypothesis.pose(&translations.rotations),
                        covariance,
                        log: hypothesis.evidence,
                    }
                };
                let variants = VariantId::both(object).into_iter();
                let heaviest = variants.flat_map(|id| translations.heaviest(id, most));
                let mut all = one_of_each_pose(heaviest.collect());
                all.truncate(most);
                all.into_iter().map(mass).collect()
            }
            Hypotheses::Poses(poses) => {
                let own = poses.all.iter().filter(|pose| pose.object == object);
                let masses = own.filter_map(|hypothesis| {
                    let surfel_map = indexed.surfel_map.as_ref()?;
                    let origin = Translation3::from(-poses.origin().coords);
                    let middle = Translation3::from(surfel_map.middle);
                    let lever = se3::adjoint(&middle.into());
                    Some(PoseMass {
                        of: VariantId {
                            object,
                            variant: Variant::Places,
                        },
                        map_from_episode: middle * hypothesis.pose * origin,
                        covariance: lever
                            * hypothesis.information.try_inverse()?
                            * lever.transpose(),
                        log: self.pose_log(library, hypothesis)?,
                    })
                });
                let mut masses: Vec<_> = masses.collect();
                masses.sort_by(|a, b| b.log.total_cmp(&a.log));
                masses.truncate(most);
                masses
            }
        }
    }

    /// Log of the mass of all hypotheses of an object, in the measure of [`masses`](Self::masses).
    pub(super) fn mass_log(&self, library: &ObjectLibrary, object: ObjectId) -> f64 {
        match &self.hypotheses {
            Hypotheses::Translations(translations) => {
                object_log(&translations.variant_logs(), object)
            }
            Hypotheses::Poses(_) => {
                let logs = self.pose_logs(library);
                let own = logs.iter().filter(|(other, _)| *other == object);
                log_sum(own.map(|(_, log)| *log))
            }
        }
    }

    /// The most likely pose in one object, and the further ones; none where no hypothesis of the
    /// object has any mass left.
    pub(super) fn pose(&self, library: &ObjectLibrary, object: ObjectId) -> Option<PoseEstimate> {
        let masses = self.masses(library, object, OTHER_POSES_MAX + 1);
        let all = self.mass_log(library, object);
        let (best, others) = masses.split_first().filter(|_| all.is_finite())?;
        let share = |log: f64| (log - all).exp();
        let others = { others.iter() }
            .map(|mass| (mass.map_from_episode, share(mass.log)))
            .filter(|(_, share)| *share > LISTED_SHARE_MIN);
        // The adjoint takes an error on the left of the pose to one on its right.
        let back = se3::adjoint(&best.map_from_episode.inverse());
        let covariance = back * best.covariance * back.transpose() + self.yaw_covariance();
        Some(PoseEstimate {
            object,
            map_from_episode: best.map_from_episode,
            covariance: PoseCovariance::from_matrix(&symmetric(&covariance)),
            share: share(best.log),
            others: others.collect(),
        })
    }
}

impl Recognition {
    /// Covariance of a pose's error on its right by what lies between the rotations of two
    /// hypotheses: it turns about the first contact.
    fn yaw_covariance(&self) -> Matrix6<f64> {
        let pivot = self.first_m.unwrap_or_default().coords;
        let moved = pivot.cross(&Vector3::z()) * self.yaw_sd_rad;
        let turned = Vector3::z() * self.yaw_sd_rad;
        let motion = Vector6::from_iterator(moved.iter().chain(turned.iter()).copied());
        motion * motion.transpose()
    }
}

/// These hypotheses of an object, heaviest first: those of both variants at one pose are one.
fn one_of_each_pose(mut all: Vec<TranslationHypothesis>) -> Vec<TranslationHypothesis> {
    all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let mut poses: Vec<TranslationHypothesis> = Vec::with_capacity(all.len());
    for own in all {
        let same = |other: &&mut TranslationHypothesis| {
            let square = (other.translation - own.translation).norm_squared();
            let apart_m2 = SAME_POSE_SDS.powi(2) * (other.variance_m2 + own.variance_m2);
            other.variant != own.variant && other.rotation == own.rotation && square < apart_m2
        };
        match poses.iter_mut().find(same) {
            Some(other) => other.evidence = log_sum([other.evidence, own.evidence].into_iter()),
            None => poses.push(own),
        }
    }
    poses
}

/// Log of the mass of all variants of an object.
fn object_log(logs: &BTreeMap<VariantId, f64>, object: ObjectId) -> f64 {
    let variants = VariantId::both(object).into_iter();
    log_sum(variants.filter_map(|id| logs.get(&id).copied()))
}

/// Log of each object's mass.
fn sums(library: &ObjectLibrary, logs: &[(ObjectId, f64)]) -> Vec<(ObjectId, f64)> {
    let objects = library.indexed_models().map(|(object, _)| object);
    let mut own: BTreeMap<ObjectId, Vec<f64>> = objects.map(|own| (own, Vec::new())).collect();
    for (object, log) in logs {
        if let Some(own) = own.get_mut(object) {
            own.push(*log);
        }
    }
    let sum = |(object, own): (ObjectId, Vec<f64>)| (object, log_sum(own.into_iter()));
    own.into_iter().map(sum).collect()
}
