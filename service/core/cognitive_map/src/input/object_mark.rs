//! Marks that begin and end an episode with an object.

use super::{InvalidSample, Label};
use object_recognition::{ModelSettings, ObjectModel, Orientation};
use state::{CorruptState, State, StateReader, StateWriter};

/// Largest deviation and spacing \[m, rad, or a channel's unit\].
const DEVIATION_MAX: f64 = 1e6;

/// Most places of an object.
const PLACES_MAX: usize = 2048;

/// How far apart the places of an object are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spacing(f64);

impl Spacing {
    /// Finest and coarsest spacing of places \[m\].
    pub const RANGE_M: std::ops::RangeInclusive<f64> = 1e-5..=1e3;

    /// Contacts within this distance \[m\], 10 µm to 1 km, are of one place.
    ///
    /// # Errors
    /// The distance is out of range.
    pub fn new(spacing_m: f64) -> Result<Self, InvalidSample> {
        if Self::RANGE_M.contains(&spacing_m) {
            Ok(Self(spacing_m))
        } else {
            Err(InvalidSample::NumberOutOfRange)
        }
    }

    /// A model of places so far apart, of which nothing is known yet.
    pub(crate) fn model(self) -> ObjectModel {
        ObjectModel::new(ModelSettings {
            spacing_m: self.0,
            places_max: PLACES_MAX,
        })
    }
}

impl Default for Spacing {
    /// 4 mm, for things that a hand can hold.
    fn default() -> Self {
        Self(0.004)
    }
}

/// How exactly an episode's contacts are sensed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchNoise {
    position_sd_m: f64,
    normal_sd_rad: f64,
    level_sd: f64,
}

impl TouchNoise {
    /// Standard deviations of a contact's position per axis \[m\], of a normal's direction per axis
    /// \[rad\], and of a level in its channel's unit.
    ///
    /// # Errors
    /// A number is not finite, negative or too large.
    pub fn new(
        position_sd_m: f64,
        normal_sd_rad: f64,
        level_sd: f64,
    ) -> Result<Self, InvalidSample> {
        for sd in [position_sd_m, normal_sd_rad, level_sd] {
            if sd.is_nan() || sd > DEVIATION_MAX {
                return Err(InvalidSample::NumberOutOfRange);
            }
            if sd < 0.0 {
                return Err(InvalidSample::NegativeNoise);
            }
        }
        Ok(Self {
            position_sd_m,
            normal_sd_rad,
            level_sd,
        })
    }

    /// Of a position per axis \[m\].
    pub fn position_sd_m(&self) -> f64 {
        self.position_sd_m
    }

    /// Of a normal's direction per axis \[rad\].
    pub fn normal_sd_rad(&self) -> f64 {
        self.normal_sd_rad
    }

    /// Of a level, in its channel's unit.
    pub fn level_sd(&self) -> f64 {
        self.level_sd
    }
}

/// Begins or ends an episode with an object.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectMark {
    /// What is sensed from here on teaches an object.
    Learn {
        /// Its name. One that is known is extended if the episode shows how its frame lies in the
        /// object's; without a name it is the object that is recognised, or a new one.
        name: Option<Label>,
        /// How far apart the places of a new object are.
        spacing: Spacing,
        /// How the frame may be turned against that of an object known before.
        orientation: Orientation,
        /// How exactly is sensed.
        noise: TouchNoise,
    },
    /// What is sensed from here on is to be recognised.
    Identify {
        /// How the frame may be turned against an object's.
        orientation: Orientation,
        /// How exactly is sensed.
        noise: TouchNoise,
        /// Whether it is learned at the end if it turns out to be unknown, and the space learns
        /// such objects.
        learns: bool,
    },
    /// The episode ends.
    End,
}

impl State for TouchNoise {
    fn write(&self, out: &mut StateWriter) {
        [self.position_sd_m(), self.normal_sd_rad(), self.level_sd()].write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let [position_sd_m, normal_sd_rad, level_sd] = State::read(input)?;
        Self::new(position_sd_m, normal_sd_rad, level_sd).map_err(|_| CorruptState::Invalid)
    }
}
