//! A learned map made ready for recognition.

use nalgebra::{Point3, Unit, Vector3};

use super::contact::{Contact, Felt, Seen};
use super::model::{LevelMemory, ObjectModel};
use super::relief::Relief;
use super::spots::Spots;

/// A place's field is uniform over one spacing; that is its standard deviation in spacings, 1/√12.
const FIELD_PER_SPACING: f64 = 0.288_675;
/// Distances at which the share of the map within them is tabled, per extent.
const SHARES: usize = 32;
/// Most places from which the shares are counted: their error is then a few hundredths.
const SHARE_PLACES: usize = 128;

/// One place, ready.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    pub(super) position: Point3<f64>,
    pub(super) normal: Option<Unit<Vector3<f64>>>,
    /// Variance of a touch of this place about `position`, per axis, without the touch's noise \[m²\].
    pub(super) variance_m2: f64,
    pub(super) levels: Vec<LevelMemory>,
    pub(super) descriptors: Vec<Seen>,
}

/// A map ready for recognition: its patches, their indexes, and what share of it lies how near.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    pub(super) patches: Vec<Patch>,
    /// The same places, packed.
    pub(super) spots: Spots,
    /// Diameter of a ball about the map's middle that holds all of it \[m\].
    pub(super) extent_m: f64,
    /// Area that it takes for \[m²\]: one spacing squared per place.
    pub(super) area_m2: f64,
    /// The same as a surface, if normals were felt.
    pub(super) relief: Option<Relief>,
    shares: [f64; SHARES + 1],
}

impl Surface {
    /// Of a model.
    pub(super) fn new(model: &ObjectModel) -> Self {
        let field_m = FIELD_PER_SPACING * model.spacing_m();
        let patches: Vec<_> = model
            .places()
            .iter()
            .map(|place| Patch {
                position: place.position_m,
                normal: place.normal(),
                variance_m2: field_m * field_m + place.variance_m2 / (place.count * place.count),
                levels: place.levels.clone(),
                descriptors: place.descriptors.clone(),
            })
            .collect();
        let noise_m2 = model.places().iter().map(|p| p.variance_m2 / p.count);
        let noise_m2 = noise_m2.sum::<f64>() / patches.len().max(1) as f64;
        let positions: Vec<_> = patches.iter().map(|patch| patch.position).collect();
        let middle = positions
            .iter()
            .fold(Vector3::zeros(), |sum, p| sum + p.coords)
            / positions.len().max(1) as f64;
        let radius_m = positions
            .iter()
            .map(|p| (p.coords - middle).norm())
            .fold(model.spacing_m(), f64::max);
        let extent_m = 2.0 * radius_m;
        Self {
            spots: Spots::new(&patches, model.spacing_m(), extent_m, noise_m2),
            shares: shares(&positions, extent_m),
            area_m2: positions.len() as f64 * model.spacing_m() * model.spacing_m(),
            relief: Relief::new(model),
            extent_m,
            patches,
        }
    }

    /// The share of the map within `reach_m` \[m\] of a place of it, on average.
    pub(super) fn share(&self, reach_m: f64) -> f64 {
        let at = (reach_m / self.extent_m).clamp(0.0, 1.0) * SHARES as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 to SHARES"
        )]
        let below = (at as usize).min(SHARES - 1);
        let part = at - below as f64;
        self.shares[below] * (1.0 - part) + self.shares[below + 1] * part
    }
}

fn shares(positions: &[Point3<f64>], extent_m: f64) -> [f64; SHARES + 1] {
    let mut counts = [0.0; SHARES + 1];
    let step = positions.len().div_ceil(SHARE_PLACES).max(1);
    let mut total = 0.0;
    for from in positions.iter().step_by(step) {
        for to in positions {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0 to SHARES"
            )]
            let bin = ((to - from).norm() / extent_m * SHARES as f64).ceil() as usize;
            counts[bin.min(SHARES)] += 1.0;
            total += 1.0;
        }
    }
    let mut sum = 0.0;
    counts.map(|count| {
        sum += count;
        if total > 0.0 { sum / total } else { 1.0 }
    })
}

impl Patch {
    /// Log-likelihood of a contact's levels and descriptors at this place, less that of them anywhere.
    pub(super) fn percept_log(&self, contact: &Contact, wide: &[Wide]) -> f64 {
        let mut sum = 0.0;
        for felt in &contact.levels {
            let own = self.levels.iter().find(|own| own.channel == felt.channel);
            let wide = wide.iter().find(|wide| wide.channel == felt.channel);
            if let (Some(own), Some(wide)) = (own, wide) {
                let variance = own.variance() + felt.sd * felt.sd + wide.variance * 1e-6;
                let apart = felt.value - own.mean;
                let here = (-0.5 * apart * apart / variance).exp() / variance.sqrt();
                sum += ((1.0 - WRONG_SHARE) * here / wide.density(felt) + WRONG_SHARE).ln();
            }
        }
        for seen in &contact.descriptors {
            let own = self
                .descriptors
                .iter()
                .find(|own| own.channel == seen.channel);
            if let Some(own) = own {
                let cos: f64 = seen
                    .vector
                    .iter()
                    .zip(own.vector.iter())
                    .map(|(a, b)| f64::from(a * b))
                    .sum();
                let here = (-(1.0 - cos) / DESCRIPTOR_FALL).exp() / DESCRIPTOR_FALL;
                sum += ((1.0 - WRONG_SHARE) * here + WRONG_SHARE).ln();
            }
        }
        sum
    }
}

/// Share of percepts that are of nothing that was learned: a misreading, or something changed.
pub(super) const WRONG_SHARE: f64 = 0.05;
/// Fall of a descriptor's likelihood with one less its cosine: noise of a tenth leaves 0.01 of it, and
/// half a view 0.3.
const DESCRIPTOR_FALL: f64 = 0.05;

/// What a channel's levels are anywhere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wide {
    pub(super) channel: u16,
    pub(super) mean: f64,
    pub(super) variance: f64,
}

impl Wide {
    /// Density of a level anywhere, times √(2π).
    pub(super) fn density(&self, felt: &Felt) -> f64 {
        let apart = felt.value - self.mean;
        let variance = self.variance + felt.sd * felt.sd;
        // A value far off all is wrong, and tells nothing.
        ((-0.5 * apart * apart / variance).exp() + 1e-3) / variance.sqrt()
    }
}

/// Over all places of these maps, each counted once.
pub(super) fn wide<'a>(surfaces: impl Iterator<Item = &'a Surface>) -> Vec<Wide> {
    let mut all: Vec<LevelMemory> = Vec::new();
    for patch in surfaces.flat_map(|surface| &surface.patches) {
        for level in &patch.levels {
            match all.iter_mut().find(|sum| sum.channel == level.channel) {
                Some(sum) => {
                    sum.count += 1.0;
                    let apart = level.mean - sum.mean;
                    sum.mean += apart / sum.count;
                    sum.squares += apart * (level.mean - sum.mean);
                }
                None => all.push(LevelMemory {
                    count: 1.0,
                    squares: 0.0,
                    ..*level
                }),
            }
        }
    }
    let wide = |sum: LevelMemory| Wide {
        channel: sum.channel,
        mean: sum.mean,
        variance: sum.squares / sum.count + 1e-12,
    };
    all.into_iter().map(wide).collect()
}
