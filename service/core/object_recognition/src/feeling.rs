//! What a contact's percepts say of places, with all that does not depend on the place worked out once.

use nalgebra::UnitQuaternion;
use pulp::Arch;

use super::contact::Contact;
use super::spots::{Spot, Spots, narrow};
use super::surface::{Surface, WRONG_SHARE, Wide};

/// Variance of a normal between places, per axis \[rad²\]: a surface turns there, and a fifth of a radian is a good part of
/// what voxels and hands differ by.
const NORMAL_TURN: f64 = 0.04;
/// Share of normals that are no place's.
const NORMAL_WRONG: f64 = 0.1;

/// Places that are asked at once.
pub(super) const LANES: usize = 8;

/// Of fewer places than one in so many, percepts are worked out one by one rather than of all places of the map side by side; the
/// second, where all of a place's percepts have to be asked.
const SPARSE: [usize; 2] = [16, 4];

/// Percepts of one contact.
#[derive(Clone, Debug)]
pub(super) struct Feeling<'a> {
    pub(super) contact: &'a Contact,
    wide: &'a [Wide],
    levels: Vec<Level>,
}

/// A level that was felt on a channel that was learned.
#[derive(Clone, Copy, Debug)]
struct Level {
    channel: u16,
    value: f64,
    /// Variance of its noise.
    noise: f64,
    /// What the density at a place is multiplied by.
    scale: f64,
}

/// The same for the places of one map in one rotation. Numbers are good to six digits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local<'a> {
    feeling: &'a Feeling<'a>,
    surface: &'a Surface,
    percepts: Percepts,
    facing: Option<Facing>,
}

#[derive(Clone, Copy, Debug)]
enum Percepts {
    /// Nothing that the map knows.
    Nothing,
    /// One level, from the middle of those of the map.
    Level { value: f32, noise: f32, scale: f32 },
    /// More than that: the places are asked themselves.
    Several,
}

/// A normal that was felt, in the map's axes.
#[derive(Clone, Copy, Debug)]
struct Facing {
    normal: [f32; 3],
    per_variance: f32,
}

impl<'a> Feeling<'a> {
    /// Of a contact, where levels are like these anywhere.
    pub(super) fn new(contact: &'a Contact, wide: &'a [Wide]) -> Self {
        let level = |felt: &super::contact::Felt| {
            let wide = wide.iter().find(|wide| wide.channel == felt.channel)?;
            Some(Level {
                channel: felt.channel,
                value: felt.value,
                noise: felt.sd * felt.sd + wide.variance * 1e-6,
                scale: (1.0 - WRONG_SHARE) / wide.density(felt),
            })
        };
        Self {
            contact,
            wide,
            levels: contact.levels.iter().filter_map(level).collect(),
        }
    }

    /// At the places of a map that is turned so.
    pub(super) fn at(&'a self, surface: &'a Surface, rotation: &UnitQuaternion<f64>) -> Local<'a> {
        let Self {
            contact, levels, ..
        } = self;
        let percepts = match surface.spots.levels() {
            _ if levels.is_empty() && contact.descriptors.is_empty() => Percepts::Nothing,
            None => Percepts::Several,
            Some((channel, middle)) => { levels.iter() }
                .find(|level| level.channel == channel)
                .map_or(Percepts::Nothing, |level| Percepts::Level {
                    value: narrow(level.value - middle),
                    noise: narrow(level.noise),
                    scale: narrow(level.scale),
                }),
        };
        let variance = contact.normal_sd_rad * contact.normal_sd_rad + NORMAL_TURN;
        let facing = contact.normal.map(|normal| Facing {
            normal: (rotation * normal.into_inner()).map(narrow).into(),
            per_variance: narrow(1.0 / variance),
        });
        Local {
            feeling: self,
            surface,
            percepts,
            facing,
        }
    }
}

