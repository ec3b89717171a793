//! The library: all models that an episode may be of.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_6;
use std::sync::{Arc, OnceLock};

use nalgebra::Point3;

use crate::indexed_model::IndexedModel;
use crate::level_prior::{LevelPrior, level_prior};
use crate::library_entry::LibraryEntry;
use crate::model::ObjectModel;
use crate::object_id::ObjectId;
use crate::surfels::map::PerceptContext;
use crate::tuning::{ANSWER_PROBABILITY, BACKGROUND_SAMPLES};
use crate::variant::{Variant, VariantId, body_priors};

/// How densely an object was felt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Density {
    /// Typical distance between neighbouring places \[m\].
    pub gap_m: f64,
    /// Standard deviation of a contact, per axis \[m\].
    pub contact_sd_m: f64,
    /// Standard deviation of the surface between the places, as it is predicted \[m\]; none where
    /// they are dense, or too few to tell, or where contacts fall on them alone.
    pub between_sd_m: Option<f64>,
}

impl Density {
    /// Distance between places at which the surface between them would be known as exactly as it is
    /// felt \[m\]: a smooth surface leaves the chord as the square of its length.
    pub fn advised_gap_m(&self) -> Option<f64> {
        let ratio = self.contact_sd_m / self.between_sd_m?;
        Some(self.gap_m * ratio.min(1.0).sqrt())
    }
}

/// A place of the library.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    pub(crate) of: VariantId,
    /// Number among the model's packed places.
    pub(crate) packed_place: u32,
    pub(crate) position: Point3<f64>,
}

/// What all models of a library tell together.
#[derive(Debug)]
struct Summary {
    level_prior: Vec<LevelPrior>,
    samples: Vec<Sample>,
    extent_m: f64,
}

/// All models that an episode may be of, with their indexes.
///
/// Indexes are built when they are first needed, by whoever needs them, or before, one by
/// [one](Self::index_one): a tenth of a second for hundreds of places. Recognition changes nothing
/// here.
#[derive(Clone, Debug)]
pub struct ObjectLibrary {
    answer_probability: f64,
    /// Shared with the library's clones, so that a snapshot costs a pointer per object.
    objects: BTreeMap<ObjectId, Arc<LibraryEntry>>,
    /// Logs of the prior probabilities of the bodies that are uncertain.
    body_priors: OnceLock<Arc<BTreeMap<ObjectId, f64>>>,
    summary: OnceLock<Arc<Summary>>,
}

impl Default for ObjectLibrary {
    fn default() -> Self {
        Self::answering_from(ANSWER_PROBABILITY)
    }
}

impl ObjectLibrary {
    /// A library without objects, about which an answer is given from a probability on.
    pub fn answering_from(answer_probability: f64) -> Self {
        Self {
            answer_probability,
            objects: BTreeMap::new(),
            body_priors: OnceLock::new(),
            summary: OnceLock::new(),
        }
    }

    /// Probability from which on an answer is given.
    pub fn answer_probability(&self) -> f64 {
        self.answer_probability
    }

    /// Puts a model in place of an earlier one of the same object. Running episodes keep the
    /// evidence that they have.
    pub fn put(&mut self, id: ObjectId, model: ObjectModel) {
        self.objects.insert(id, Arc::new(LibraryEntry::new(model)));
        self.changed();
    }

    /// Removes an object; `true` if there was one.
    pub fn remove(&mut self, id: ObjectId) -> bool {
        let removed = self.objects.remove(&id).is_some();
        self.changed();
        removed
    }

    /// What all models told together holds no more.
    fn changed(&mut self) {
        (self.body_priors, self.summary) = (OnceLock::new(), OnceLock::new());
    }

    /// Number of objects whose indexes nobody has begun to build.
    pub fn unclaimed(&self) -> usize {
        let unclaimed = self.objects.values().filter(|object| !object.is_claimed());
        unclaimed.count()
    }

    /// Builds the indexes of an object that nobody has begun to; whether there was one. Threads
    /// that do so at the same time take different ones.
    pub fn index_one(&self) -> bool {
        let next = self.objects.values().find(|object| object.claim());
        next.map(|object| object.indexes()).is_some()
    }

    /// Builds all that recognition needs and that is not there yet.
    pub fn prepare(&self) {
        self.summary();
    }

    /// A library of some of these objects, each under a new number. The priors of their bodies
    /// stay.
    #[must_use]
    pub fn select(&self, objects: impl IntoIterator<Item = (ObjectId, ObjectId)>) -> Self {
        let mut selected = Self::answering_from(self.answer_probability);
        let mut body_priors = BTreeMap::new();
        for (id, number) in objects {
            if let Some(object) = self.objects.get(&id) {
                selected.objects.insert(number, Arc::clone(object));
                let prior_log = self.body_priors().get(&id);
                body_priors.extend(prior_log.map(|log| (number, *log)));
            }
        }
        selected.body_priors = OnceLock::from(Arc::new(body_priors));
        selected
    }

    /// The model of an object.
    pub fn get(&self, id: ObjectId) -> Option<&ObjectModel> {
        self.objects.get(&id).map(|object| &object.model)
    }

    /// How densely an object was felt.
    pub fn density(&self, id: ObjectId) -> Option<Density> {
        let object = self.objects.get(&id)?;
        let gap_m = object.indexes().places.gap_m;
        (gap_m > 0.0).then(|| Density {
            gap_m,
            contact_sd_m: object.model.noise_m2().sqrt(),
            between_sd_m: self.likelier(id).and_then(|(_, own)| own.between_sd_m),
        })
    }

    /// All objects, by number.
    pub fn iter(&self) -> impl Iterator<Item = (ObjectId, &ObjectModel)> {
        self.objects.iter().map(|(id, object)| (*id, &object.model))
    }

