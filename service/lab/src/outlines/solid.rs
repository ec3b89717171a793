//! Star-shaped surfaces with a level at each point.

use std::f64::consts::TAU;

use nalgebra::{Point3, Unit, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Step of the differences by which a normal is found, per distance from the middle.
const DIFFERENCE: f64 = 1e-5;
/// Directions by which the largest area of a direction is found.
const AREA_SAMPLES: u32 = 4096;
/// Factor by which the largest area may be above that of the samples.
const AREA_MARGIN: f64 = 1.2;
/// Points of an outline between which its length is summed up.
const OUTLINE_POINTS: u32 = 2048;

/// The form of a surface about its middle.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Form {
    /// A closed line in the plane z = 0, of so many lobes of an amplitude \[m\].
    Outline {
        radius_m: f64,
        lobes: f64,
        lobe_m: f64,
        phase: f64,
    },
    /// A ball with bumps and dents: direction, amplitude \[m\] and sharpness of each.
    Blob {
        radius_m: f64,
        bumps: Vec<(Vector3<f64>, f64, f64)>,
    },
    /// A box of half extents \[m\].
    Box(Vector3<f64>),
    /// An upright cylinder: radius and half its height \[m\].
    Cylinder { radius_m: f64, half_m: f64 },
    /// An upright cone without its tip: radius at half its height, how much that grows per height,
    /// and half its height \[m\].
    Frustum {
        radius_m: f64,
        growth: f64,
        half_m: f64,
    },
    /// A convex body of faces: normal and distance from the middle \[m\] of each.
    Prism(Vec<(Vector3<f64>, f64)>),
    /// Two boxes that hold the middle: the distances of the faces of each from it, on the negative
    /// and the positive side \[m\].
    Bracket([[Vector3<f64>; 2]; 2]),
}

/// How a level varies over a surface.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum LevelField {
    /// Waves over the directions from the middle: wave vector, phase and amplitude of each.
    Waves {
        mean: f64,
        waves: Vec<(Vector3<f64>, f64, f64)>,
    },
    /// Bands along an axis: where each begins, from −1 to 1, and its level.
    Bands {
        axis: Vector3<f64>,
        bands: Vec<(f64, f64)>,
    },
}

/// A surface with a level at each point.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    form: Form,
    levels: LevelField,
    /// Largest area of a direction, per that of the unit ball \[m²\].
    area_max_m2: f64,
    /// Length of an outline up to each of its points \[m\].
    lengths_m: Vec<f64>,
}

/// What is felt at a point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Felt {
    /// Position from the middle \[m\].
    pub position_m: Point3<f64>,
    /// Outward normal.
    pub normal: Unit<Vector3<f64>>,
    /// Level.
    pub level: f64,
}

impl Solid {
    pub(super) fn new(form: Form, levels: LevelField) -> Self {
        let mut solid = Self {
            form,
            levels,
            area_max_m2: 0.0,
            lengths_m: Vec::new(),
        };
        if solid.is_planar() {
            let point =
                |k: u32| solid.point(&planar(TAU * f64::from(k) / f64::from(OUTLINE_POINTS)));
            let mut length_m = 0.0;
            let lengths = (0..OUTLINE_POINTS).map(|k| {
                length_m += (point(k + 1) - point(k)).norm();
                length_m
            });
            solid.lengths_m = lengths.collect();
        } else {
            // A spiral over the ball.
            let golden = TAU * 0.618_033_988_749_895;
            let areas = (0..AREA_SAMPLES).map(|k| {
                let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(AREA_SAMPLES);
                let (sin, cos) = (golden * f64::from(k)).sin_cos();
                let across = (1.0 - z * z).sqrt();
                solid.area_m2(&Vector3::new(across * cos, across * sin, z))
            });
            solid.area_max_m2 = AREA_MARGIN * areas.fold(0.0, f64::max);
        }
        solid
    }

    /// Whether it is a line in a plane.
    pub fn is_planar(&self) -> bool {
        matches!(self.form, Form::Outline { .. })
    }

    /// Length of an outline \[m\]; 0 of others.
    pub(super) fn length_m(&self) -> f64 {
        self.lengths_m.last().copied().unwrap_or_default()
    }

    /// The point of an outline so far along it \[m\].
    pub(super) fn along(&self, length_m: f64) -> Felt {
        let at_m = length_m.rem_euclid(self.length_m().max(f64::MIN_POSITIVE));
        let next = self.lengths_m.partition_point(|own| *own < at_m);
        let before = if next == 0 {
            0.0
        } else {
            self.lengths_m[next - 1]
        };
        let here = self.lengths_m.get(next).copied().unwrap_or(before);
        let part = (at_m - before) / (here - before).max(f64::MIN_POSITIVE);
        self.felt(&planar(
            TAU * (next as f64 + part) / f64::from(OUTLINE_POINTS),
        ))
    }

