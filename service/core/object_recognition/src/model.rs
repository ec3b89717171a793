//! What is learned of one map: places by contact.

use std::collections::BTreeMap;

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

use super::contact::{Contact, Felt, Seen};
use grid::Lattice;

/// Normals more than 60° apart are two sides of something thin, or of an edge: two places.
const SAME_SIDE_COS: f64 = 0.5;

/// How a map is learned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelSettings {
    /// Contacts within this distance \[m\], on the same side of the surface, are of one place. About the
    /// finest structure that is worth remembering, and not below the noise of a contact.
    pub spacing_m: f64,
    /// Most places, at least 8. A map that grows beyond keeps its extent and doubles its spacing.
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

/// What a place remembers of a channel's levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelMemory {
    /// Channel.
    pub channel: u16,
    /// Levels felt.
    pub count: f64,
    /// Mean.
    pub mean: f64,
    /// Sum of squared differences from the mean.
    pub squares: f64,
    /// Sum of the levels' own noise variances.
    pub noise: f64,
}

impl LevelMemory {
    fn add(&mut self, other: &Self) {
        let count = self.count + other.count;
        let apart = other.mean - self.mean;
        self.squares += other.squares + apart * apart * self.count * other.count / count;
        self.mean += apart * other.count / count;
        self.noise += other.noise;
        self.count = count;
    }

    /// Variance of a noiseless level that will be felt here, about the mean: that of the mean's error and
    /// what the place's levels scatter beyond their noise.
    pub fn variance(&self) -> f64 {
        let noise = self.noise / self.count;
        let scatter = if self.count > 1.5 {
            (self.squares / (self.count - 1.0) - noise).max(0.0)
        } else {
            0.0
        };
        scatter + (noise + scatter) / self.count
    }
}

/// One learned place of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelPlace {
    /// Mean position of its contacts \[m\], in the map's frame.
    pub position_m: Point3<f64>,
    /// Sum of their normals; zero where none was felt.
    pub normals: Vector3<f64>,
    /// Contacts.
    pub count: f64,
    /// Sum of the contacts' position variances per axis \[m²\].
    pub variance_m2: f64,
    /// Sum of the normals' variances per axis \[rad²\].
    pub normal_variance: f64,
    /// Levels by channel.
    pub levels: Vec<LevelMemory>,
    /// Descriptors by channel: the first one seen.
    pub descriptors: Vec<Seen>,
}

impl ModelPlace {
    /// The outward normal, if one was felt.
    pub fn normal(&self) -> Option<Unit<Vector3<f64>>> {
        Unit::try_new(self.normals, 1e-9)
    }

    /// A contact with the place, as one of those that taught it.
    pub fn felt(&self) -> Contact {
        let mut contact = Contact::at(self.position_m, (self.variance_m2 / self.count).sqrt());
        if let Some(normal) = self.normal() {
            contact = contact.with_normal(normal, (self.normal_variance / self.count).sqrt());
        }
        contact.levels.extend(self.levels.iter().map(|level| Felt {
            channel: level.channel,
            value: level.mean,
            sd: (level.noise / level.count).sqrt(),
        }));
        contact.descriptors.clone_from(&self.descriptors);
        contact
    }

    fn of(contact: &Contact) -> Self {
        let normals = contact.normal.map_or(Vector3::zeros(), Unit::into_inner);
        let level = |felt: &Felt| LevelMemory {
            channel: felt.channel,
            count: 1.0,
            mean: felt.value,
            squares: 0.0,
            noise: felt.sd * felt.sd,
        };
        Self {
            position_m: contact.position_m,
            normals,
            count: 1.0,
            variance_m2: contact.variance_m2(),
            normal_variance: contact.normal_sd_rad * contact.normal_sd_rad,
            levels: contact.levels.iter().map(level).collect(),
            descriptors: contact.descriptors.clone(),
        }
    }

    /// Whether both are of the same side of the surface, as far as is known.
    fn same_side(&self, other: &Self) -> bool {
        match (self.normal(), other.normal()) {
            (Some(a), Some(b)) => a.dot(&b) >= SAME_SIDE_COS,
            _ => true,
        }
    }

    fn merge(&mut self, other: &Self) {
        let count = self.count + other.count;
        self.position_m += (other.position_m - self.position_m) * (other.count / count);
        self.normals += other.normals;
        self.count = count;
        self.variance_m2 += other.variance_m2;
        self.normal_variance += other.normal_variance;
        for level in &other.levels {
            match self
                .levels
                .iter_mut()
                .find(|own| own.channel == level.channel)
            {
                Some(own) => own.add(level),
                None => self.levels.push(*level),
            }
        }
        for seen in &other.descriptors {
            if self
                .descriptors
                .iter()
                .all(|own| own.channel != seen.channel)
            {
                self.descriptors.push(seen.clone());
            }
        }
    }
}

/// What has been learned of one map (an object, a space's places): places, in the frame in which they
/// were learned, in the order in which they were first touched.
///
/// Several visits extend a model if their contacts are given in the same frame. Memory is bounded by
/// [`ModelSettings::places_max`]; work per contact by the places within one spacing.
#[derive(Clone, Debug)]
pub struct ObjectModel {
    settings: ModelSettings,
    spacing_m: f64,
    places: Vec<ModelPlace>,
    by_cell: BTreeMap<[i64; 3], Vec<u32>>,
}

impl ObjectModel {
    /// A model of which nothing is known yet.
    pub fn new(settings: ModelSettings) -> Self {
        Self {
            settings,
            spacing_m: settings.spacing_m.max(1e-9),
            places: Vec::new(),
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
            by_cell: BTreeMap::new(),
        };
        for place in 0..model.places.len() {
            model.index(place);
        }
        model
    }

    /// Learns one contact, whose position is in the model's frame.
    pub fn learn(&mut self, contact: &Contact) {
        self.add(&ModelPlace::of(contact));
        self.keep_budget();
    }

    fn keep_budget(&mut self) {
        while self.places.len() > self.settings.places_max.max(8) {
            self.spacing_m *= 2.0;
            self.by_cell.clear();
            for place in std::mem::take(&mut self.places) {
                self.add(&place);
            }
        }
    }

    /// Learns all places of another model, whose frame lies in this one's so.
    pub fn extend(&mut self, other: &Self, self_from_other: &nalgebra::Isometry3<f64>) {
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

    /// How it is learned.
    pub fn settings(&self) -> &ModelSettings {
        &self.settings
    }

    fn add(&mut self, place: &ModelPlace) {
        if let Some(own) = self.nearest(place) {
            self.unindex(own);
            self.places[own].merge(place);
            self.index(own);
        } else {
            self.places.push(place.clone());
            self.index(self.places.len() - 1);
        }
    }

    /// The nearest place of the same side within one spacing.
    fn nearest(&self, place: &ModelPlace) -> Option<usize> {
        let [i, j, k] = self.cell(&place.position_m);
        let mut best: Option<(f64, usize)> = None;
        // The rows of the lattice's inverse are at most 1.23 per spacing long: two cells to each side
        // hold all within one spacing.
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
