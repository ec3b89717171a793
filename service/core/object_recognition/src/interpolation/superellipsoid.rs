//! Superellipsoids: one form for balls, boxes, cylinders and what lies between them.

use std::ops::Range;

use nalgebra::{Matrix3, Point3, SVector, UnitQuaternion, Vector3};

/// Numbers of a superellipsoid: three each of place, turn and size, the logarithms of two
/// exponents, and its taper.
pub(super) const PARAMETERS: usize = 12;
/// Those of size, exponents and taper.
pub(super) const PARAMETERS_OF_FORM: Range<usize> = 6..PARAMETERS;
/// Least width of a tapered body, per that at its middle: beyond its tip there is none.
const WIDTH_MIN: f64 = 0.05;

/// A closed convex surface (Barr 1981, Superquadrics and angle-preserving transformations; Solina
/// and Bajcsy 1990, Recovery of parametric models from range images).
///
/// A point with the coordinates x, y and z along its axes, each per half its size, is on it if its
/// *gauge* is one: the norm ‖(‖(x, y)‖ₚ/w, z)‖ᵩ, with the width w = 1 + kz by its taper k.
/// Exponents p and q of two make an ellipsoid; a large q a cylinder, and with a large p a box.
#[derive(Clone, Debug)]
pub(super) struct Superellipsoid {
    pub(super) middle: Point3<f64>,
    /// From its axes to the model's.
    pub(super) rotation: UnitQuaternion<f64>,
    /// Half its size along each axis \[m\].
    pub(super) half_m: Vector3<f64>,
    /// Logarithms of p and q.
    pub(super) exponent_logs: [f64; 2],
    /// By how much it widens along its last axis, per half its size and its width.
    pub(super) taper: f64,
}

/// A surface about a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Distance {
    /// Distance of the point from the surface, to first order; inside it is negative \[m\].
    pub(super) off_m: f64,
    /// Direction across the surface there, outwards.
    pub(super) normal: Vector3<f64>,
    /// How much the distance grows with each parameter.
    pub(super) slopes: SVector<f64, PARAMETERS>,
}

/// The logarithm of an area \[m²\].
#[derive(Clone, Copy, Debug)]
pub(super) struct AreaLog {
    pub(super) log: f64,
    /// Its slopes by the logarithms of the sizes and of the exponents.
    pub(super) slopes: [f64; 5],
    /// Its second slopes by those of the sizes.
    pub(super) curvature: Matrix3<f64>,
}

/// Area of the unit ball, per sum of bc, ca and ab of its half sizes.
const ELLIPSOID_AREA: f64 = 4.0 * std::f64::consts::PI / 3.0;
/// By how much of that a surface grows as the first and the second exponent go from two to
/// infinity: 1.5 for a cylinder, and 24/4π for a box.
const ROUND_TO_FLAT: [f64; 2] = [0.273_24, 0.5];

/// The norm (|a|ᵖ + |b|ᵖ)^(1/p), its slopes by both, and by ln p.
///
/// Of the smaller per the larger, r, it needs t = rᵖ and s = (1 + t)^(1/p − 1) alone: per the
/// larger the norm is (1 + t) s, and the slopes are s and s t/r.
fn norm([a, b]: [f64; 2], p: f64) -> (f64, [f64; 2], f64) {
    let [a_size, b_size] = [a.abs(), b.abs()];
    let is_a_larger = a_size >= b_size;
    let (larger, smaller) = if is_a_larger {
        (a_size, b_size)
    } else {
        (b_size, a_size)
    };
    if larger < f64::MIN_POSITIVE {
        return (0.0, [0.0; 2], 0.0);
    }
    let ratio = smaller / larger;
    if ratio < f64::MIN_POSITIVE {
        let [by_a, by_b] = if is_a_larger { [1.0, 0.0] } else { [0.0, 1.0] };
        return (larger, [by_a * a.signum(), by_b * b.signum()], 0.0);
    }
    let ratio_log = ratio.ln();
    let power = (p * ratio_log).exp();
    let sum_log = power.ln_1p();
    let steep = (sum_log * (1.0 / p - 1.0)).exp();
    let norm = larger * (1.0 + power) * steep;
    let flat = steep * power / ratio;
    let by_exponent = norm * (power / (1.0 + power) * ratio_log - sum_log / p);
    let [by_a, by_b] = if is_a_larger {
        [steep, flat]
    } else {
        [flat, steep]
    };
    (norm, [by_a * a.signum(), by_b * b.signum()], by_exponent)
}