impl Local<'_> {
    /// Likelihood of what was felt at a place, against that of it anywhere: the exponential of
    /// [`Patch::percept_log`](super::surface::Patch::percept_log), and the density of the normal per steradian against that of one anywhere.
    pub(super) fn likelihood(&self, number: usize, spot: &Spot) -> f32 {
        let felt = match &self.percepts {
            Percepts::Nothing => 1.0,
            Percepts::Level {
                value,
                noise,
                scale,
            } => level_likelihood(value - spot.level, spot.level_variance + noise, *scale),
            Percepts::Several => self.asked(number),
        };
        match &self.facing {
            None => felt,
            Some(facing) => felt * facing.likelihood(&self.surface.spots.normals[number]),
        }
    }

    /// The same of the first so many of eight places.
    #[expect(
        clippy::inline_always,
        reason = "only what is inlined into a dispatched closure is compiled for the vectors that it chose"
    )]
    #[inline(always)]
    pub(super) fn likelihoods_of(&self, numbers: &[u32; LANES], count: usize) -> [f32; LANES] {
        let spots = &self.surface.spots.all;
        let mut felt = [1.0; LANES];
        match (&self.percepts, &self.facing) {
            (Percepts::Nothing, None) => {}
            (
                Percepts::Level {
                    value,
                    noise,
                    scale,
                },
                None,
            ) => {
                let own = numbers.map(|number| &spots[number as usize]);
                let (levels, variances) = (
                    own.map(|spot| spot.level),
                    own.map(|spot| spot.level_variance),
                );
                felt = std::array::from_fn(|k| {
                    level_likelihood(value - levels[k], variances[k] + noise, *scale)
                });
            }
            _ => {
                for (felt, number) in felt.iter_mut().zip(&numbers[..count]) {
                    let number = *number as usize;
                    *felt = self.likelihood(number, &spots[number]);
                }
            }
        }
        felt
    }

    /// The same of all places of the map.
    pub(super) fn likelihoods(&self, out: &mut Vec<f32>) {
        let Spots {
            normals,
            level_lists: [levels, variances],
            ..
        } = &self.surface.spots;
        out.clear();
        out.resize(normals.len(), 1.0);
        match self.percepts {
            Percepts::Nothing => {}
            Percepts::Level {
                value,
                noise,
                scale,
            } => {
                Arch::new().dispatch(
                    #[inline(always)]
                    || {
                        for ((felt, level), variance) in out.iter_mut().zip(levels).zip(variances) {
                            *felt = level_likelihood(value - level, variance + noise, scale);
                        }
                    },
                );
            }
            Percepts::Several => {
                for (number, felt) in out.iter_mut().enumerate() {
                    *felt = self.asked(number);
                }
            }
        }
        if let Some(facing) = &self.facing {
            Arch::new().dispatch(
                #[inline(always)]
                || {
                    for (felt, normal) in out.iter_mut().zip(normals) {
                        *felt *= facing.likelihood(normal);
                    }
                },
            );
        }
    }

    /// Fewer places than one in so many are better asked one by one.
    pub(super) fn sparse(&self) -> usize {
        SPARSE[usize::from(matches!(self.percepts, Percepts::Several))]
    }

    /// Whether they are the same in all rotations.
    pub(super) fn is_unturned(&self) -> bool {
        self.facing.is_none()
    }

    fn asked(&self, number: usize) -> f32 {
        let patch = &self.surface.patches[self.surface.spots.patch(number)];
        narrow(
            patch
                .percept_log(self.feeling.contact, self.feeling.wide)
                .exp(),
        )
    }
}

#[expect(
    clippy::inline_always,
    reason = "only what is inlined into a dispatched closure is compiled for the vectors that it chose"
)]
#[inline(always)]
fn level_likelihood(apart: f32, variance: f32, scale: f32) -> f32 {
    let per = 1.0 / variance;
    scale * exp(-0.5 * apart * apart * per) * per.sqrt() + narrow(WRONG_SHARE)
}

impl Facing {
    /// A place of which no normal is known has one of no length.
    #[expect(
        clippy::inline_always,
        reason = "only what is inlined into a dispatched closure is compiled for the vectors that it chose"
    )]
    #[inline(always)]
    fn likelihood(&self, own: &[f32; 3]) -> f32 {
        let dot = self.normal[0] * own[0] + self.normal[1] * own[1] + self.normal[2] * own[2];
        let right = 2.0 * narrow(1.0 - NORMAL_WRONG) * self.per_variance;
        let likelihood = right * exp((dot - 1.0) * self.per_variance) + narrow(NORMAL_WRONG);
        let is_known = own[0] != 0.0 || own[1] != 0.0 || own[2] != 0.0;
        if is_known { likelihood } else { 1.0 }
    }
}