    /// A point that is drawn evenly from the whole surface.
    pub(super) fn draw(&self, random: &mut ChaCha8Rng) -> Felt {
        if self.is_planar() {
            return self.along(random.random_range(0.0..self.length_m()));
        }
        loop {
            let z: f64 = random.random_range(-1.0..1.0);
            let (sin, cos) = random.random_range(0.0..TAU).sin_cos();
            let across = (1.0 - z * z).sqrt();
            let direction = Vector3::new(across * cos, across * sin, z);
            if random.random_range(0.0..self.area_max_m2) < self.area_m2(&direction) {
                return self.felt(&direction);
            }
        }
    }

    /// What is felt in a direction from the middle.
    pub(super) fn felt(&self, direction: &Vector3<f64>) -> Felt {
        let position_m = self.point(direction);
        Felt {
            position_m,
            normal: self.normal(&position_m),
            level: self.level(&position_m),
        }
    }

    fn point(&self, direction: &Vector3<f64>) -> Point3<f64> {
        let unit = direction.normalize();
        Point3::from(unit * self.radius_m(&unit))
    }

    /// Distance of the surface from the middle in a direction \[m\].
    fn radius_m(&self, unit: &Vector3<f64>) -> f64 {
        match &self.form {
            Form::Outline {
                radius_m,
                lobes,
                lobe_m,
                phase,
            } => radius_m + lobe_m * (lobes * unit.y.atan2(unit.x) + phase).cos(),
            Form::Blob { radius_m, bumps } => {
                let bump = |(at, amplitude_m, sharpness): &(Vector3<f64>, f64, f64)| {
                    amplitude_m * (sharpness * (at.dot(unit) - 1.0)).exp()
                };
                radius_m + bumps.iter().map(bump).sum::<f64>()
            }
            Form::Box(half_m) => 1.0 / unit.component_div(half_m).amax(),
            Form::Cylinder { radius_m, half_m } => {
                1.0 / (unit.xy().norm() / radius_m).max(unit.z.abs() / half_m)
            }
            Form::Frustum {
                radius_m,
                growth,
                half_m,
            } => {
                let side = (unit.xy().norm() - growth * unit.z) / radius_m;
                1.0 / side.max(unit.z.abs() / half_m)
            }
            Form::Prism(faces) => {
                let face = |(normal, off_m): &(Vector3<f64>, f64)| normal.dot(unit) / off_m;
                1.0 / faces.iter().map(face).fold(f64::MIN_POSITIVE, f64::max)
            }
            Form::Bracket(boxes) => {
                let to = |[below, above]: &[Vector3<f64>; 2]| {
                    let face =
                        |axis: usize| f64::max(unit[axis] / above[axis], -unit[axis] / below[axis]);
                    1.0 / face(0).max(face(1)).max(face(2))
                };
                to(&boxes[0]).max(to(&boxes[1]))
            }
        }
    }

    /// The gradient of the distance over the surface.
    fn normal(&self, point: &Point3<f64>) -> Unit<Vector3<f64>> {
        let step = DIFFERENCE * point.coords.norm();
        let over = |point: Vector3<f64>| point.norm() / self.radius_m(&point.normalize());
        let mut slope = Vector3::from_fn(|axis, _| {
            let mut offset = Vector3::zeros();
            offset[axis] = step;
            over(point.coords + offset) - over(point.coords - offset)
        });
        if self.is_planar() {
            slope.z = 0.0;
        }
        Unit::new_normalize(slope)
    }

    fn area_m2(&self, direction: &Vector3<f64>) -> f64 {
        let point = self.point(direction);
        point.coords.norm_squared() / direction.dot(&self.normal(&point)).max(0.1)
    }

    fn level(&self, point: &Point3<f64>) -> f64 {
        let unit = point.coords.normalize();
        match &self.levels {
            LevelField::Waves { mean, waves } => {
                let wave = |(vector, phase, amplitude): &(Vector3<f64>, f64, f64)| {
                    amplitude * (vector.dot(&unit) + phase).sin()
                };
                mean + waves.iter().map(wave).sum::<f64>()
            }
            LevelField::Bands { axis, bands } => {
                let at = axis.dot(&unit);
                let band = bands.iter().rfind(|(from, _)| *from <= at);
                band.or(bands.first()).map_or(0.0, |(_, level)| *level)
            }
        }
    }
}

/// The direction of an angle in the plane \[rad\].
fn planar(angle_rad: f64) -> Vector3<f64> {
    let (sin, cos) = angle_rad.sin_cos();
    Vector3::new(cos, sin, 0.0)
}
