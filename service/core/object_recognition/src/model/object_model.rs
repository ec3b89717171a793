//! The model of one object: places, learned from contacts.

use std::collections::BTreeMap;

use grid::Lattice;
use nalgebra::{Point3, UnitQuaternion};

use crate::contact::Contact;
use crate::model::place::ModelPlace;

/// How a model is learned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelSettings {
    /// Contacts within this distance \[m\], on the same side of the surface, are of one place.
    /// About the finest structure that is worth remembering, and not below the noise of a contact.
    pub spacing_m: f64,
    /// Most places, at least 8. A model that grows beyond keeps its extent and doubles its spacing.
    pub places_max: usize,
}

impl Default for ModelSettings {
    /// Places 4 mm apart, for things that a hand can hold; 2,048 of them at most.
    fn default() -> Self {
        Self {
            spacing_m: 0.004,
            places_max: 2048,
        }
    }
}

/// The model of one object: places, in the frame in which they were learned, in the order in which
/// they were first touched.
///
/// Several visits extend a model if their contacts are given in the same frame. Memory is bounded
/// by [`ModelSettings::places_max`]; work per contact by the places within one spacing.
#[derive(Clone, Debug)]
pub struct ObjectModel {
    settings: ModelSettings,
    spacing_m: f64,
    places: Vec<ModelPlace>,
    /// The place of the latest contact.
    latest: Option<usize>,
    by_cell: BTreeMap<[i64; 3], Vec<u32>>,
}

impl ObjectModel {
    /// A model without places.
    pub fn new(settings: ModelSettings) -> Self {
        Self {
            settings,
            spacing_m: settings.spacing_m.max(1e-9),
            places: Vec::new(),
            latest: None,
            by_cell: BTreeMap::new(),
        }
    }

    /// A model with places that were learned before, as [`places`](Self::places) gave them, at the
    /// spacing that it had.
    pub fn with_places(settings: ModelSettings, spacing_m: f64, places: Vec<ModelPlace>) -> Self {
        let mut model = Self {
            settings,
            spacing_m: spacing_m.max(1e-9),
            places,
            latest: None,
            by_cell: BTreeMap::new(),
        };
        for place in 0..model.places.len() {
            model.index(place);
        }
        model
    }

    /// The same model, whose latest contact was at this place.
    pub(crate) fn after(mut self, latest: Option<usize>) -> Self {
        self.latest = latest;
        self
    }

    /// The place of the latest contact, if there was one since places were last put together.
    pub(crate) fn latest(&self) -> Option<usize> {
        self.latest
    }

    /// Learns one contact, whose position is in the model's frame.
    pub fn learn(&mut self, contact: &Contact) {
        let mut place = ModelPlace::of(contact);
        let own = self.nearest(&place);
        if own.is_some() && own == self.latest {
            place.visits = 0.0; // it is still there
        }
        self.latest = Some(self.put(&place, own));
        self.keep_budget();
    }

    fn keep_budget(&mut self) {
        while self.places.len() > self.settings.places_max.max(8) {
            self.spacing_m *= 2.0;
            self.latest = None;
            self.by_cell.clear();
            for place in std::mem::take(&mut self.places) {
                self.add(&place);
            }
        }
    }

    /// Learns all places of another model, whose frame has this pose in this one's.
    pub fn extend(&mut self, other: &Self, self_from_other: &nalgebra::Isometry3<f64>) {
        self.latest = None;
        for place in &other.places {
            let mut place = place.clone();
            place.position_m = self_from_other * place.position_m;
            place.normals = self_from_other * place.normals;
            self.add(&place);
        }
        self.keep_budget();
    }

    /// Places.
    pub fn places(&self) -> &[ModelPlace] {
        &self.places
    }

    /// Distance within which contacts are of one place \[m\].
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m
    }

    /// Mean variance of a contact about its place, per axis \[m²\]; 0 without places.
    pub(crate) fn noise_m2(&self) -> f64 {
        let noises = self.places.iter().map(|p| p.variance_m2 / p.count);
        noises.sum::<f64>() / self.places.len().max(1) as f64
    }

    /// The settings.
    pub fn settings(&self) -> &ModelSettings {
        &self.settings
    }

    fn add(&mut self, place: &ModelPlace) {
        self.put(place, self.nearest(place));
    }

    /// Merges a place into another one, or adds it; answers the number of the place that has it.
    fn put(&mut self, place: &ModelPlace, own: Option<usize>) -> usize {
        let number = own.unwrap_or(self.places.len());
        if let Some(own) = own {
            self.unindex(own);
            self.places[own].merge(place);
        } else {
            self.places.push(place.clone());
        }
        self.index(number);
        number
    }

    /// The nearest place of the same side within one spacing.
    fn nearest(&self, place: &ModelPlace) -> Option<usize> {
        let [i, j, k] = self.cell(&place.position_m);
        let mut best: Option<(f64, usize)> = None;
        // The rows of the lattice's inverse are at most 1.23 per spacing long: two cells to each
        // side hold all within one spacing.
        for cell in (-2..=2).flat_map(|a| (-2..=2).map(move |b| (a, b))) {
            let row = [i + cell.0, j + cell.1, k - 2]..=[i + cell.0, j + cell.1, k + 2];
            for own in self.by_cell.range(row).flat_map(|(_, own)| own) {
                let own = *own as usize;
                let distance_m = (self.places[own].position_m - place.position_m).norm();
                let nearer = best.is_none_or(|best| (distance_m, own) < best);
                if distance_m <= self.spacing_m && nearer && self.places[own].same_side(place) {
                    best = Some((distance_m, own));
                }
            }
        }
        best.map(|(_, own)| own)
    }

    fn cell(&self, position: &Point3<f64>) -> [i64; 3] {
        let lattice = Lattice::new(self.spacing_m, UnitQuaternion::identity());
        // Far enough from the ends that neighbours can be counted.
        lattice
            .locate(position)
            .0
            .map(|index| index.clamp(-(1 << 60), 1 << 60))
    }

    fn index(&mut self, place: usize) {
        let cell = self.cell(&self.places[place].position_m);
        let place = u32::try_from(place).expect("a model has few places");
        self.by_cell.entry(cell).or_default().push(place);
    }

    fn unindex(&mut self, place: usize) {
        let cell = self.cell(&self.places[place].position_m);
        if let Some(places) = self.by_cell.get_mut(&cell) {
            places.retain(|&other| other as usize != place);
        }
    }
}
