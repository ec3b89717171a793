//! The Gaussian sum: all hypotheses over translations, exact ones and those of the prefilter.

use std::collections::BTreeMap;

use nalgebra::UnitQuaternion;

use crate::contact::{Contact, Reached};
use crate::indexed_model::IndexedModel;
use crate::library::ObjectLibrary;
use crate::numeric::{log_sum, to_f32};
use crate::percept_likelihood::ContactPercepts;
use crate::translations::background::{BackgroundModel, UnknownContact};
use crate::translations::continuation::continued_log;
use crate::translations::hypothesis::TranslationHypothesis;
use crate::translations::mass_histogram::MassHistogram;
use crate::translations::merge::merged;
use crate::translations::prefilter::{Prefilter, Seed};
use crate::translations::split::SplitBuffers;
use crate::translations::touch_update::{TouchUpdate, nearest_contact};
use crate::translations::unexplored::Unexplored;
use crate::tuning::{
    NEGLIGIBLE_SHARE, PREFILTER_CONTACTS_MAX, PROMOTION_MAX, PROMOTION_MIN, PROMOTION_SEEDS,
    PRUNE_NATS, SHARED_PRUNE_NATS, TRANSLATIONS_MAX, WAITING_CONTACTS, WAITING_SHARE,
};
use crate::variant::VariantId;

/// All hypotheses.
#[derive(Clone, Debug)]
pub(crate) struct GaussianSum {
    pub(crate) rotations: Vec<UnitQuaternion<f64>>,
    /// The exact hypotheses, by model, rotation and place.
    pub(super) all: Vec<TranslationHypothesis>,
    /// The seeds that were not promoted.
    pub(super) prefilter: Prefilter,
    /// Episodes that were on nothing explored so far.
    pub(super) unexplored: Unexplored,
    /// Log-likelihoods of the contacts under an unknown object, without those that were asked for.
    pub(crate) background: BackgroundModel,
    /// Logs of the factors that all masses of each model have for its size.
    pub(super) sizes: BTreeMap<VariantId, f64>,
}

impl GaussianSum {
    /// Without contacts, for these rotations.
    pub(crate) fn new(rotations: Vec<UnitQuaternion<f64>>) -> Self {
        Self {
            rotations,
            all: Vec::new(),
            prefilter: Prefilter::default(),
            unexplored: Unexplored::default(),
            background: BackgroundModel::default(),
            sizes: BTreeMap::new(),
        }
    }

    /// Whether there is no hypothesis.
    pub(crate) fn is_empty(&self) -> bool {
        self.all.is_empty() && self.prefilter.is_empty()
    }

    /// Updates all hypotheses with a contact, and returns what it adds to the log-likelihood of the
    /// unknown object, if that predicts it; `before` are the earlier ones that are kept. `sizes`
    /// are the logs of the factors that the masses of each model have for its size, after the
    /// contact, `share` is that of one step of a walk, per that of a typical object, and `reach_m`
    /// is the radius within which a walk's next contact lies.
    ///
    /// All masses have these factors, so that the lightest hypotheses are those of the least
    /// probability: a large object explains each contact by more places than a small one.
    pub(crate) fn touch(
        &mut self,
        library: &ObjectLibrary,
        before: &[Contact],
        contact: &Contact,
        sizes: BTreeMap<VariantId, f64>,
        share: &impl Fn(VariantId) -> f64,
        reach_m: Option<f64>,
    ) -> Option<f64> {
        let Some(last) = before.last() else {
            self.begin(library, contact, sizes, &|_, _| true);
            return None;
        };
        self.resize(sizes);
        let unknown = self.unknown(library, (before, contact), reach_m);
        let densities =
            self.unexplored
                .densities(library, (last, contact), unknown.as_ref(), share);
        let touch = TouchUpdate::new(library, (before, contact), &densities);
        let mut buffers = SplitBuffers::default();
        let mut parts = Vec::with_capacity(2 * self.all.len());
        let all = std::mem::take(&mut self.all);
        buffers.split_all(library, &self.rotations, &all, &touch, &mut parts);
        if !self.prefilter.is_empty() {
            self.promote(library, before, &touch, &mut buffers, &mut parts);
        }
        let bare =
            |of: VariantId| Some(unknown.as_ref()?.of_objects.get(&of.object)?.bare + share(of));
        let best = parts.iter().map(|part| part.evidence);
        let best = best.fold(self.prefilter.best_log(), f64::max);
        let (rotations, least) = (&self.rotations, best - PRUNE_NATS);
        { &self.unexplored }.entered(library, rotations, (last, contact), bare, least, &mut parts);
        let step_m = (contact.position_m - last.position_m).norm();
        self.unexplored.stayed(densities, step_m);
        self.all = merged(&parts);
        self.prune(library);
        Some(unknown?.log)
    }

