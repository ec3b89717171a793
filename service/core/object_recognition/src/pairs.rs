//! Pairs of oriented points, by what does not change when they are moved.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::facet::Facet;

/// Most facets whose pairs are tabled: 57,600 pairs in a quarter of a megabyte.
const FACETS_MAX: usize = 240;
/// Angles are binned by 12°.
const ANGLES: usize = 15;
/// Distances are binned by a sixteenth of the map's extent.
const DISTANCES: usize = 16;
/// Below this part of its length nothing across the pair fixes the turn about it.
const ACROSS_MIN: f64 = 0.25;

/// Two oriented points in one frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) points: [Point3<f64>; 2],
    pub(super) normals: [Vector3<f64>; 2],
}

impl Pair {
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

    /// Axes that move with the pair: along the line, and across it by the sum (or, with `sign` −1, the
    /// difference) of the normals. `None` if that fixes no turn.
    fn axes(&self, sign: f64) -> Option<Matrix3<f64>> {
        let along = (self.points[1] - self.points[0]).try_normalize(1e-9)?;
        let across = self.across(&along, sign);
        let across = (across.norm() >= ACROSS_MIN).then(|| across.normalize())?;
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

    /// The sign for which the axes are best fixed.
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

    /// The rigid motion that lays `other` upon this pair, if their normals fix it.
    pub(super) fn onto(&self, other: &Self) -> Option<Isometry3<f64>> {
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

/// A map's pairs of facets by feature.
#[derive(Clone, Debug)]
pub(super) struct Pairs {
    width_m: f64,
    starts: Vec<u32>,
    facets: Vec<[u16; 2]>,
}

impl Pairs {
    /// Of an even sample of these facets of a map of this extent \[m\].
    pub(super) fn new(facets: &[Facet], extent_m: f64) -> Self {
        let width_m = (extent_m / DISTANCES as f64).max(1e-9);
        let sample = sample(facets);
        let bins = DISTANCES * ANGLES * ANGLES * ANGLES;
        let mut keyed = Vec::with_capacity(sample.len() * sample.len());
        for &a in &sample {
            for &b in &sample {
                let pair = Self::pair(facets, [a, b]);
                if a != b
                    && let Some(bin) = bin(&pair, width_m)
                {
                    keyed.push((bin, [a, b]));
                }
            }
        }
        let mut starts = vec![0u32; bins + 1];
        for (bin, _) in &keyed {
            starts[*bin as usize + 1] += 1;
        }
        for bin in 0..bins {
            starts[bin + 1] += starts[bin];
        }
        let mut filled = starts.clone();
        let mut facets = vec![[0; 2]; keyed.len()];
        for (bin, pair) in keyed {
            let at = &mut filled[bin as usize];
            facets[*at as usize] = pair;
            *at += 1;
        }
        Self {
            width_m,
            starts,
            facets,
        }
    }

    /// The pairs like this one.
    pub(super) fn like(&self, pair: &Pair) -> &[[u16; 2]] {
        match bin(pair, self.width_m) {
            Some(bin) => {
                let bin = bin as usize;
                &self.facets[self.starts[bin] as usize..self.starts[bin + 1] as usize]
            }
            None => &[],
        }
    }

    /// Two facets as a pair.
    pub(super) fn pair(facets: &[Facet], numbers: [u16; 2]) -> Pair {
        let [a, b] = numbers.map(|number| &facets[usize::from(number)]);
        Pair {
            points: [a.position, b.position],
            normals: [a.normal, b.normal],
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "bins are few and not negative"
)]
fn bin(pair: &Pair, width_m: f64) -> Option<u32> {
    let (distance_m, angles) = pair.feature();
    let distance = (distance_m / width_m) as usize;
    if distance >= DISTANCES {
        return None;
    }
    let mut bin = distance;
    for angle in angles {
        bin = bin * ANGLES + ((angle / PI * ANGLES as f64) as usize).min(ANGLES - 1);
    }
    Some(bin as u32)
}

/// Facets as far from one another as can be: each the farthest from those before it.
fn sample(facets: &[Facet]) -> Vec<u16> {
    let most = facets.len().min(FACETS_MAX);
    let mut nearest = vec![f64::INFINITY; facets.len()];
    let mut sample = Vec::with_capacity(most);
    let mut next = 0;
    while sample.len() < most {
        sample.push(u16::try_from(next).expect("a model has few places"));
        let own = &facets[next];
        let mut farthest = 0.0;
        for (at, (facet, nearest)) in facets.iter().zip(&mut nearest).enumerate() {
            // The other side of something thin is far away.
            let sides = 1.0 - own.normal.dot(&facet.normal);
            let distance = (facet.position - own.position).norm_squared() + 1e-4 * sides * sides;
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
