//! The maps that may be meant.

use std::collections::BTreeMap;

use super::model::ObjectModel;
use super::surface::{Surface, Wide, wide};

/// A map, as the caller numbers them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub u32);

/// The maps that may be meant, each with its index.
///
/// Putting a model makes its index, which takes some milliseconds per thousand places; recognising
/// changes nothing here.
#[derive(Clone, Debug, Default)]
pub struct ObjectLibrary {
    objects: BTreeMap<ObjectId, (ObjectModel, Surface)>,
    wide: Vec<Wide>,
}

impl ObjectLibrary {
    /// Puts a model, in place of what was learned of the same object before. Episodes that run go on
    /// with what they have gathered.
    pub fn put(&mut self, id: ObjectId, model: ObjectModel) {
        let surface = Surface::new(&model);
        self.objects.insert(id, (model, surface));
        self.survey();
    }

    /// Forgets an object, and says whether there was one.
    pub fn remove(&mut self, id: ObjectId) -> bool {
        let removed = self.objects.remove(&id).is_some();
        self.survey();
        removed
    }

    /// What was learned of an object.
    pub fn get(&self, id: ObjectId) -> Option<&ObjectModel> {
        self.objects.get(&id).map(|(model, _)| model)
    }

    /// All objects, by number.
    pub fn iter(&self) -> impl Iterator<Item = (ObjectId, &ObjectModel)> {
        self.objects.iter().map(|(id, (model, _))| (*id, model))
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
        self.wide = wide(self.objects.values().map(|(_, surface)| surface));
    }

    pub(super) fn surfaces(&self) -> impl Iterator<Item = (ObjectId, &Surface)> {
        self.objects.iter().map(|(id, (_, surface))| (*id, surface))
    }

    pub(super) fn surface(&self, id: ObjectId) -> Option<&Surface> {
        self.objects.get(&id).map(|(_, surface)| surface)
    }

    pub(super) fn wide(&self) -> &[Wide] {
        &self.wide
    }

    /// Extent of the largest map \[m\].
    pub(super) fn extent_m(&self) -> f64 {
        self.surfaces()
            .map(|(_, surface)| surface.extent_m)
            .fold(0.0, f64::max)
    }
}