/// eˣ to six digits, in steps that a compiler lays side by side: 2ⁿ by its exponent's bits, and a polynomial for the rest (the
/// series of 2ᶠ, f from −½ to ½).
#[inline(always)]
pub(super) fn exp(x: f32) -> f32 {
    /// Adding it leaves the nearest whole number in the low bits.
    const WHOLE: f32 = 12_582_912.0;
    let x = if x > -87.0 { x } else { -87.0 };
    let x = if x < 87.0 { x } else { 87.0 };
    let turns = x * std::f32::consts::LOG2_E;
    let shifted = turns + WHOLE;
    let f = turns - (shifted - WHOLE);
    let series = 1.0
        + f * (std::f32::consts::LN_2
            + f * (0.240_226_5
                + f * (0.055_504_11
                    + f * (0.009_618_129 + f * (0.001_333_356 + f * 0.000_154_035)))));
    series * f32::from_bits((shifted.to_bits() << 23).wrapping_add(0x3F80_0000))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Unit, Vector3};

    use super::*;
    use crate::model::{LevelMemory, ModelPlace};
    use crate::{ModelSettings, ObjectModel};

    #[test]
    fn powers_are_right_to_six_digits() {
        for k in -8600_i16..=8600 {
            let x = f32::from(k) * 0.01;
            let apart = f64::from(exp(x)) / f64::from(x).exp() - 1.0;
            // The argument itself is rounded.
            assert!(
                apart.abs() < 4e-6 + 1e-7 * f64::from(x.abs()),
                "{x}: {apart}"
            );
        }
        assert!(exp(-1e30) < 1e-37 && exp(1e30).is_finite() && exp(f32::NAN) < 1e-37);
    }

    #[test]
    fn a_packed_place_feels_like_the_place_itself() {
        let level = |channel, mean| LevelMemory {
            channel,
            count: 3.0,
            mean,
            squares: 0.2,
            noise: 0.03,
        };
        // Where the level is far from nothing, what is left of its digits has to do.
        let lists = [
            vec![vec![], vec![]],
            vec![vec![level(0, 1000.3)], vec![level(0, 1000.9)]],
            vec![vec![level(1, 0.3)], vec![level(1, 0.3)]],
            vec![vec![level(0, 1000.9)], vec![]],
            vec![
                vec![level(0, 1000.9), level(1, 2.0)],
                vec![level(1, 1.0), level(0, 1000.0)],
            ],
        ];
        let surfaces: Vec<Surface> = { lists.into_iter() }
            .map(|lists| {
                let places = lists.into_iter().zip(0..).map(|(levels, at)| ModelPlace {
                    position_m: Point3::new(f64::from(at), 0.0, 0.0),
                    normals: Vector3::new(f64::from(at), 0.0, 0.5 * f64::from(at)),
                    count: 3.0,
                    variance_m2: 1e-6,
                    normal_variance: 0.0,
                    levels,
                    descriptors: Vec::new(),
                });
                let settings = ModelSettings::default();
                let model = ObjectModel::with_places(settings, 0.004, places.collect());
                Surface::new(&model)
            })
            .collect();
        let wide = crate::surface::wide(surfaces.iter());
        let bare = Contact::at(Point3::origin(), 0.001);
        let contacts = [
            bare.clone(),
            bare.clone().with_level(0, 1000.5, 0.1),
            bare.clone().with_level(0, 9000.0, 0.1),
            bare.clone().with_level(7, 0.5, 0.1),
            { bare.clone() }
                .with_level(0, 1000.5, 0.1)
                .with_level(1, 1.0, 0.2),
            bare.clone().with_level(1, 0.5, 0.0),
            bare.with_normal(Unit::new_normalize(Vector3::new(1.0, 0.2, 0.0)), 0.1),
        ];
        for contact in &contacts {
            let feeling = Feeling::new(contact, &wide);
            for surface in &surfaces {
                let turn = UnitQuaternion::new(Vector3::new(0.0, -0.2, 0.1));
                let local = feeling.at(surface, &turn);
                let mut all = Vec::new();
                local.likelihoods(&mut all);
                for (number, spot) in surface.spots.all.iter().enumerate() {
                    let patch = &surface.patches[surface.spots.patch(number)];
                    let packed = local.likelihood(number, spot);
                    assert!((all[number] / packed - 1.0).abs() < 1e-6);
                    let mut full = patch.percept_log(contact, &wide);
                    if let (Some(felt), Some(own)) = (contact.normal, patch.normal) {
                        let variance = 0.1 * 0.1 + NORMAL_TURN;
                        let apart = 2.0 * (1.0 - (turn * felt.into_inner()).dot(&own));
                        let right = 0.9 * 2.0 / variance * (-0.5 * apart / variance).exp();
                        full += (right + 0.1).ln();
                    }
                    let packed = f64::from(packed).ln();
                    assert!((packed - full).abs() < 1e-3, "{packed} {full} {contact:?}");
                }
            }
        }
    }
}