    /// The first contact, with one of these models.
    pub(super) fn begin(
        &mut self,
        library: &ObjectLibrary,
        contact: &Contact,
        sizes: BTreeMap<VariantId, f64>,
        holds: &impl Fn(VariantId, &IndexedModel) -> bool,
    ) {
        self.prefilter = Prefilter::new(library, &self.rotations, contact, holds);
        self.unexplored = Unexplored::new(library, holds);
        self.resize(sizes);
    }

    /// Changes the factors that the masses of each model have for its size.
    fn resize(&mut self, sizes: BTreeMap<VariantId, f64>) {
        let of = |model: VariantId| {
            let before = self.sizes.get(&model).copied().unwrap_or_default();
            sizes.get(&model).map_or(0.0, |now| now - before)
        };
        for own in self.all.chunk_by_mut(|a, b| a.of() == b.of()) {
            let log = of(own[0].of());
            for hypothesis in own {
                hypothesis.evidence += log;
            }
        }
        self.prefilter.resize(of);
        self.unexplored.resize(of);
        self.sizes.extend(sizes);
    }

    /// After a touch: what an unknown object would be taken for.
    pub(crate) fn settle(&mut self) {
        let logs = self.variant_logs();
        let logs: Vec<(VariantId, f64)> = logs.into_iter().collect();
        let objects = logs.chunk_by(|a, b| a.0.object == b.0.object);
        let objects = objects.map(|own| (own[0].0.object, log_sum(own.iter().map(|own| own.1))));
        let best = objects.max_by(|a, b| a.1.total_cmp(&b.1));
        self.background.settle(best.map(|(object, _)| object));
    }

    /// Log densities of a contact with an unknown object; none of one that was asked for.
    fn unknown(
        &mut self,
        library: &ObjectLibrary,
        (before, contact): (&[Contact], &Contact),
        reach_m: Option<f64>,
    ) -> Option<UnknownContact> {
        let (nearest, last) = nearest_contact(before, contact).zip(before.last())?;
        if contact.reached == Reached::Aimed {
            return None;
        }
        let drift_m2 = (contact.drift_sd_m.powi(2) - last.drift_sd_m.powi(2)).max(0.0);
        let continued =
            reach_m.and_then(|reach_m| continued_log(library, before, contact, reach_m));
        let pair = (nearest, contact);
        let background = &mut self.background;
        Some(background.touch(library, &self.rotations, pair, drift_m2, continued))
    }

    /// Updates the prefilter, and promotes the heaviest of the seeds that the touch supports: from
    /// then on they are hypotheses of their own.
    fn promote(
        &mut self,
        library: &ObjectLibrary,
        before: &[Contact],
        touch: &TouchUpdate<'_>,
        buffers: &mut SplitBuffers,
        parts: &mut Vec<TranslationHypothesis>,
    ) {
        let mut prefilter = std::mem::take(&mut self.prefilter);
        let supported = prefilter.update(library, &self.rotations, touch);
        let promoted = promoted(&prefilter, &supported, before.len(), parts);
        let first = ContactPercepts::new(&before[0], library.level_prior());
        let touches: Vec<TouchUpdate<'_>> = (1..before.len())
            .zip(&self.unexplored.history)
            .map(|(k, unexplored)| {
                TouchUpdate::new(library, (&before[..k], &before[k]), unexplored)
            })
            .collect();
        let touches: Vec<&TouchUpdate<'_>> = touches.iter().chain([touch]).collect();
        let mut replay = |prefilter: &mut Prefilter, seed: &Seed, parts: &mut Vec<_>| {
            let (mut hypothesis, known) = prefilter.take(seed, &self.rotations, &first);
            let size = self.sizes.get(&hypothesis.of());
            hypothesis.evidence += size.copied().unwrap_or_default();
            let rotation = &self.rotations[usize::from(hypothesis.rotation)];
            buffers.replay(rotation, known, hypothesis, &touches, parts);
        };
        for seed in &promoted {
            replay(&mut prefilter, seed, parts);
        }
        let best = parts.iter().map(|part| part.evidence);
        let best = best.fold(prefilter.best_log(), f64::max);
        let is_over = before.len() >= PREFILTER_CONTACTS_MAX;
        let least = if is_over {
            f64::INFINITY
        } else {
            best - PRUNE_NATS
        };
        // The last hypothesis of a model stays.
        let mut held: Vec<VariantId> = parts.iter().map(TranslationHypothesis::of).collect();
        held.sort_unstable();
        for model in prefilter.exhausted(least) {
            if held.binary_search(&model).is_ok() {
                continue;
            }
            for seed in prefilter.best_of(model, 1) {
                replay(&mut prefilter, &seed, parts);
            }
        }
        prefilter.drop_below(least);
        self.prefilter = prefilter;
    }