impl Superellipsoid {
    /// The surface about a point.
    pub(super) fn distance(&self, point: &Point3<f64>) -> Distance {
        let own = self
            .rotation
            .inverse_transform_vector(&(point - self.middle));
        let scaled = own.component_div(&self.half_m);
        let [p, q] = self.exponent_logs.map(f64::exp);
        let (width, taper) = self.width(scaled.z);
        let (round, [by_x, by_y], by_p) = norm([scaled.x / width, scaled.y / width], p);
        let (gauge, [by_round, by_z], by_q) = norm([round, scaled.z], q);
        let by_width = -by_round * round / width;
        let by_scaled = Vector3::new(
            by_round * by_x / width,
            by_round * by_y / width,
            by_z + by_width * taper,
        );
        let slope = by_scaled.component_div(&self.half_m);
        let steepness = slope.norm();
        if steepness < f64::MIN_POSITIVE {
            // The middle of the body: no direction leads out of it.
            return Distance {
                off_m: -self.half_m.min(),
                normal: Vector3::zeros(),
                slopes: SVector::zeros(),
            };
        }
        let mut slopes = SVector::<f64, PARAMETERS>::zeros();
        let across = slope / steepness;
        let turned = across.cross(&own);
        let sized = by_scaled.component_mul(&scaled) / steepness;
        slopes.fixed_rows_mut::<3>(0).copy_from(&-across);
        slopes.fixed_rows_mut::<3>(3).copy_from(&turned);
        slopes.fixed_rows_mut::<3>(6).copy_from(&-sized);
        slopes[9] = by_round * by_p / steepness;
        slopes[10] = by_q / steepness;
        slopes[11] = if width > WIDTH_MIN {
            by_width * scaled.z / steepness
        } else {
            0.0
        };
        Distance {
            off_m: (gauge - 1.0) / steepness,
            normal: self.rotation * across,
            slopes,
        }
    }

    /// The same with other parameters: place and turn about its own axes, and the logarithms of
    /// size and exponents, change by so much.
    pub(super) fn moved(&self, by: &SVector<f64, PARAMETERS>) -> Self {
        let three = |from: usize| Vector3::new(by[from], by[from + 1], by[from + 2]);
        let sizes = three(6).map(f64::exp);
        Self {
            middle: self.middle + self.rotation * three(0),
            rotation: self.rotation * UnitQuaternion::from_scaled_axis(three(3)),
            half_m: self.half_m.component_mul(&sizes),
            exponent_logs: [
                self.exponent_logs[0] + by[9],
                self.exponent_logs[1] + by[10],
            ],
            taper: self.taper + by[11],
        }
    }

    /// Its area: of an ellipsoid 1.4 times that of three of its rectangles, of a cylinder half as
    /// much again, and of a box nearly twice as much; between them as far as the exponents are.
    pub(super) fn area_log(&self) -> AreaLog {
        let [a, b, c] = self.half_m.into();
        let faces = Vector3::new(b * c, c * a, a * b);
        let shares = faces / faces.sum();
        let [p, q] = self.exponent_logs.map(|own| 1.0 - 2.0 * (-own).exp());
        let [along_p, along_q] = ROUND_TO_FLAT;
        let slope = |most: f64, own: f64| most * (1.0 - own) / (1.0 + most * own);
        AreaLog {
            log: (ELLIPSOID_AREA * faces.sum()).ln()
                + (along_p * p).ln_1p()
                + (along_q * q).ln_1p(),
            slopes: [
                1.0 - shares.x,
                1.0 - shares.y,
                1.0 - shares.z,
                slope(along_p, p),
                slope(along_q, q),
            ],
            curvature: Matrix3::from_diagonal(&shares) - shares * shares.transpose(),
        }
    }

