//! Families of random solids.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::solid::{Form, LevelField, Solid};

/// Most waves of a smooth level.
const WAVES: usize = 3;
/// Largest wave number of a smooth level, over directions.
const WAVE_MAX: f64 = 5.0;
/// Half the range of levels of one object.
const LEVEL_HALF_RANGE: f64 = 0.5;
/// Middles of the levels of objects whose levels are spread.
const LEVEL_MIDDLES: std::ops::Range<f64> = -1.0..1.0;

/// A family of objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// Planar outlines, 5 to 8 cm in radius, with up to five lobes of 1 to 2 cm.
    Outline,
    /// Blobs of 4 to 7 cm with bumps and dents of up to 2 cm.
    Blob,
    /// Boxes with half extents of 2 to 6 cm, and bands of level.
    Box,
    /// Cylinders of 2 to 5 cm in radius and 6 to 16 cm high, with bands of level.
    Cylinder,
    /// Cones without a tip, 2 to 5 cm in mean radius and 6 to 16 cm high, with bands of level.
    Frustum,
    /// Upright prisms of three to six sides, as large, with bands of level.
    Prism,
    /// Two boxes at an angle, each 2 to 4 cm thick and 6 to 12 cm long, with smooth levels.
    Bracket,
}

/// Ranges of the levels of a family's objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Levels {
    /// Each object has a range of its own.
    Spread,
    /// All have the same.
    Same,
}

impl Family {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Outline,
        Self::Blob,
        Self::Box,
        Self::Cylinder,
        Self::Frustum,
        Self::Prism,
        Self::Bracket,
    ];

    /// A random object.
    pub fn draw(self, levels: Levels, random: &mut ChaCha8Rng) -> Solid {
        let middle = match levels {
            Levels::Spread => random.random_range(LEVEL_MIDDLES),
            Levels::Same => 0.0,
        };
        let form = self.form(random);
        let field = match self {
            Self::Outline | Self::Blob | Self::Bracket => {
                waves(middle, self == Self::Outline, random)
            }
            Self::Box | Self::Cylinder | Self::Frustum | Self::Prism => bands(middle, random),
        };
        Solid::new(form, field)
    }

    fn form(self, random: &mut ChaCha8Rng) -> Form {
        match self {
            Self::Outline => Form::Outline {
                radius_m: random.random_range(0.05..0.08),
                lobes: f64::from(random.random_range(0_u8..=5)),
                lobe_m: random.random_range(0.01..0.02),
                phase: random.random_range(0.0..TAU),
            },
            Self::Blob => Form::Blob {
                radius_m: random.random_range(0.04..0.07),
                bumps: (0..random.random_range(2..=5))
                    .map(|_| {
                        let amplitude_m = random.random_range(-0.015..0.02);
                        (
                            direction(random),
                            amplitude_m,
                            random.random_range(1.5..4.0),
                        )
                    })
                    .collect(),
            },
            Self::Box => Form::Box(Vector3::from_fn(|_, _| random.random_range(0.02..0.06))),
            Self::Cylinder => Form::Cylinder {
                radius_m: random.random_range(0.02..0.05),
                half_m: random.random_range(0.03..0.08),
            },
            Self::Frustum => {
                let (radius_m, half_m) = (
                    random.random_range(0.02..0.05),
                    random.random_range(0.03..0.08),
                );
                // The radius at one end is from three tenths to nine tenths of that at half.
                let growth = random.random_range(0.1..0.7) * radius_m / half_m;
                Form::Frustum {
                    radius_m,
                    growth,
                    half_m,
                }
            }
            Self::Prism => prism(random),
            Self::Bracket => bracket(random),
        }
    }
}

/// An upright prism about its middle.
fn prism(random: &mut ChaCha8Rng) -> Form {
    let sides: u8 = random.random_range(3..=6);
    let (radius_m, half_m) = (
        random.random_range(0.02..0.05),
        random.random_range(0.03..0.08),
    );
    let from = random.random_range(0.0..TAU);
    let side = |k: u8| {
        let (sin, cos) = (from + TAU * f64::from(k) / f64::from(sides)).sin_cos();
        (Vector3::new(cos, sin, 0.0), radius_m)
    };
    let ends = [Vector3::z(), -Vector3::z()].map(|end| (end, half_m));
    Form::Prism((0..sides).map(side).chain(ends).collect())
}

/// Two boxes along x and z that share a corner, about the middle of what they share.
fn bracket(random: &mut ChaCha8Rng) -> Form {
    let thick_m = random.random_range(0.01..0.02);
    let [long_m, high_m] = [0, 1].map(|_| random.random_range(0.05..0.1));
    let wide_m = random.random_range(0.015..0.04);
    let below = Vector3::new(thick_m, wide_m, thick_m);
    Form::Bracket([
        [below, Vector3::new(long_m, wide_m, thick_m)],
        [below, Vector3::new(thick_m, wide_m, high_m)],
    ])
}

/// A smooth level.
fn waves(mean: f64, is_planar: bool, random: &mut ChaCha8Rng) -> LevelField {
    let count = random.random_range(1..=WAVES);
    let amplitude = LEVEL_HALF_RANGE / (count as f64).sqrt();
    let wave = |_| {
        let mut vector = direction(random) * random.random_range(1.0..WAVE_MAX);
        if is_planar {
            vector.z = 0.0;
        }
        (vector, random.random_range(0.0..TAU), amplitude)
    };
    LevelField::Waves {
        mean,
        waves: (0..count).map(wave).collect(),
    }
}

/// Bands along a random axis.
fn bands(mean: f64, random: &mut ChaCha8Rng) -> LevelField {
    let count = random.random_range(3..=5);
    let width = 2.0 / f64::from(count);
    let mut from = -1.0;
    let band = |_| {
        let level = mean + random.random_range(-LEVEL_HALF_RANGE..LEVEL_HALF_RANGE);
        let begin = from;
        from += width * random.random_range(0.7..1.3);
        (begin, level)
    };
    LevelField::Bands {
        bands: (0..count).map(band).collect(),
        axis: direction(random),
    }
}

fn direction(random: &mut ChaCha8Rng) -> Vector3<f64> {
    let z: f64 = random.random_range(-1.0..1.0);
    let (sin, cos) = random.random_range(-PI..PI).sin_cos();
    let across = (1.0 - z * z).sqrt();
    Vector3::new(across * cos, across * sin, z)
}
