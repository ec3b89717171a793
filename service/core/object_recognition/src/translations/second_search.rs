//! The second search: poses that the first one lost, by contacts that lie far apart.

use std::collections::BTreeMap;

use crate::contact::Contact;
use crate::indexed_model::IndexedModel;
use crate::library::ObjectLibrary;
use crate::percept_likelihood::ContactPercepts;
use crate::translations::gaussian_sum::GaussianSum;
use crate::translations::hypothesis::TranslationHypothesis;
use crate::translations::merge::merged;
use crate::translations::prefilter::Prefilter;
use crate::translations::split::SplitBuffers;
use crate::translations::touch_update::TouchUpdate;
use crate::tuning::{
    SEARCHED_CONTACTS, SEARCHED_NATS, SEARCHED_POSES, SEARCHED_SDS, SEARCHED_SEEDS,
    SEARCHED_SEEDS_MAX,
};
use crate::variant::VariantId;

impl GaussianSum {
    /// Looks for poses again, after all contacts of a walk so far.
    ///
    /// Neighbouring contacts tell little of where on a model they are whose places were predicted
    /// from others: the right pose may be pruned long before the walk comes to where it would be
    /// told from the rest. Contacts far apart tell it at once. What they find and no hypothesis
    /// holds is replayed by all contacts, so that its evidence is that of the others. It is sought
    /// in the likeliest objects, and in those models alone of which contacts share errors.
    pub(crate) fn search_again(&mut self, library: &ObjectLibrary, contacts: &[Contact]) {
        let searched = self.searched(library);
        let holds = |of: VariantId, _: &IndexedModel| searched.contains(&of);
        let order = far_apart(contacts, SEARCHED_CONTACTS);
        let Some(first) = order.first() else {
            return;
        };
        if searched.is_empty() {
            return;
        }
        let mut other = Self::new(self.rotations.clone());
        other.begin(library, first, BTreeMap::new(), &holds);
        other.settle();
        for (number, contact) in order.iter().enumerate().skip(1) {
            let before = &order[..number];
            other.touch(library, before, contact, BTreeMap::new(), &|_| 0.0, None);
            other.settle();
        }
        let found = self.lost(other.all);
        if !found.is_empty() {
            self.replay_found(library, contacts, &found);
        }
    }

    /// The models of the largest mass of which contacts share errors, as many as the budget holds.
    fn searched(&self, library: &ObjectLibrary) -> Vec<VariantId> {
        let shares = |own: &(VariantId, f64)| {
            let indexed = library.variant(own.0);
            indexed.is_some_and(IndexedModel::shares_errors)
        };
        let mut models: Vec<_> = self.variant_logs().into_iter().filter(shares).collect();
        models.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut seeds = 0;
        models.retain(|own| {
            let places = library.variant(own.0).map_or(0, |own| own.places.len());
            let with = seeds + places * self.rotations.len();
            let fits = with <= SEARCHED_SEEDS_MAX;
            if fits {
                seeds = with;
            }
            fits
        });
        models.into_iter().map(|own| own.0).collect()
    }

    /// The heaviest of these poses that no hypothesis holds.
    fn lost(&self, mut found: Vec<TranslationHypothesis>) -> Vec<TranslationHypothesis> {
        found.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        found.truncate(SEARCHED_POSES);
        let best = found.first().map_or(0.0, |own| own.evidence);
        let is_held = |own: &TranslationHypothesis| self.all.iter().any(|other| near(own, other));
        found.retain(|own| own.evidence > best - SEARCHED_NATS && !is_held(own));
        found
    }

    /// Adds hypotheses by the seeds nearest to these poses, after all contacts.
    fn replay_found(
        &mut self,
        library: &ObjectLibrary,
        contacts: &[Contact],
        found: &[TranslationHypothesis],
    ) {
        let holds = |of: VariantId, _: &IndexedModel| {
            found
                .iter()
                .any(|own: &TranslationHypothesis| own.of() == of)
        };
        let mut prefilter = Prefilter::new(library, &self.rotations, &contacts[0], &holds);
        let first = ContactPercepts::new(&contacts[0], library.level_prior());
        let touches: Vec<TouchUpdate<'_>> = (1..contacts.len())
            .zip(&self.unexplored.history)
            .map(|(k, unexplored)| {
                TouchUpdate::new(library, (&contacts[..k], &contacts[k]), unexplored)
            })
            .collect();
        let touches: Vec<&TouchUpdate<'_>> = touches.iter().collect();
        let mut buffers = SplitBuffers::default();
        let mut parts = Vec::new();
        for own in found {
            for seed in prefilter.nearest(own, &self.rotations, SEARCHED_SEEDS) {
                if !prefilter.has(&seed) {
                    continue;
                }
                let (mut hypothesis, known) = prefilter.take(&seed, &self.rotations, &first);
                self.prefilter.remove(&hypothesis, &self.rotations);
                let size = self.sizes.get(&hypothesis.of());
                hypothesis.evidence += size.copied().unwrap_or_default();
                let rotation = &self.rotations[usize::from(hypothesis.rotation)];
                buffers.replay(rotation, known, hypothesis, &touches, &mut parts);
            }
        }
        self.prefilter.drop_below(f64::NEG_INFINITY);
        // No mass counts twice: a seed may wait, or have been promoted before. Of two at one pose
        // the heavier one stays.
        let mut lost = merged(&parts);
        let is_lighter = |own: &TranslationHypothesis, others: &[TranslationHypothesis]| {
            let mut heavier = others.iter().filter(|other| other.evidence >= own.evidence);
            heavier.any(|other| near(own, other))
        };
        lost.retain(|own| !is_lighter(own, &self.all));
        self.all.retain(|own| !is_lighter(own, &lost));
        lost.append(&mut self.all);
        self.all = merged(&lost);
        self.prune(library);
    }
}

/// Whether two hypotheses have about the same pose in one model.
fn near(own: &TranslationHypothesis, other: &TranslationHypothesis) -> bool {
    let square = (other.translation - own.translation).norm_squared();
    let variance_m2 = other.variance_m2 + own.variance_m2;
    other.map() == own.map() && square < SEARCHED_SDS * SEARCHED_SDS * variance_m2
}

/// So many contacts, each the farthest from those before it, as if drawn from anywhere.
fn far_apart(contacts: &[Contact], most: usize) -> Vec<Contact> {
    let mut chosen: Vec<Contact> = Vec::with_capacity(most);
    let mut squares = vec![f64::INFINITY; contacts.len()];
    let mut at = 0;
    while chosen.len() < most.min(contacts.len()) {
        let own = &contacts[at];
        for (square, other) in squares.iter_mut().zip(contacts) {
            *square = square.min((other.position_m - own.position_m).norm_squared());
        }
        squares[at] = -1.0;
        chosen.push(own.clone().drawn());
        let farthest = { squares.iter().enumerate() }.max_by(|a, b| a.1.total_cmp(b.1));
        at = farthest.map_or(0, |own| own.0);
    }
    chosen
}
