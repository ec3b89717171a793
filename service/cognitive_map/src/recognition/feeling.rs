//! What a contact's percepts say of places, with all that does not depend on the place worked out once.

use nalgebra::{Unit, UnitQuaternion, Vector3};

use super::contact::Contact;
use super::spots::Spots;
use super::surface::{Patch, WRONG_SHARE, Wide};

/// Variance of a normal between places, per axis \[rad²\]: a surface turns there, and a fifth of a radian is a good part of
/// what voxels and hands differ by.
const NORMAL_TURN: f64 = 0.04;
/// Share of normals that are no place's.
const NORMAL_WRONG: f64 = 0.1;

/// Percepts of one contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Feeling<'a> {
    pub(super) contact: &'a Contact,
    wide: &'a [Wide],
}

/// A level that was felt on the channel of a map.
#[derive(Clone, Copy, Debug)]
struct Level {
    value: f64,
    /// Variance of its noise.
    noise: f64,
    /// What the density here is multiplied by.
    scale: f64,
}

/// A normal that was felt, in a map's axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facing {
    normal: [f32; 3],
    per_variance: f32,
}

impl<'a> Feeling<'a> {
    /// Of a contact, where levels are like these anywhere.
    pub(super) fn new(contact: &'a Contact, wide: &'a [Wide]) -> Self {
        Self { contact, wide }
    }

    /// Likelihood of what was felt at a place but for its normal, against that of it anywhere: the exponential of
    /// [`Patch::percept_log`].
    pub(super) fn likelihood(&self, patch: &Patch) -> f64 {
        if self.contact.levels.is_empty() && self.contact.descriptors.is_empty() {
            return 1.0;
        }
        patch.percept_log(self.contact, self.wide).exp()
    }

    /// The same for all places of a map, to six digits or so.
    pub(super) fn likelihoods(&self, spots: &Spots, patches: &[Patch], out: &mut Vec<f32>) {
        out.clear();
        #[expect(clippy::cast_possible_truncation, reason = "six digits are enough")]
        match spots.levels() {
            Some(levels) => match self.level(levels.channel) {
                None => out.resize(patches.len(), 1.0),
                Some(level) => {
                    let value = (level.value - levels.middle) as f32;
                    let (noise, scale) = (level.noise as f32, level.scale as f32);
                    let likelihood = |(mean, variance): (&f32, &f32)| {
                        let apart = value - mean;
                        let per = 1.0 / (variance + noise);
                        scale * exp(-0.5 * apart * apart * per) * per.sqrt() + WRONG_SHARE as f32
                    };
                    out.extend(levels.means.iter().zip(&levels.variances).map(likelihood));
                }
            },
            None => out.extend({ patches.iter() }.map(|patch| self.likelihood(patch) as f32)),
        }
    }

    fn level(&self, channel: u16) -> Option<Level> {
        let felt = { self.contact.levels.iter() }.find(|felt| felt.channel == channel)?;
        let wide = { self.wide.iter() }.find(|wide| wide.channel == channel)?;
        Some(Level {
            value: felt.value,
            noise: felt.sd * felt.sd + wide.variance * 1e-6,
            scale: (1.0 - WRONG_SHARE) / wide.density(felt),
        })
    }

    /// The normal in the axes of a map that is turned so, if one was felt.
    pub(super) fn facing(&self, rotation: &UnitQuaternion<f64>) -> Option<Facing> {
        let normal = rotation * self.contact.normal?.into_inner();
        #[expect(clippy::cast_possible_truncation, reason = "six digits are enough")]
        Some(Facing {
            normal: normal.map(|x| x as f32).into(),
            per_variance: (1.0 / normal_variance(self.contact)) as f32,
        })
    }
}

impl Facing {
    /// [`normal_likelihood`] to six digits or so; a place of which none is known has none of any length.
    pub(super) fn likelihood(&self, own: &[f32; 3]) -> f32 {
        let dot = self.normal[0] * own[0] + self.normal[1] * own[1] + self.normal[2] * own[2];
        if own.iter().all(|x| *x == 0.0) {
            return 1.0;
        }
        #[expect(clippy::cast_possible_truncation, reason = "six digits are enough")]
        let (right, wrong) = (2.0 * (1.0 - NORMAL_WRONG) as f32, NORMAL_WRONG as f32);
        right * self.per_variance * exp(-(1.0 - dot) * self.per_variance) + wrong
    }
}

fn normal_variance(contact: &Contact) -> f64 {
    contact.normal_sd_rad * contact.normal_sd_rad + NORMAL_TURN
}

/// Density of a contact's normal at a place, per steradian, against that of one anywhere.
pub(super) fn normal_likelihood(
    rotation: &UnitQuaternion<f64>,
    contact: &Contact,
    normal: Option<&Unit<Vector3<f64>>>,
) -> f64 {
    let (Some(felt), Some(own)) = (&contact.normal, normal) else {
        return 1.0;
    };
    let variance = normal_variance(contact);
    let apart = 2.0 * (1.0 - (rotation * felt.into_inner()).dot(own));
    (1.0 - NORMAL_WRONG) * 2.0 / variance * (-0.5 * apart / variance).exp() + NORMAL_WRONG
}

/// eˣ to six digits, in steps that a compiler lays side by side: 2ⁿ by its exponent's bits, and a polynomial for the rest (the
/// series of 2ᶠ, f from −½ to ½).
pub(super) fn exp(x: f32) -> f32 {
    /// Adding it leaves the nearest whole number in the low bits.
    const WHOLE: f32 = 12_582_912.0;
    let x = if x > -87.0 { x } else { -87.0 };
    let x = if x < 87.0 { x } else { 87.0 };
    let turns = x * std::f32::consts::LOG2_E;
    let shifted = turns + WHOLE;
    let f = turns - (shifted - WHOLE);
    let series = 1.0
        + f * (0.693_147_2
            + f * (0.240_226_5
                + f * (0.055_504_11
                    + f * (0.009_618_129 + f * (0.001_333_356 + f * 0.000_154_035)))));
    series * f32::from_bits((shifted.to_bits() << 23).wrapping_add(0x3F80_0000))
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
