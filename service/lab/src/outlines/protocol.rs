//! What is done with how many objects.

use serde::Serialize;

use super::family::{Family, Levels};

/// Most touches of an exploration.
const TOUCHES_MAX: usize = 10_000;

/// How an object may have turned since it was learned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Turn {
    /// Not at all.
    None,
    /// Anyhow; contacts tell the surface's normal.
    Any,
    /// By any angle about the vertical.
    Yaw,
}

/// Where an object is touched to teach it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Teaching {
    /// All over: an outline evenly along one lap, another surface at random.
    Everywhere,
    /// In one run of touches that are a step apart, however far it leads.
    Run,
}

/// Objects that are taught, and touched again.
#[derive(Clone, Debug, PartialEq)]
pub struct OutlineProtocol {
    /// Family of the objects.
    pub family: Family,
    /// Ranges of their levels.
    pub levels: Levels,
    /// How they may have turned.
    pub turn: Turn,
    /// Whether contacts tell the surface's normal, as they do where any turn is possible.
    pub normals: bool,
    /// Contacts by which each is taught.
    pub taught: usize,
    /// Where they are.
    pub teaching: Teaching,
    /// Objects that are taught together.
    pub objects: usize,
    /// So often, with other objects each time.
    pub sets: usize,
    /// Distance between neighbouring touches \[m\].
    pub step_m: f64,
    /// Standard deviation of a contact's position per axis \[m\].
    pub position_sd_m: f64,
    /// Standard deviation of a normal per axis \[rad\].
    pub normal_sd_rad: f64,
    /// Standard deviation of a level.
    pub level_sd: f64,
    /// Numbers of touches after which is looked, ascending; the last ends an exploration.
    pub looks: Vec<usize>,
    /// Seed of everything.
    pub seed: u64,
}

/// An option that makes no sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidOutlineProtocol {
    /// A number that must be positive.
    #[error("sets, objects and contacts must be at least 1, and a step above 0")]
    Zero,
    /// The numbers of touches.
    #[error("numbers of touches must ascend from 1 to {TOUCHES_MAX} at most")]
    Looks,
    /// Noise.
    #[error("noise must be a finite number and not negative")]
    Noise,
}

impl OutlineProtocol {
    /// A family, taught by so many contacts: 1 mm, 2° and 0.03 of noise, five objects, and walks of
    /// up to 200 touches, 5 mm apart on outlines and 1 cm on others.
    pub fn new(family: Family, levels: Levels, turn: Turn, taught: usize) -> Self {
        Self {
            family,
            levels,
            turn,
            normals: turn == Turn::Any,
            taught,
            teaching: Teaching::Everywhere,
            objects: 5,
            sets: 8,
            step_m: if family == Family::Outline {
                0.005
            } else {
                0.01
            },
            position_sd_m: 0.001,
            normal_sd_rad: 2.0_f64.to_radians(),
            level_sd: 0.03,
            looks: vec![16, 40, 100, 200],
            seed: 1,
        }
    }

    /// # Errors
    /// Names the first option that makes no sense.
    pub fn check(&self) -> Result<(), InvalidOutlineProtocol> {
        if self.sets == 0 || self.objects == 0 || self.taught == 0 || self.step_m <= 0.0 {
            return Err(InvalidOutlineProtocol::Zero);
        }
        let ascends = self.looks.windows(2).all(|two| two[0] < two[1]);
        let (first, last) = (self.looks.first(), self.looks.last());
        if !ascends || first.is_none_or(|n| *n == 0) || last.is_none_or(|n| *n > TOUCHES_MAX) {
            return Err(InvalidOutlineProtocol::Looks);
        }
        let noises = [self.position_sd_m, self.normal_sd_rad, self.level_sd];
        if !noises.iter().all(|noise| (0.0..=1e6).contains(noise)) {
            return Err(InvalidOutlineProtocol::Noise);
        }
        Ok(())
    }
}
