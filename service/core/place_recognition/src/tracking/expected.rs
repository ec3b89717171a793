//! How probable a view is about an estimate, by those that a map has there.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Vector3};

use super::view_map::{Similar, ViewMap};
use crate::similarity::{LoggedView, Turned};
use crate::tuning::tracking as tuning;

/// A view beside those that a map has about an estimate.
#[derive(Debug)]
pub(super) struct Expected {
    range_m: f64,
    turned: Turned,
    /// By their x.
    about: Vec<About>,
}

/// A view about the estimate.
#[derive(Debug)]
struct About {
    position: Point3<f64>,
    /// Turn of the body about the vertical, beyond that of the estimate \[rad\].
    turn_rad: f64,
    /// Cosine of half the angle by which it is tilted beside that.
    upright: f64,
    log_likelihood: f64,
}

impl Expected {
    /// Of a view by its components, within the corners of a box about an estimate \[m\].
    pub(super) fn of(
        components: &[f32],
        view: &LoggedView,
        map: &ViewMap,
        (estimate, [low, high]): (&Isometry3<f64>, [Point3<f64>; 2]),
    ) -> Self {
        let model = &map.model;
        let reach = Vector3::repeat(tuning::KERNEL_REACH * tuning::WIDTH * model.range_m);
        let similar = map.similar(components, view, &[low - reach, high + reach]);
        let about = similar.into_iter().map(|similar: Similar| {
            let turned = similar.pose.rotation * estimate.rotation.inverse();
            About {
                position: similar.pose.translation.vector.into(),
                turn_rad: 2.0 * turned.k.atan2(turned.w),
                upright: turned.w.hypot(turned.k),
                log_likelihood: similar.log_likelihood,
            }
        });
        let mut about: Vec<About> = about.collect();
        about.sort_by(|a, b| a.position.x.total_cmp(&b.position.x));
        Self {
            range_m: model.range_m,
            turned: model.turned,
            about,
        }
    }

    /// Side within which a view is as probable everywhere \[m\].
    pub(super) fn side_m(&self) -> f64 {
        tuning::CELL * self.range_m
    }

    /// The same of a turn \[rad\]; `None` where a turn changes nothing.
    pub(super) fn side_rad(&self) -> Option<f64> {
        let is_turned = self
            .turned
            .parts()
            .iter()
            .any(|part| *part < tuning::UNTURNED);
        is_turned.then_some(TAU / tuning::CELLS_TURNED)
    }

    /// How much more probable the view is at a position than anywhere \[nats\], of a body that has
    /// turned by an angle beyond the estimate \[rad\]: as at the views about it, with the part g of
    /// each that the turn from there leaves. Where there are none, it is as improbable as one that
    /// shows something else: that the agent has left the map is said by views that fit nowhere in
    /// it, and not by those that fit elsewhere.
    ///
    /// ```text
    /// l(x) = (½ ln ε + Σ w lⱼ) / (½ + Σ w),  w = g exp(−|x − xⱼ|² / 2h²)
    /// ```
    pub(super) fn log_likelihood(&self, at: &Point3<f64>, turn_rad: f64) -> f64 {
        let width_m = tuning::WIDTH * self.range_m;
        let reach_m = tuning::KERNEL_REACH * width_m;
        let scale = -0.5 / (width_m * width_m);
        let mut weights = tuning::UNKNOWN;
        let mut sum = tuning::UNKNOWN * tuning::ELSE.ln();
        let first = self
            .about
            .partition_point(|other| other.position.x < at.x - reach_m);
        for other in &self.about[first..] {
            if other.position.x > at.x + reach_m {
                break;
            }
            let squared = (other.position - at).norm_squared();
            if squared < reach_m * reach_m {
                let cosine = (0.5 * (other.turn_rad - turn_rad)).cos().abs() * other.upright;
                let turned = self.turned.part(2.0 * cosine.clamp(-1.0, 1.0).acos());
                let weight = (scale * squared).exp() * turned;
                weights += weight;
                sum += weight * other.log_likelihood;
            }
        }
        sum / weights
    }
}