    /// A point of it: in this direction along its axes, in half sizes, before it is tapered.
    pub(super) fn point(&self, direction: &Vector3<f64>) -> Point3<f64> {
        let [p, q] = self.exponent_logs.map(f64::exp);
        let (round, ..) = norm([direction.x, direction.y], p);
        let (gauge, ..) = norm([round, direction.z], q);
        let on = direction / gauge.max(f64::MIN_POSITIVE);
        let (width, _) = self.width(on.z);
        let tapered = Vector3::new(on.x * width, on.y * width, on.z);
        self.middle + self.rotation * tapered.component_mul(&self.half_m)
    }

    /// Its width so many half sizes along its last axis, and by how much that grows there.
    fn width(&self, at: f64) -> (f64, f64) {
        let width = 1.0 + self.taper * at;
        if width > WIDTH_MIN {
            (width, self.taper)
        } else {
            (WIDTH_MIN, 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bodies() -> Vec<Superellipsoid> {
        let body = |(exponents, taper): ([f64; 2], f64)| Superellipsoid {
            middle: Point3::new(0.03, -0.02, 0.5),
            rotation: UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.9, 0.3)),
            half_m: Vector3::new(0.02, 0.05, 0.035),
            exponent_logs: exponents.map(f64::ln),
            taper,
        };
        [
            ([2.0, 2.0], 0.0),
            ([2.0, 12.0], 0.4),
            ([9.0, 9.0], -0.6),
            ([1.5, 3.0], 0.0),
        ]
        .map(body)
        .to_vec()
    }

    fn points() -> impl Iterator<Item = Point3<f64>> {
        let noise = |k: u64| 0.2 * random::uniform(5, [0, 0, k]) - 0.1;
        (0..60).map(move |k| Point3::new(noise(3 * k), noise(3 * k + 1), 0.5 + noise(3 * k + 2)))
    }

    #[test]
    fn points_of_the_surface_are_at_no_distance() {
        for body in bodies() {
            for point in points() {
                let on = body.point(&(point - Point3::new(0.0, 0.0, 0.5)));
                let distance = body.distance(&on);
                assert!(distance.off_m.abs() < 1e-12, "{distance:?}");
                assert!((distance.normal.norm() - 1.0).abs() < 1e-12);
                let out = body.distance(&(on + 1e-4 * distance.normal));
                assert!((out.off_m - 1e-4).abs() < 2e-5, "{}", out.off_m);
            }
        }
    }

    #[test]
    fn areas_are_those_of_ball_cylinder_and_box() {
        let pi = std::f64::consts::PI;
        let area = |exponents: [f64; 2]| {
            let form = Superellipsoid {
                middle: Point3::origin(),
                rotation: UnitQuaternion::identity(),
                half_m: Vector3::repeat(1.0),
                exponent_logs: exponents.map(f64::ln),
                taper: 0.0,
            };
            form.area_log().log.exp()
        };
        for (exponents, expected) in [
            ([2.0, 2.0], 4.0 * pi),
            ([2.0, 1e9], 6.0 * pi),
            ([1e9, 1e9], 24.0),
        ] {
            let own = area(exponents);
            assert!((own - expected).abs() < 1e-3, "{exponents:?}: {own}");
        }
        for body in bodies() {
            let slopes = body.area_log().slopes;
            for (number, slope) in (6..).zip(slopes) {
                let mut step = SVector::zeros();
                step[number] = 1e-6;
                let [above, below] = [step, -step].map(|step| body.moved(&step).area_log().log);
                assert!(((above - below) / 2e-6 - slope).abs() < 1e-6, "{number}");
            }
        }
    }

    /// On the surface the slopes are those of the distance itself.
    #[test]
    fn slopes_are_those_of_the_distance() {
        for body in bodies() {
            for point in points() {
                let on = body.point(&(point - Point3::new(0.0, 0.0, 0.5)));
                let slopes = body.distance(&on).slopes;
                for own in 0..PARAMETERS {
                    let mut step = SVector::zeros();
                    step[own] = 1e-6;
                    let above = body.moved(&step).distance(&on).off_m;
                    let below = body.moved(&-step).distance(&on).off_m;
                    let slope = (above - below) / 2e-6;
                    assert!(
                        (slope - slopes[own]).abs() < 1e-6 + 1e-4 * slope.abs(),
                        "{own}: {slope} {}",
                        slopes[own]
                    );
                }
            }
        }
    }
}
