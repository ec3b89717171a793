//! A map's facets, their index, and how well they explain contacts from a pose.

use std::f64::consts::{FRAC_1_PI, TAU};

use nalgebra::{Isometry3, Matrix6, Point3, Unit, Vector3, Vector6};

use super::cells::Cells;
use super::contact::Contact;
use super::encounter::Encounter;
use super::facet::{ALONG_MAX, Facet, Noise, PATCH_COS, SMOOTH_NEIGHBOURS, facets};
use super::halves::Halves;
use super::model::ObjectModel;
use super::pairs::Pairs;
use super::strain::Height;
use super::surface::{Patch, Wide};
use geometry::se3;

/// Facets farther along the surface than this many deviations of their reach do not count.
const REACH_SD: f64 = 2.45;
/// Share of contacts that the map does not explain.
const OUTLIERS: f64 = 0.02;
/// Cells of a third of a reach keep the lists near what is within reach indeed.
const CELL_PER_REACH: f64 = 0.33;
/// Most places from which it is told how well a right pose explains contacts.
const REHEARSED: usize = 256;
/// Deviations beyond which a rough score no longer falls, in nats.
const ROUGH_WORST: f64 = -12.0;

/// A map with normals, ready to be laid under contacts in any pose. Its frame is the model's, moved so
/// that the middle of the places is the origin: turns about it are then hardly tied to shifts.
#[derive(Clone, Debug)]
pub(super) struct Relief {
    /// The middle of the places, in the model's frame \[m\].
    pub(super) middle: Vector3<f64>,
    pub(super) facets: Vec<Facet>,
    pub(super) pairs: Pairs,
    pub(super) area_m2: f64,
    pub(super) extent_m: f64,
    /// Distance within which what is felt is of one place \[m\].
    pub(super) spacing_m: f64,
    /// Parts of equal area.
    pub(super) halves: Halves,
    /// Radius of the disc of places that make a patch \[m\].
    alike_m: f64,
    cells: Cells,
    expected: (f64, f64),
}

/// What a relief is laid under contacts with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene<'a> {
    /// The patches of the places.
    pub(super) patches: &'a [Patch],
    /// What percepts are anywhere.
    pub(super) wide: &'a [Wide],
    /// Density of contacts with something else, per m³.
    pub(super) elsewhere: f64,
}

/// One contact from one pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    /// Log density, as in [`Explained::score`].
    pub(super) log: f64,
    /// Probability that it is one with this map.
    pub(super) share: f64,
    /// How it lies over the map, if it lies there.
    pub(super) height: Option<Height>,
}

/// Contacts from one pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Explained {
    /// Σ log density per metre of depth and steradian: what an even touch of each part of the surface has,
    /// times its area.
    pub(super) score: f64,
    /// Information about a motion on the pose's left, from depths and normals.
    pub(super) information: Matrix6<f64>,
    /// The same with the pull of the map's edges.
    normal_matrix: Matrix6<f64>,
    gradient: Vector6<f64>,
}

impl Relief {
    /// Of a model with normals; `None` if it has none.
    pub(super) fn new(model: &ObjectModel) -> Option<Self> {
        let mut facets = facets(model.places());
        if facets.len() < 3 {
            return None;
        }
        let sum = facets
            .iter()
            .fold(Vector3::zeros(), |sum, facet| sum + facet.position.coords);
        let middle = sum / facets.len() as f64;
        for facet in &mut facets {
            facet.position -= middle;
        }
        let radius_m = facets
            .iter()
            .map(|f| f.position.coords.norm())
            .fold(1e-9, f64::max);
        let extent_m = 2.0 * radius_m;
        let noise_m2 = model
            .places()
            .iter()
            .map(|p| p.variance_m2 / p.count)
            .sum::<f64>()
            / model.places().len() as f64;
        let positions: Vec<_> = facets.iter().map(|facet| facet.position).collect();
        let reaches: Vec<_> = facets
            .iter()
            .map(|facet| REACH_SD * (facet.tangent_m2 + noise_m2).sqrt())
            .collect();
        let area_m2 = facets.iter().map(|facet| facet.area_m2).sum::<f64>();
        let mut relief = Self {
            middle,
            pairs: Pairs::new(&facets, extent_m),
            cells: Cells::new(&positions, &reaches, CELL_PER_REACH),
            area_m2,
            extent_m,
            spacing_m: model.spacing_m(),
            halves: Halves::default(),
            alike_m: 0.0,
            facets,
            expected: (0.0, 1.0),
        };
        for _ in 0..2 {
            relief.even(noise_m2);
        }
        relief.area_m2 = relief.facets.iter().map(|facet| facet.area_m2).sum::<f64>();
        let place_m2 = relief.area_m2 / relief.facets.len() as f64;
        relief.alike_m = (SMOOTH_NEIGHBOURS as f64 * place_m2 * FRAC_1_PI).sqrt();
        relief.halves = Halves::new(&relief.facets);
        relief.expected = relief.rehearse(model);
        Some(relief)
    }