    /// Drops hypotheses without evidence, and the lightest beyond the budget; each model keeps its
    /// best.
    pub(super) fn prune(&mut self, library: &ObjectLibrary) {
        let most = TRANSLATIONS_MAX;
        let evidences = self.all.iter().map(|hypothesis| hypothesis.evidence);
        let best = evidences.fold(self.prefilter.best_log(), f64::max);
        let by_model = || self.all.chunk_by(|a, b| a.of() == b.of());
        let mut evidences = Vec::with_capacity(self.all.len());
        let mut floors = Vec::new();
        for own in by_model() {
            let indexed = library.variant(own[0].of());
            let nats = if indexed.is_some_and(IndexedModel::is_vague) {
                SHARED_PRUNE_NATS
            } else {
                PRUNE_NATS
            };
            let floor = best - nats;
            floors.push(floor);
            let heavy = own.iter().map(|hypothesis| hypothesis.evidence);
            evidences.extend(heavy.filter(|evidence| *evidence > floor));
        }
        let mut least = f64::NEG_INFINITY;
        // Room for hypotheses exactly as heavy as the lightest.
        let mut room = usize::MAX;
        if evidences.len() > most {
            let (heavier, lightest, _) =
                evidences.select_nth_unstable_by(most - 1, |a, b| b.total_cmp(a));
            least = *lightest;
            room = most - heavier.iter().filter(|evidence| **evidence > least).count();
        }
        let mut kept = Vec::with_capacity(self.all.len().min(most));
        for (own, floor) in by_model().zip(floors) {
            let before = kept.len();
            for hypothesis in own.iter().filter(|own| own.evidence > floor) {
                let is_lightest = hypothesis.evidence <= least;
                if !is_lightest || hypothesis.evidence >= least && room > 0 {
                    room -= usize::from(is_lightest);
                    kept.push(*hypothesis);
                }
            }
            if kept.len() == before {
                kept.extend(own.iter().max_by(|a, b| a.evidence.total_cmp(&b.evidence)));
            }
        }
        self.all = kept;
    }

    /// Log of the mass of each model that has any.
    pub(crate) fn variant_logs(&self) -> BTreeMap<VariantId, f64> {
        let own = self.all.chunk_by(|a, b| a.of() == b.of()).map(|own| {
            let logs = own.iter().map(|hypothesis| hypothesis.evidence);
            (own[0].of(), log_sum(logs))
        });
        let mut sums: BTreeMap<VariantId, f64> = BTreeMap::new();
        for (of, log) in own.chain(self.prefilter.masses()) {
            let sum = sums.entry(of).or_insert(f64::NEG_INFINITY);
            *sum = log_sum([*sum, log].into_iter());
        }
        self.unexplored.add_to(&mut sums);
        sums
    }

    /// Number of hypotheses that hold a share of all mass of the models that count.
    pub(crate) fn holding(&self, share: f64, counts: impl Fn(VariantId) -> bool) -> usize {
        let logs = self.variant_logs();
        let logs = logs.iter().filter(|(of, _)| counts(**of));
        let all = log_sum(logs.map(|(_, log)| *log));
        let mut histogram = MassHistogram::new(self.prefilter.len());
        for hypothesis in self.all.iter().filter(|own| counts(own.of())) {
            histogram.add(to_f32((hypothesis.evidence - all).exp()));
        }
        self.prefilter.count(&mut histogram, -all, counts);
        histogram.holding(share * histogram.sum())
    }

    /// The `most` heaviest hypotheses of a model, heaviest first.
    pub(crate) fn heaviest(&self, of: VariantId, most: usize) -> Vec<TranslationHypothesis> {
        let own = self.all.iter().filter(|hypothesis| hypothesis.of() == of);
        let prefilter = self.prefilter.best_of(of, most);
        let prefilter = prefilter
            .iter()
            .filter_map(|seed| self.prefilter.hypothesis(seed, &self.rotations));
        let mut all: Vec<TranslationHypothesis> = own.copied().chain(prefilter).collect();
        all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        all.truncate(most);
        all
    }
}

/// The seeds to promote after `contacts` contacts: as many as matter, as soon as they fit the
/// budget.
fn promoted(
    prefilter: &Prefilter,
    supported: &[f32],
    contacts: usize,
    parts: &[TranslationHypothesis],
) -> Vec<Seed> {
    let logs: Vec<f64> = { prefilter.masses().map(|(_, log)| log) }
        .chain(parts.iter().map(|part| part.evidence))
        .collect();
    let all = log_sum(logs.into_iter());
    let room = PROMOTION_SEEDS.saturating_sub(supported.len());
    let budget = (PROMOTION_MAX * room / PROMOTION_SEEDS).max(PROMOTION_MIN) / contacts;
    let is_time = contacts >= WAITING_CONTACTS;
    if is_time || prefilter.holding(supported, all + WAITING_SHARE.ln()) <= budget {
        let wanted = prefilter.holding(supported, all + NEGLIGIBLE_SHARE.ln());
        prefilter.heaviest(supported, wanted.min(budget))
    } else {
        Vec::new()
    }
}
