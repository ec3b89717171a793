//! A model's surfel map: how well its surface explains contacts from a pose.

use std::f64::consts::FRAC_1_PI;

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::contact::Contact;
use crate::index::cell_lists::CellLists;
use crate::indexed_place::IndexedPlace;
use crate::level_prior::LevelPrior;
use crate::surfels::coverage_test::CoverageTest;
use crate::surfels::deformation_test::Height;
use crate::surfels::local_surface::{Densities, LocalSurface};
use crate::surfels::point_pairs::PointPairTable;
use crate::surfels::pose_fit::PoseFit;
use crate::surfels::surfel::{ContactNoise, Surfel};
use crate::tuning::{COARSE_MIN, OUTLIER_SHARE, SMOOTH_COS};

/// A model with normals. Its frame is the model's, moved so that the mean of the places is the
/// origin: rotations about it are then hardly correlated with translations.
#[derive(Clone, Debug)]
pub(crate) struct SurfelMap {
    /// The mean of the places, in the model's frame \[m\].
    pub(crate) middle: Vector3<f64>,
    pub(crate) surfels: Vec<Surfel>,
    pub(crate) pairs: PointPairTable,
    pub(crate) area_m2: f64,
    /// Diameter of a ball about the origin that holds the surfels \[m\].
    pub(crate) extent_m: f64,
    /// Distance within which contacts are of one place \[m\].
    pub(crate) spacing_m: f64,
    pub(crate) coverage_test: CoverageTest,
    /// Radius of the disc of places to which a surfel was fitted \[m\].
    pub(super) correlation_m: f64,
    pub(super) cells: CellLists,
    /// Mean and standard deviation of a contact's log density in the right pose.
    pub(super) expected: (f64, f64),
}

/// What the densities of a contact depend on beside the surfels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PerceptContext<'a> {
    /// The model's places.
    pub(crate) places: &'a [IndexedPlace],
    /// Levels over the whole library.
    pub(crate) level_prior: &'a [LevelPrior],
    /// Density of contacts with something else \[1/m³\].
    pub(crate) clutter_per_m3: f64,
}

/// One contact from one pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactFit {
    /// Log density, as in [`PoseFit::score`].
    pub(crate) log: f64,
    /// Probability that it is one with this model, and no outlier.
    pub(crate) share: f64,
    /// Its height over the surface, if there is one.
    pub(crate) height: Option<Height>,
}

/// A contact where a pose puts it.
struct ContactAt {
    point: Point3<f64>,
    normal: Option<Unit<Vector3<f64>>>,
    /// Density per metre of depth and steradian, times the model's area.
    density: f64,
    /// Probability that it is one with this model, and no outlier.
    share: f64,
    /// The surface there, with the densities of the contact.
    surface: Option<(LocalSurface, Densities)>,
}

impl SurfelMap {
    /// Mean and standard deviation of the log density of a contact in the right pose.
    pub(crate) fn expected(&self) -> (f64, f64) {
        self.expected
    }

    /// Correlation of the errors that this map makes at two contacts, exp(−d²/4ℓ²): surfels that
    /// share places have the same errors. It has fallen to 1/e where their discs of radius ℓ part.
    pub(crate) fn error_correlation(&self, one: &Contact, other: &Contact) -> f64 {
        let is_one_side = match (one.normal, other.normal) {
            (Some(one), Some(other)) => one.dot(&other) > SMOOTH_COS,
            _ => true,
        };
        if !is_one_side {
            return 0.0;
        }
        let apart = one.position_m - other.position_m;
        (-0.25 * apart.norm_squared() / (self.correlation_m * self.correlation_m)).exp()
    }

    /// Density of an outlier per metre and steradian, times the model's area.
    fn outlier(&self, context: PerceptContext<'_>) -> f64 {
        OUTLIER_SHARE * self.area_m2 * context.clutter_per_m3 * 0.25 * FRAC_1_PI
    }

    /// Log density of one contact, as in [`PoseFit::score`].
    pub(crate) fn contact_log(
        &self,
        pose: &Isometry3<f64>,
        contact: &Contact,
        context: PerceptContext<'_>,
    ) -> f64 {
        self.fit_contact(pose, contact, context).log
    }