    /// Mean and standard deviation of the log density of a contact with this map in the right pose.
    pub(super) fn expected(&self) -> (f64, f64) {
        self.expected
    }

    /// How much two contacts share the errors of this map, 0 to 1. Patches that share places err alike; it has
    /// fallen to 1/e where their discs part.
    pub(super) fn alike(&self, one: &Contact, other: &Contact) -> f64 {
        let one_side = match (one.normal, other.normal) {
            (Some(one), Some(other)) => one.dot(&other) > PATCH_COS,
            _ => true,
        };
        if !one_side {
            return 0.0;
        }
        let apart = one.position_m - other.position_m;
        (-0.25 * apart.norm_squared() / (self.alike_m * self.alike_m)).exp()
    }

    /// Makes the sum of the facets one at every place: where places are dense each stands for less area, at
    /// edges for more.
    fn even(&mut self, noise_m2: f64) {
        let sums: Vec<f64> = self
            .facets
            .iter()
            .map(|own| {
                let near = self.cells.near(&own.position).iter();
                near.map(|&number| {
                    let facet = &self.facets[number as usize];
                    let along = 0.5 * facet.against(&own.position).along_m2;
                    let tangent = facet.tangent_m2 + noise_m2;
                    let same = facet.normal.dot(&own.normal) > 0.5 && along < ALONG_MAX * tangent;
                    let weight = facet.area_m2 / (TAU * tangent) * (-along / tangent).exp();
                    if same { weight } else { 0.0 }
                })
                .sum()
            })
            .collect();
        for (facet, sum) in self.facets.iter_mut().zip(sums) {
            // A place of which its own field is all there is stands for what it does.
            facet.area_m2 /= sum.max(0.25);
        }
    }

    /// The places taken for contacts, each explained by the others.
    fn rehearse(&self, model: &ObjectModel) -> (f64, f64) {
        let step = self.facets.len().div_ceil(REHEARSED).max(1);
        let floor = 1e-3 * self.area_m2 / self.extent_m.powi(3);
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for own in (0..self.facets.len()).step_by(step) {
            let place = &model.places()[self.facets[own].place as usize];
            let point = place.position_m - self.middle;
            let normal = place.normal();
            let normal = normal.as_ref().map(Unit::as_ref);
            let noise = Noise {
                position_m2: place.variance_m2 / place.count,
                normal: place.normal_variance / place.count,
                widen: 1.0,
            };
            let others = { self.cells.near(&point).iter() }
                .filter(|&&number| number as usize != own)
                .map(|&number| &self.facets[number as usize]);
            let met = Encounter::new(&point, normal, &noise, others, |_| 1.0);
            let total = met.map_or(0.0, |met| met.densities(normal, &noise).sum());
            let log = ((1.0 - OUTLIERS) * total + floor).ln();
            count += 1.0;
            sum += log;
            squares += log * log;
        }
        let mean: f64 = sum / count;
        (mean, (squares / count - mean * mean).max(0.01).sqrt())
    }

    /// Density of an outlier per metre and steradian, times the map's area.
    fn outlier(&self, scene: Scene<'_>) -> f64 {
        OUTLIERS * self.area_m2 * scene.elsewhere * 0.25 * FRAC_1_PI
    }

    /// Log density of one contact, as in [`Explained::score`].
    pub(super) fn log(&self, pose: &Isometry3<f64>, contact: &Contact, scene: Scene<'_>) -> f64 {
        self.meet(pose, contact, scene).log
    }

    /// One contact from a pose.
    pub(super) fn meet(&self, pose: &Isometry3<f64>, contact: &Contact, scene: Scene<'_>) -> Met {
        let point = pose * contact.position_m;
        let normal = contact.normal.map(|normal| pose * normal);
        let normal = normal.as_ref().map(Unit::as_ref);
        let noise = Noise::of(contact, 1.0);
        let percept = |facet: &Facet| percept(facet, contact, scene);
        let outlier = self.outlier(scene);
        let met = Encounter::new(&point, normal, &noise, self.about(&point), percept);
        let Some(met) = met else {
            return Met {
                log: outlier.ln(),
                share: 0.0,
                height: None,
            };
        };
        let densities = met.densities(normal, &noise);
        let total = (1.0 - OUTLIERS) * densities.sum();
        let all = total + outlier;
        let share = total / all;
        Met {
            log: all.ln(),
            share,
            height: Some(met.height(&point, &densities, share)),
        }
    }

