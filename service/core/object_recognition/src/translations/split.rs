//! Update of one hypothesis by a touch: it splits where several places could be the one touched.

use std::f64::consts::TAU;

use nalgebra::{Point3, UnitQuaternion};

use crate::indexed_model::IndexedModel;
use crate::interpolation::Part;
use crate::library::ObjectLibrary;
use crate::numeric::to_f32;
use crate::percept_likelihood::PerceptLikelihood;
use crate::translations::candidates::{Candidate, CandidateSearch};
use crate::translations::hypothesis::TranslationHypothesis;
use crate::translations::shared_error::SharedError;
use crate::translations::touch_update::{TouchUpdate, share};
use crate::tuning::{SPLIT_MAX, SPLIT_SHARE_MIN};

/// A touch, against the places of a turned model.
#[derive(Debug)]
struct TurnedTouch<'a> {
    touch: &'a TouchUpdate<'a>,
    rotation: &'a UnitQuaternion<f64>,
    indexed: &'a IndexedModel,
    local: PerceptLikelihood<'a>,
    /// The nearest contact before, and the correlation of the model's errors there and at the
    /// touch; none where the one tells nothing of the other.
    earlier: Option<(PerceptLikelihood<'a>, f64)>,
}

impl<'a> TurnedTouch<'a> {
    fn new(
        touch: &'a TouchUpdate<'a>,
        indexed: &'a IndexedModel,
        rotation: &'a UnitQuaternion<f64>,
    ) -> Self {
        Self {
            touch,
            rotation,
            indexed,
            local: touch.percepts.at(indexed, rotation),
            earlier: SharedError::correlation(indexed, touch)
                .map(|correlation| (touch.nearest.at(indexed, rotation), correlation)),
        }
    }
}

/// Buffers that are used again for every hypothesis.
#[derive(Debug, Default)]
pub(crate) struct SplitBuffers {
    search: CandidateSearch,
    /// The search about the nearest contact before.
    earlier: CandidateSearch,
    candidates: Vec<Candidate>,
    now: Vec<TranslationHypothesis>,
    next: Vec<TranslationHypothesis>,
}

impl SplitBuffers {
    /// So many hypotheses of one model, rotation and touch follow.
    fn begin(&mut self, hypotheses: usize) {
        self.search.begin(hypotheses > 1);
        self.earlier.begin(hypotheses > 1);
    }

    /// Appends the parts of a hypothesis after a touch, each with its place taken for the one
    /// touched.
    ///
    /// A hypothesis of an outlier keeps its translation. The others are conditioned on their place
    /// ([`Candidate::update`]), with the share of its density in the sum of all.
    fn split(
        &mut self,
        hypothesis: &TranslationHypothesis,
        turned: &TurnedTouch<'_>,
        parts: &mut Vec<TranslationHypothesis>,
    ) {
        let (touch, rotation, indexed) = (turned.touch, turned.rotation, turned.indexed);
        let candidates = &mut self.candidates;
        let contact = touch.percepts.contact;
        let prior = hypothesis.variance_m2 + touch.drift_m2;
        let noise = contact.position_sd_m * contact.position_sd_m;
        let point = Point3::from(rotation * contact.position_m.coords + hypothesis.translation);
        let packed = &indexed.packed;
        let mut densities = (self.search).find(packed, &point, prior + noise, &turned.local);
        let one = share(indexed.places.len()) / TAU.powf(1.5);
        let shared = turned.earlier.as_ref().filter(|_| densities > 0.0);
        let shared = shared.and_then(|(local, correlation)| {
            let earlier = rotation * touch.nearest.contact.position_m.coords;
            let point = Point3::from(earlier + hypothesis.translation);
            let variance_m2 = touch.nearest_m2 + hypothesis.variance_m2;
            let likely = (local, touch.outlier / one);
            let place = self.earlier.best(indexed, &point, variance_m2, likely)?;
            SharedError::new(place, touch, *correlation, (&point, variance_m2))
        });
        let is_predicted = indexed.shares_errors() && densities > 0.0;
        if is_predicted {
            let error = shared.as_ref();
            densities = (self.search).conditioned(indexed, error, [prior, noise], candidates);
        }
        let unpredicted =
            touch.unpredicted(hypothesis, (indexed, rotation), &point, one * densities);
        let beyond = unpredicted.map_or(0.0, |own| own.density);
        let outlier = (touch.outlier + beyond) / one;
        let total = outlier + densities;
        let mut falls = hypothesis.falls;
        if unpredicted.is_some_and(|own| own.part == Part::Beyond) {
            falls.beyond += to_f32(beyond / (one * total));
        }
        if let Some(own) = unpredicted.filter(|_| indexed.missed_share.is_some()) {
            falls.places += to_f32(densities / total);
            if own.part == Part::Gap {
                falls.gaps += to_f32(beyond / (one * total));
            }
        }
        let least = SPLIT_SHARE_MIN * total;
        if is_predicted {
            candidates.retain(|candidate| candidate.density >= least);
        } else {
            (self.search).candidates(packed, (least, noise), candidates);
        }
        if candidates.len() > SPLIT_MAX {
            candidates.sort_by(|a, b| b.density.total_cmp(&a.density));
            candidates.truncate(SPLIT_MAX);
        }
        let best = candidates.iter().map(|candidate| candidate.density);
        let evidence = hypothesis.evidence + (one * total).ln();
        if best.fold(0.0, f64::max) < outlier {
            parts.push(TranslationHypothesis {
                variance_m2: prior,
                evidence,
                falls,
                ..*hypothesis
            });
            return;
        }
        let sum = { candidates.iter() }
            .map(|candidate| candidate.density)
            .sum::<f64>();
        for candidate in candidates {
            let (moved, variance_m2) = candidate.update(prior);
            parts.push(TranslationHypothesis {
                translation: hypothesis.translation + moved,
                variance_m2,
                evidence: evidence + (candidate.density / sum).ln(),
                falls,
                ..*hypothesis
            });
        }
    }

    /// Appends the parts of hypotheses after a touch.
    pub(crate) fn split_all(
        &mut self,
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        all: &[TranslationHypothesis],
        touch: &TouchUpdate<'_>,
        parts: &mut Vec<TranslationHypothesis>,
    ) {
        for own in all.chunk_by(|a, b| a.map() == b.map()) {
            let Some(indexed) = library.variant(own[0].of()) else {
                continue;
            };
            let rotation = &rotations[usize::from(own[0].rotation)];
            let turned = TurnedTouch::new(touch, indexed, rotation);
            self.begin(own.len());
            for hypothesis in own {
                self.split(hypothesis, &turned, parts);
            }
        }
    }

    /// Appends the parts of a seed after all touches so far.
    pub(crate) fn replay(
        &mut self,
        rotation: &UnitQuaternion<f64>,
        indexed: &IndexedModel,
        seed: TranslationHypothesis,
        touches: &[&TouchUpdate<'_>],
        parts: &mut Vec<TranslationHypothesis>,
    ) {
        let mut now = std::mem::take(&mut self.now);
        let mut next = std::mem::take(&mut self.next);
        now.clear();
        now.push(seed);
        for touch in touches {
            next.clear();
            self.begin(now.len());
            let turned = TurnedTouch::new(touch, indexed, rotation);
            for hypothesis in &now {
                self.split(hypothesis, &turned, &mut next);
            }
            if next.len() > SPLIT_MAX {
                next.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
                next.truncate(SPLIT_MAX);
            }
            std::mem::swap(&mut now, &mut next);
        }
        parts.extend_from_slice(&now);
        (self.now, self.next) = (now, next);
    }
}
