//! The library: all models that an episode may be of.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_6;
use std::sync::Arc;

use nalgebra::Point3;

use crate::indexed_model::IndexedModel;
use crate::level_prior::{LevelPrior, level_prior};
use crate::model::ObjectModel;
use crate::surfels::map::PerceptContext;
use crate::tuning::{ANSWER_PROBABILITY, BACKGROUND_SAMPLES};

/// Number of an object, chosen by the caller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub u32);

/// One model with its indexes.
#[derive(Debug)]
pub(crate) struct LibraryEntry {
    model: ObjectModel,
    pub(crate) indexed: IndexedModel,
}

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
    pub(crate) object: ObjectId,
    /// Number among the model's packed places.
    pub(crate) packed_place: u32,
    pub(crate) position: Point3<f64>,
}

/// All models that an episode may be of, with their indexes.
///
/// Putting a model builds its indexes, some milliseconds per thousand places. Recognition changes
/// nothing here.
#[derive(Clone, Debug)]
pub struct ObjectLibrary {
    answer_probability: f64,
    /// Shared with the library's clones, so that a snapshot costs a pointer per object.
    objects: BTreeMap<ObjectId, Arc<LibraryEntry>>,
    level_prior: Vec<LevelPrior>,
    samples: Vec<Sample>,
    extent_m: f64,
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
            level_prior: Vec::new(),
            samples: Vec::new(),
            extent_m: 0.0,
        }
    }

    /// Probability from which on an answer is given.
    pub fn answer_probability(&self) -> f64 {
        self.answer_probability
    }

    /// Puts a model in place of an earlier one of the same object. Running episodes keep the
    /// evidence that they have.
    pub fn put(&mut self, id: ObjectId, model: ObjectModel) {
        let indexed = IndexedModel::new(&model);
        self.objects
            .insert(id, Arc::new(LibraryEntry { model, indexed }));
        self.update_summary();
    }

    /// Removes an object; `true` if there was one.
    pub fn remove(&mut self, id: ObjectId) -> bool {
        let removed = self.objects.remove(&id).is_some();
        self.update_summary();
        removed
    }

    /// A library of some of these objects, each under a new number.
    #[must_use]
    pub fn select(&self, objects: impl IntoIterator<Item = (ObjectId, ObjectId)>) -> Self {
        let mut selected = Self::answering_from(self.answer_probability);
        for (id, number) in objects {
            if let Some(object) = self.objects.get(&id) {
                selected.objects.insert(number, Arc::clone(object));
            }
        }
        selected.update_summary();
        selected
    }

    /// The model of an object.
    pub fn get(&self, id: ObjectId) -> Option<&ObjectModel> {
        self.objects.get(&id).map(|object| &object.model)
    }

    /// How densely an object was felt.
    pub fn density(&self, id: ObjectId) -> Option<Density> {
        let object = self.objects.get(&id)?;
        let gap_m = object.indexed.gap_m;
        (gap_m > 0.0).then(|| Density {
            gap_m,
            contact_sd_m: object.model.noise_m2().sqrt(),
            between_sd_m: object.indexed.between_sd_m,
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

    fn update_summary(&mut self) {
        let extents = self.indexed_models().map(|(_, indexed)| indexed.extent_m);
        self.extent_m = extents.fold(0.0, f64::max);
        let places = || {
            self.indexed_models().flat_map(|(object, indexed)| {
                let count = u32::try_from(indexed.places.len()).unwrap_or(u32::MAX);
                (0..count).map(move |place| (object, place))
            })
        };
        let step = places().count().div_ceil(BACKGROUND_SAMPLES).max(1);
        let samples = places().skip(step / 2).step_by(step);
        let sample = |(object, packed_place): (ObjectId, u32)| {
            let indexed = self.indexed(object)?;
            let place = indexed
                .places
                .get(indexed.packed.place(packed_place as usize))?;
            Some(Sample {
                object,
                packed_place,
                position: place.position,
            })
        };
        self.samples = samples.filter_map(sample).collect();
        let models = self.objects.values().map(|object| &object.indexed);
        let prior = level_prior(models.flat_map(|indexed| &indexed.own_levels));
        self.level_prior = prior;
    }

    pub(crate) fn all(&self) -> impl Iterator<Item = (ObjectId, &Arc<LibraryEntry>)> {
        self.objects.iter().map(|(id, object)| (*id, object))
    }

    pub(crate) fn indexed_models(&self) -> impl Iterator<Item = (ObjectId, &IndexedModel)> {
        self.objects
            .iter()
            .map(|(id, object)| (*id, &object.indexed))
    }

    pub(crate) fn indexed(&self, id: ObjectId) -> Option<&IndexedModel> {
        self.objects.get(&id).map(|object| &object.indexed)
    }

    /// What the densities of contacts with a model depend on beside its surfels.
    pub(crate) fn percept_context<'a>(&'a self, indexed: &'a IndexedModel) -> PerceptContext<'a> {
        PerceptContext {
            places: &indexed.places,
            level_prior: &self.level_prior,
            clutter_per_m3: self.clutter_per_m3(),
        }
    }

    /// An even sample of the places of all models, for the background model.
    pub(crate) fn samples(&self) -> &[Sample] {
        &self.samples
    }

    pub(crate) fn level_prior(&self) -> &[LevelPrior] {
        &self.level_prior
    }

    /// Density of contacts with something else \[1/m³\]: uniform in a ball of the largest model's
    /// extent.
    pub(crate) fn clutter_per_m3(&self) -> f64 {
        1.0 / (FRAC_PI_6 * self.extent_m().max(1e-6).powi(3))
    }

    /// Extent of the largest model \[m\].
    pub(crate) fn extent_m(&self) -> f64 {
        self.extent_m
    }
}