    /// A rough score of one contact, cheap, for poses that are not yet right: of the one facet that
    /// explains it best.
    pub(super) fn rough(&self, pose: &Isometry3<f64>, contact: &Contact, noise: &Noise) -> f64 {
        let point = pose * contact.position_m;
        let normal = contact.normal.map(|normal| pose * normal);
        let mut best = ROUGH_WORST;
        for &number in self.cells.near(&point) {
            let facet = &self.facets[number as usize];
            let apart = point - facet.position;
            let depth_m = apart.dot(&facet.normal);
            let depth = (facet.depth_m2 + noise.position_m2) * noise.widen;
            let tangent = (facet.tangent_m2 + noise.position_m2) * 2.0;
            let mut half =
                depth_m * depth_m / depth + (apart.norm_squared() - depth_m * depth_m) / tangent;
            if let Some(normal) = &normal {
                let own = facet.normal + facet.bend * apart;
                let angle = facet.angle_along(noise);
                half += (normal.into_inner() - own).norm_squared() / angle;
            }
            best = best.max(-0.5 * half);
        }
        best
    }

    /// Score of contacts from a pose, and what moves it.
    pub(super) fn explain<'a>(
        &self,
        pose: &Isometry3<f64>,
        contacts: impl Iterator<Item = &'a Contact>,
        widen: f64,
        scene: Scene<'_>,
    ) -> Explained {
        let mut explained = Explained {
            score: 0.0,
            information: Matrix6::zeros(),
            normal_matrix: Matrix6::zeros(),
            gradient: Vector6::zeros(),
        };
        for contact in contacts {
            self.gather(pose, contact, widen, scene, &mut explained);
        }
        // Nothing is known beforehand but that the map lies about the contacts, turned anyhow.
        let beforehand = Vector6::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
            / (self.extent_m * self.extent_m)
            + Vector6::new(0.0, 0.0, 0.0, 0.25, 0.25, 0.25);
        explained.information += Matrix6::from_diagonal(&beforehand);
        explained.normal_matrix += explained.information;
        explained
    }

    fn gather(
        &self,
        pose: &Isometry3<f64>,
        contact: &Contact,
        widen: f64,
        scene: Scene<'_>,
        explained: &mut Explained,
    ) {
        let point = pose * contact.position_m;
        let turned = contact.normal.map(|normal| pose * normal);
        let normal = turned.as_ref().map(Unit::as_ref);
        let noise = Noise::of(contact, widen);
        let percept = |facet: &Facet| percept(facet, contact, scene);
        let Some(met) = Encounter::new(&point, normal, &noise, self.about(&point), percept) else {
            explained.score += self.outlier(scene).ln();
            return;
        };
        let densities = met.densities(normal, &noise);
        let total = (1.0 - OUTLIERS) * densities.sum();
        let all = total + self.outlier(scene);
        explained.score += all.ln();
        let motion = met.motion(&point, normal, &densities, total / all);
        explained.information += motion.information;
        explained.normal_matrix += motion.held;
        explained.gradient += motion.gradient;
    }

    /// The facets whose reach a point may lie in.
    fn about(&self, point: &Point3<f64>) -> impl Iterator<Item = &Facet> + Clone {
        let near = self.cells.near(point).iter();
        near.map(|&number| &self.facets[number as usize])
    }
}

impl Explained {
    /// The pose one Gauss–Newton step nearer to the contacts.
    pub(super) fn step(&self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let Some(cholesky) = self.normal_matrix.cholesky() else {
            return *pose;
        };
        let step = cholesky.solve(&self.gradient);
        let linear = Vector3::new(step[0], step[1], step[2]);
        let angular = Vector3::new(step[3], step[4], step[5]);
        // A step farther than the contacts' neighbourhood is not to be trusted.
        let most = (0.3 / angular.norm().max(1e-12)).min(1.0);
        se3::exp(&(linear * most), &(angular * most)) * pose
    }
}

/// Likelihood of a contact's levels and descriptors at a facet's place, against anywhere.
fn percept(facet: &Facet, contact: &Contact, scene: Scene<'_>) -> f64 {
    if contact.levels.is_empty() && contact.descriptors.is_empty() {
        return 1.0;
    }
    let patch = scene.patches.get(facet.place as usize);
    patch.map_or(1.0, |patch| patch.percept_log(contact, scene.wide).exp())
}

/// A point of the episode in the frame of its first contact, where nothing is far away.
pub(super) fn local(contact: &Contact, origin: &Point3<f64>) -> Contact {
    let mut contact = contact.clone();
    contact.position_m = Point3::from(contact.position_m - origin);
    contact
}
