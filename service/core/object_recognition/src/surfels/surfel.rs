//! A surfel: an oriented, curved patch of a surface about one place.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::contact::Contact;
use crate::tuning::BEND_SINE_MAX;

/// A curved patch of surface (surface element: Pfister et al. 2000).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surfel {
    pub(crate) position: Point3<f64>,
    pub(crate) normal: Vector3<f64>,
    /// The place's own normal, not smoothed, for contacts about an edge.
    pub(crate) place_normal: Vector3<f64>,
    /// The normal at a small displacement u is `normal` + `bend` u.
    pub(crate) bend: Matrix3<f64>,
    /// Largest absolute principal curvature \[1/m\].
    pub(crate) curve: f64,
    /// Variance of the surface about the surfel, along the normal \[m²\].
    pub(crate) depth_m2: f64,
    /// Variance of the normal about the surfel's, per axis \[rad²\].
    pub(crate) angle: f64,
    /// Area that the place stands for \[m²\].
    pub(crate) area_m2: f64,
    /// Variance of the surfel's weight along the surface \[m²\].
    pub(crate) tangent_m2: f64,
    /// Number of the place it comes from.
    pub(crate) place: u32,
}

/// A point relative to a surfel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfelOffset {
    /// Height above the surfel \[m\].
    pub(crate) depth_m: f64,
    /// Squared distance along the surfel \[m²\].
    pub(crate) along_m2: f64,
    /// The surfel's normal at the point.
    pub(crate) normal: Vector3<f64>,
    /// Direction in which `depth_m` is measured.
    pub(crate) through: Vector3<f64>,
}

impl Surfel {
    /// A point relative to the surfel. Heights are over the plane that halves the angle between the
    /// normals at both ends, which is exact on a sphere or a cylinder (Rusinkiewicz 2019, "A
    /// symmetric objective function for ICP").
    pub(crate) fn against(&self, point: &Point3<f64>) -> SurfelOffset {
        let apart = point - self.position;
        // The change of the normal is tangential. On a circle of radius r it is the tangential part
        // of the chord over r: the sine of the turn.
        let mut bent = self.bend * apart;
        let mut sine2 = bent.norm_squared();
        if sine2 > BEND_SINE_MAX * BEND_SINE_MAX {
            bent *= BEND_SINE_MAX / sine2.sqrt();
            sine2 = BEND_SINE_MAX * BEND_SINE_MAX;
        }
        let cosine = (1.0 - sine2).sqrt();
        let normal = self.normal * cosine + bent;
        let through = (self.normal + normal) / (2.0 + 2.0 * cosine).sqrt();
        let depth_m = apart.dot(&through);
        SurfelOffset {
            depth_m,
            along_m2: (apart.norm_squared() - depth_m * depth_m).max(0.0),
            normal,
            through,
        }
    }

    /// Variance of a contact's normal about the surfel's, along the principal direction of largest
    /// curvature \[rad²\]: the noise of the contact's position turns the normal there.
    pub(crate) fn angle_along(&self, noise: &ContactNoise) -> f64 {
        (self.angle + noise.normal + noise.position_m2 * self.curve * self.curve) * noise.widen
    }
}

/// The noise of a contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactNoise {
    /// Variance of the position per axis \[m²\].
    pub(crate) position_m2: f64,
    /// Variance of the normal per axis \[rad²\].
    pub(crate) normal: f64,
    /// Factor of all variances: above 1 while the pose is coarse.
    pub(crate) widen: f64,
}

impl ContactNoise {
    /// Of a contact.
    pub(crate) fn of(contact: &Contact, widen: f64) -> Self {
        Self {
            position_m2: contact.variance_m2(),
            normal: contact.normal_sd_rad * contact.normal_sd_rad,
            widen,
        }
    }
}
