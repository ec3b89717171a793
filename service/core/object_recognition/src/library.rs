//! The maps that may be meant.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_6;
use std::sync::Arc;

use nalgebra::Point3;

use super::model::ObjectModel;
use super::surface::{Surface, Wide, wide};

/// Most places from which is judged what a surface is like: shares of it are then good to a few
/// hundredths.
const SAMPLES: usize = 256;

/// A map, as the caller numbers them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub u32);

/// One map and its index.
#[derive(Debug)]
pub(super) struct Known {
    model: ObjectModel,
    pub(super) surface: Surface,
}

/// A place of a map.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub(super) object: ObjectId,
    /// Number among the map's spots.
    pub(super) spot: u32,
    pub(super) position: Point3<f64>,
}

/// The maps that may be meant, each with its index.
///
/// Putting a model makes its index, which takes some milliseconds per thousand places; recognising
/// changes nothing here.
#[derive(Clone, Debug, Default)]
pub struct ObjectLibrary {
    /// Shared with the library's clones, so that a snapshot costs a pointer per object.
    objects: BTreeMap<ObjectId, Arc<Known>>,
    wide: Vec<Wide>,
    samples: Vec<Sample>,
    extent_m: f64,
}

impl ObjectLibrary {
    /// Puts a model, in place of what was learned of the same object before. Episodes that run go on
    /// with what they have gathered.
    pub fn put(&mut self, id: ObjectId, model: ObjectModel) {
        let surface = Surface::new(&model);
        self.objects.insert(id, Arc::new(Known { model, surface }));
        self.survey();
    }

    /// Forgets an object, and says whether there was one.
    pub fn remove(&mut self, id: ObjectId) -> bool {
        let removed = self.objects.remove(&id).is_some();
        self.survey();
        removed
    }

    /// A library of some of these objects, each under a number of its own.
    #[must_use]
    pub fn select(&self, objects: impl IntoIterator<Item = (ObjectId, ObjectId)>) -> Self {
        let mut selected = Self::default();
        for (id, number) in objects {
            if let Some(object) = self.objects.get(&id) {
                selected.objects.insert(number, Arc::clone(object));
            }
        }
        selected.survey();
        selected
    }

    /// What was learned of an object.
    pub fn get(&self, id: ObjectId) -> Option<&ObjectModel> {
        self.objects.get(&id).map(|object| &object.model)
    }

    /// All objects, by number.
    pub fn iter(&self) -> impl Iterator<Item = (ObjectId, &ObjectModel)> {
        self.objects.iter().map(|(id, object)| (*id, &object.model))
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.objects.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    fn survey(&mut self) {
        let extents = self.surfaces().map(|(_, surface)| surface.extent_m);
        self.extent_m = extents.fold(0.0, f64::max);
        let places = || {
            self.surfaces().flat_map(|(object, surface)| {
                let count = u32::try_from(surface.patches.len()).unwrap_or(u32::MAX);
                (0..count).map(move |place| (object, place))
            })
        };
        let step = places().count().div_ceil(SAMPLES).max(1);
        let samples = places().skip(step / 2).step_by(step);
        let sample = |(object, spot): (ObjectId, u32)| {
            let surface = self.surface(object)?;
            let patch = surface.patches.get(surface.spots.patch(spot as usize))?;
            Some(Sample {
                object,
                spot,
                position: patch.position,
            })
        };
        self.samples = samples.filter_map(sample).collect();
        self.wide = wide(self.objects.values().map(|object| &object.surface));
    }

    pub(super) fn all(&self) -> impl Iterator<Item = (ObjectId, &Arc<Known>)> {
        self.objects.iter().map(|(id, object)| (*id, object))
    }

    pub(super) fn surfaces(&self) -> impl Iterator<Item = (ObjectId, &Surface)> {
        self.objects
            .iter()
            .map(|(id, object)| (*id, &object.surface))
    }

    pub(super) fn surface(&self, id: ObjectId) -> Option<&Surface> {
        self.objects.get(&id).map(|object| &object.surface)
    }

    /// Some places, spread evenly over all maps: what a surface is like.
    pub(super) fn samples(&self) -> &[Sample] {
        &self.samples
    }

    pub(super) fn wide(&self) -> &[Wide] {
        &self.wide
    }

    /// Density of contacts with something of which only the size is known, that of the largest map, per m³.
    pub(super) fn elsewhere(&self) -> f64 {
        1.0 / (FRAC_PI_6 * self.extent_m().max(1e-6).powi(3))
    }

    /// Extent of the largest map \[m\].
    pub(super) fn extent_m(&self) -> f64 {
        self.extent_m
    }
}
