//! Point pair features: pairs of oriented points by what a rigid motion does not change.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::index::buckets::Buckets;
use crate::numeric::floor_u32;
use crate::surfels::surfel::Surfel;
use crate::tuning::{PAIR_ACROSS_MIN, PAIR_ANGLES, PAIR_DISTANCES, PAIR_SURFELS_MAX};

/// Two oriented points in one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointPair {
    pub(crate) points: [Point3<f64>; 2],
    pub(crate) normals: [Vector3<f64>; 2],
}

impl PointPair {
    /// Distance and the three angles (Drost et al. 2010, "Model globally, match locally", Eq. 1):
    /// between each normal and the line, and between the normals.
    fn feature(&self) -> (f64, [f64; 3]) {
        let apart = self.points[1] - self.points[0];
        let distance_m = apart.norm();
        let along = apart / distance_m.max(1e-12);
        let [a, b] = &self.normals;
        let angle = |cos: f64| cos.clamp(-1.0, 1.0).acos();
        (
            distance_m,
            [angle(a.dot(&along)), angle(b.dot(&along)), angle(a.dot(b))],
        )
    }

    /// Axes fixed to the pair: along the line, and across it by the sum of the normals (with `sign`
    /// −1 their difference). `None` if that is too short to fix a rotation.
    fn axes(&self, sign: f64) -> Option<Matrix3<f64>> {
        let along = (self.points[1] - self.points[0]).try_normalize(1e-9)?;
        let across = self.across(&along, sign);
        let across = (across.norm() >= PAIR_ACROSS_MIN).then(|| across.normalize())?;
        Some(Matrix3::from_columns(&[
            along,
            across,
            along.cross(&across),
        ]))
    }

    fn across(&self, along: &Vector3<f64>, sign: f64) -> Vector3<f64> {
        let sum = self.normals[0] + self.normals[1] * sign;
        sum - along * sum.dot(along)
    }

    /// The sign for which the axes are fixed best.
    fn sign(&self) -> f64 {
        let apart = self.points[1] - self.points[0];
        let along = apart / apart.norm().max(1e-12);
        let (sum, difference) = (self.across(&along, 1.0), self.across(&along, -1.0));
        if sum.norm_squared() >= difference.norm_squared() {
            1.0
        } else {
            -1.0
        }
    }

    /// The rigid motion from `other` to this pair, if their normals fix it.
    pub(crate) fn onto(&self, other: &Self) -> Option<Isometry3<f64>> {
        let sign = other.sign();
        let turn = self.axes(sign)? * other.axes(sign)?.transpose();
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        let middle = |pair: &Self| (pair.points[0].coords + pair.points[1].coords) * 0.5;
        let translation = middle(self) - rotation * middle(other);
        Some(Isometry3::from_parts(
            Translation3::from(translation),
            rotation,
        ))
    }
}

/// Hash table of a model's pairs of surfels by feature.
#[derive(Clone, Debug)]
pub(crate) struct PointPairTable {
    width_m: f64,
    pairs: Buckets<[u16; 2]>,
}

impl PointPairTable {
    /// Of an even sample of the surfels of a model of this extent \[m\].
    pub(crate) fn new(surfels: &[Surfel], extent_m: f64) -> Self {
        let width_m = (extent_m / PAIR_DISTANCES as f64).max(1e-9);
        let sample = sample(surfels);
        let bins = PAIR_DISTANCES * PAIR_ANGLES * PAIR_ANGLES * PAIR_ANGLES;
        let mut keyed = Vec::with_capacity(sample.len() * sample.len());
        for &a in &sample {
            for &b in &sample {
                let pair = Self::pair(surfels, [a, b]);
                if a != b
                    && let Some(bin) = bin(&pair, width_m)
                {
                    keyed.push((bin, [a, b]));
                }
            }
        }
        Self {
            width_m,
            pairs: Buckets::new(bins, keyed.into_iter()),
        }
    }

    /// The pairs like this one.
    pub(crate) fn like(&self, pair: &PointPair) -> &[[u16; 2]] {
        bin(pair, self.width_m).map_or(&[], |bin| self.pairs.get(bin))
    }

    /// Two surfels as a pair.
    pub(crate) fn pair(surfels: &[Surfel], numbers: [u16; 2]) -> PointPair {
        let [a, b] = numbers.map(|number| &surfels[usize::from(number)]);
        PointPair {
            points: [a.position, b.position],
            normals: [a.normal, b.normal],
        }
    }
}

fn bin(pair: &PointPair, width_m: f64) -> Option<usize> {
    let (distance_m, angles) = pair.feature();
    let distance = floor_u32(distance_m / width_m) as usize;
    if distance >= PAIR_DISTANCES {
        return None;
    }
    let mut bin = distance;
    for angle in angles {
        let angle = floor_u32(angle / PI * PAIR_ANGLES as f64) as usize;
        bin = bin * PAIR_ANGLES + angle.min(PAIR_ANGLES - 1);
    }
    Some(bin)
}

/// Farthest-point sampling: each surfel is the farthest from those before it.
fn sample(surfels: &[Surfel]) -> Vec<u16> {
    let most = surfels.len().min(PAIR_SURFELS_MAX);
    let mut nearest = vec![f64::INFINITY; surfels.len()];
    let mut sample = Vec::with_capacity(most);
    let mut next = 0;
    while sample.len() < most {
        sample.push(u16::try_from(next).expect("a model has few places"));
        let own = &surfels[next];
        let mut farthest = 0.0;
        for (at, (surfel, nearest)) in surfels.iter().zip(&mut nearest).enumerate() {
            // The other side of something thin is far away.
            let sides = 1.0 - own.normal.dot(&surfel.normal);
            let distance = (surfel.position - own.position).norm_squared() + 1e-4 * sides * sides;
            *nearest = nearest.min(distance);
            if *nearest > farthest {
                (farthest, next) = (*nearest, at);
            }
        }
        if farthest == 0.0 {
            break;
        }
    }
    sample
}