    /// Number of objects.
    pub fn len(&self) -> usize {
        self.objects.len()
    }

    /// Whether there is no object.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    fn body_priors(&self) -> &BTreeMap<ObjectId, f64> {
        self.body_priors.get_or_init(|| {
            // Others may be building some: those that are left come before theirs.
            while self.index_one() {}
            let chosen_logs = { self.objects.iter() }.filter_map(|(id, object)| {
                let indexes = object.indexes();
                let body = indexes.body.as_ref().unwrap_or(&indexes.places);
                Some((*id, body.chosen_log?))
            });
            let mut body_priors = body_priors(chosen_logs);
            body_priors.retain(|id, _| self.objects[id].indexes().body.is_some());
            Arc::new(body_priors)
        })
    }

    fn summary(&self) -> &Summary {
        self.summary.get_or_init(|| {
            let extents = self.variants().map(|(_, indexed)| indexed.extent_m);
            let own_levels = { self.likelier_models() }.flat_map(|(_, own)| &own.own_levels);
            Arc::new(Summary {
                extent_m: extents.fold(0.0, f64::max),
                samples: self.sampled(),
                level_prior: level_prior(own_levels),
            })
        })
    }

    fn sampled(&self) -> Vec<Sample> {
        let places = || {
            self.likelier_models().flat_map(|(of, indexed)| {
                let count = u32::try_from(indexed.places.len()).unwrap_or(u32::MAX);
                (0..count).map(move |place| (of, place))
            })
        };
        let step = places().count().div_ceil(BACKGROUND_SAMPLES).max(1);
        let samples = places().skip(step / 2).step_by(step);
        let sample = |(of, packed_place): (VariantId, u32)| {
            let indexed = self.variant(of)?;
            let place = indexed
                .places
                .get(indexed.packed.place(packed_place as usize))?;
            Some(Sample {
                of,
                packed_place,
                position: place.position,
            })
        };
        samples.filter_map(sample).collect()
    }

    /// All objects, as their places tell.
    pub(crate) fn indexed_models(&self) -> impl Iterator<Item = (ObjectId, &IndexedModel)> {
        self.objects
            .iter()
            .map(|(id, object)| (*id, &*object.indexes().places))
    }

    /// An object, as its places tell.
    pub(crate) fn indexed(&self, id: ObjectId) -> Option<&IndexedModel> {
        let object = self.objects.get(&id)?;
        Some(&*object.indexes().places)
    }

    /// The variants of all objects with which an episode begins, by number.
    pub(crate) fn variants(&self) -> impl Iterator<Item = (VariantId, &Arc<IndexedModel>)> {
        let body_priors = self.body_priors();
        self.objects.iter().flat_map(|(id, object)| {
            let indexes = object.indexes();
            let body = indexes.body.as_ref();
            let body = body.filter(|_| body_priors.contains_key(id));
            let [places_id, body_id] = VariantId::both(*id);
            let body = body.map(|body| (body_id, body));
            [(places_id, &indexes.places)].into_iter().chain(body)
        })
    }

    /// A variant of an object. A body that is none any more is what the places tell by now.
    pub(crate) fn variant(&self, id: VariantId) -> Option<&IndexedModel> {
        let indexes = self.objects.get(&id.object)?.indexes();
        let body = indexes.body.as_ref();
        let body = body.filter(|_| id.variant == Variant::Body);
        Some(body.unwrap_or(&indexes.places))
    }

    /// The likelier variant of each object.
    pub(crate) fn likelier_models(&self) -> impl Iterator<Item = (VariantId, &IndexedModel)> {
        self.objects.keys().filter_map(|id| self.likelier(*id))
    }

    fn likelier(&self, object: ObjectId) -> Option<(VariantId, &IndexedModel)> {
        let [places, body] = VariantId::both(object);
        let prior_log = self.body_priors().get(&object);
        let is_body = prior_log.is_some_and(|log| *log > 0.5_f64.ln());
        let id = if is_body { body } else { places };
        Some((id, self.variant(id)?))
    }

    /// Logs of the prior probabilities of these variants, given their objects.
    pub(crate) fn variant_priors(&self) -> BTreeMap<VariantId, f64> {
        let body_priors = self.body_priors();
        let prior_log = |(id, _): (VariantId, _)| {
            let body_log = body_priors.get(&id.object).copied();
            let log = match id.variant {
                Variant::Places => body_log.map_or(0.0, |log| (-log.exp_m1()).ln()),
                Variant::Body => body_log.unwrap_or(f64::NEG_INFINITY),
            };
            (id, log)
        };
        self.variants().map(prior_log).collect()
    }

    /// What the densities of contacts with a model depend on beside its surfels.
    pub(crate) fn percept_context<'a>(&'a self, indexed: &'a IndexedModel) -> PerceptContext<'a> {
        PerceptContext {
            places: &indexed.places,
            level_prior: self.level_prior(),
            clutter_per_m3: self.clutter_per_m3(),
        }
    }

    /// An even sample of the places of all models, for the background model.
    pub(crate) fn samples(&self) -> &[Sample] {
        &self.summary().samples
    }

    pub(crate) fn level_prior(&self) -> &[LevelPrior] {
        &self.summary().level_prior
    }

    /// Density of contacts with something else \[1/m³\]: uniform in a ball of the largest model's
    /// extent.
    pub(crate) fn clutter_per_m3(&self) -> f64 {
        1.0 / (FRAC_PI_6 * self.extent_m().max(1e-6).powi(3))
    }

    /// Extent of the largest model \[m\].
    pub(crate) fn extent_m(&self) -> f64 {
        self.summary().extent_m
    }
}