    /// One contact from a pose.
    pub(crate) fn fit_contact(
        &self,
        pose: &Isometry3<f64>,
        contact: &Contact,
        context: PerceptContext<'_>,
    ) -> ContactFit {
        let seen = self.contact_at(pose, contact, 1.0, context);
        let surface = seen.surface.as_ref();
        ContactFit {
            log: seen.density.ln(),
            share: seen.share,
            height: surface
                .map(|(surface, densities)| surface.height(&seen.point, densities, seen.share)),
        }
    }

    /// A cheap score of one contact for poses that are not yet right: of the one surfel that
    /// explains it best.
    pub(crate) fn coarse_score(
        &self,
        pose: &Isometry3<f64>,
        contact: &Contact,
        noise: &ContactNoise,
    ) -> f64 {
        let point = pose * contact.position_m;
        let normal = contact.normal.map(|normal| pose * normal);
        let mut best = COARSE_MIN;
        for &number in self.cells.near(&point) {
            let surfel = &self.surfels[number as usize];
            let apart = point - surfel.position;
            let depth_m = apart.dot(&surfel.normal);
            let depth = (surfel.depth_m2 + noise.position_m2) * noise.widen;
            let tangent = (surfel.tangent_m2 + noise.position_m2) * 2.0;
            let mut half =
                depth_m * depth_m / depth + (apart.norm_squared() - depth_m * depth_m) / tangent;
            if let Some(normal) = &normal {
                let own = surfel.normal + surfel.bend * apart;
                let angle = surfel.angle_along(noise);
                half += (normal.into_inner() - own).norm_squared() / angle;
            }
            best = best.max(-0.5 * half);
        }
        best
    }

    /// Contacts from a pose, with all their variances multiplied by `widen`.
    pub(crate) fn fit_pose<'a>(
        &self,
        pose: &Isometry3<f64>,
        contacts: impl Iterator<Item = &'a Contact>,
        widen: f64,
        context: PerceptContext<'_>,
    ) -> PoseFit {
        let mut fit = PoseFit::new();
        for contact in contacts {
            let seen = self.contact_at(pose, contact, widen, context);
            fit.score += seen.density.ln();
            if let Some((surface, densities)) = &seen.surface {
                let normal = seen.normal.as_ref().map(Unit::as_ref);
                fit.add(&surface.motion(&seen.point, normal, densities, seen.share));
            }
        }
        fit.add_prior(self.extent_m);
        fit
    }

    /// One contact from a pose, with all its variances multiplied by `widen`.
    fn contact_at(
        &self,
        pose: &Isometry3<f64>,
        contact: &Contact,
        widen: f64,
        context: PerceptContext<'_>,
    ) -> ContactAt {
        let point = pose * contact.position_m;
        let turned = contact.normal.map(|normal| pose * normal);
        let normal = turned.as_ref().map(Unit::as_ref);
        let noise = ContactNoise::of(contact, widen);
        let percept = |surfel: &Surfel| percept(surfel, contact, context);
        let surface = LocalSurface::new(&point, normal, &noise, self.near(&point), percept);
        let surface = surface.map(|surface| (surface, surface.densities(normal, &noise)));
        let on_surface = surface.as_ref().map_or(0.0, |(_, densities)| {
            (1.0 - OUTLIER_SHARE) * densities.sum()
        });
        let density = on_surface + self.outlier(context);
        ContactAt {
            point,
            normal: turned,
            density,
            share: on_surface / density,
            surface,
        }
    }

    /// The surfels within whose reach a point may lie.
    fn near(&self, point: &Point3<f64>) -> impl Iterator<Item = &Surfel> + Clone {
        let near = self.cells.near(point).iter();
        near.map(|&number| &self.surfels[number as usize])
    }
}

/// Likelihood ratio of a contact's levels and descriptors: at a surfel's place, against anywhere.
fn percept(surfel: &Surfel, contact: &Contact, context: PerceptContext<'_>) -> f64 {
    if contact.levels.is_empty() && contact.descriptors.is_empty() {
        return 1.0;
    }
    let place = context.places.get(surfel.place as usize);
    place.map_or(1.0, |place| {
        place.percept_log(contact, context.level_prior).exp()
    })
}

/// A contact in a frame whose origin is this point.
pub(crate) fn relative_to(contact: &Contact, origin: &Point3<f64>) -> Contact {
    let mut contact = contact.clone();
    contact.position_m = Point3::from(contact.position_m - origin);
    contact
}
