//! Sightings: targets seen relative to the body.

use nalgebra::{Isometry3, Vector3};

use super::invalid::{METRES_MAX, bounded, deviations};
use super::{InvalidSample, Label, NoisyPose, PoseNoise, Range};
use state::{CorruptState, State, StateReader, StateWriter};

/// A target seen from the body.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// What was seen.
    pub target: Target,
    /// Where.
    pub relation: Relation,
}

/// What a sighting is of.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// A landmark.
    Landmark(Label),
    /// Another agent, by name.
    Agent(Label),
    /// Where this agent itself was at the sample of this sequence number.
    OwnSample(u64),
}

/// Where a target was seen, in the body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Relation {
    /// A position.
    Position(RelativePosition),
    /// A distance and a direction.
    RangeBearing(RangeBearing),
    /// A full pose.
    Pose(RelativePose),
    /// A distance alone.
    Range(Range),
}

/// A position relative to the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativePosition {
    translation_m: Vector3<f64>,
    sd_m: Vector3<f64>,
}

impl RelativePosition {
    /// # Errors
    /// A number is out of range or a deviation negative.
    pub fn new(translation_m: [f64; 3], sd_m: [f64; 3]) -> Result<Self, InvalidSample> {
        Ok(Self {
            translation_m: bounded(translation_m, METRES_MAX)?,
            sd_m: deviations(sd_m)?,
        })
    }

    /// Position \[m\].
    pub fn translation_m(&self) -> &Vector3<f64> {
        &self.translation_m
    }

    /// Standard deviation along the body axes \[m\].
    pub fn sd_m(&self) -> &Vector3<f64> {
        &self.sd_m
    }
}

/// A distance and a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeBearing {
    range_m: f64,
    azimuth_rad: f64,
    elevation_rad: f64,
    range_sd_m: f64,
    bearing_sd_rad: f64,
}

impl RangeBearing {
    /// Angles may be any finite number; the azimuth is left positive, the elevation up positive.
    ///
    /// # Errors
    /// A number is out of range, the range or a deviation negative.
    pub fn new(
        range_m: f64,
        azimuth_rad: f64,
        elevation_rad: f64,
        range_sd_m: f64,
        bearing_sd_rad: f64,
    ) -> Result<Self, InvalidSample> {
        bounded([range_m, azimuth_rad, elevation_rad], METRES_MAX)?;
        deviations([range_sd_m, bearing_sd_rad, 0.0])?;
        if range_m < 0.0 {
            return Err(InvalidSample::NumberOutOfRange);
        }
        Ok(Self {
            range_m,
            azimuth_rad,
            elevation_rad,
            range_sd_m,
            bearing_sd_rad,
        })
    }

    /// Distance \[m\].
    pub fn range_m(&self) -> f64 {
        self.range_m
    }

    /// Direction in the body's x-y plane, left positive \[rad\].
    pub fn azimuth_rad(&self) -> f64 {
        self.azimuth_rad
    }

    /// Direction above that plane \[rad\].
    pub fn elevation_rad(&self) -> f64 {
        self.elevation_rad
    }

    /// Standard deviation of the distance \[m\].
    pub fn range_sd_m(&self) -> f64 {
        self.range_sd_m
    }

    /// Standard deviation of either direction \[rad\].
    pub fn bearing_sd_rad(&self) -> f64 {
        self.bearing_sd_rad
    }

    /// The unit vectors along growing range, azimuth and elevation, and the cosine of the
    /// elevation.
    pub(crate) fn directions(&self) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>, f64) {
        let (sin_azimuth, cos_azimuth) = self.azimuth_rad.sin_cos();
        let (sin_elevation, cos_elevation) = self.elevation_rad.sin_cos();
        let forward = Vector3::new(
            cos_elevation * cos_azimuth,
            cos_elevation * sin_azimuth,
            sin_elevation,
        );
        let left = Vector3::new(-sin_azimuth, cos_azimuth, 0.0);
        let up = Vector3::new(
            -sin_elevation * cos_azimuth,
            -sin_elevation * sin_azimuth,
            cos_elevation,
        );
        (forward, left, up, cos_elevation.abs())
    }
}

/// Pose of a target in the body frame, with its noise in the target's frame.
pub type RelativePose = NoisyPose;

impl State for Relation {
    fn write(&self, out: &mut StateWriter) {
        match self {
            Self::Position(seen) => {
                0u8.write(out);
                (*seen.translation_m(), *seen.sd_m()).write(out);
            }
            Self::RangeBearing(seen) => {
                1u8.write(out);
                let direction = [seen.azimuth_rad(), seen.elevation_rad()];
                let sd = [seen.range_sd_m(), seen.bearing_sd_rad()];
                (seen.range_m(), (direction, sd)).write(out);
            }
            Self::Pose(seen) => {
                2u8.write(out);
                (*seen.pose(), *seen.noise().sd()).write(out);
            }
            Self::Range(seen) => {
                3u8.write(out);
                (seen.range_m(), (seen.range_sd_m(), *seen.antenna_m())).write(out);
            }
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let relation = match u8::read(input)? {
            0 => {
                let (at, sd) = <([f64; 3], [f64; 3])>::read(input)?;
                RelativePosition::new(at, sd).map(Self::Position)
            }
            1 => {
                let (range, (direction, sd)) = <(f64, ([f64; 2], [f64; 2]))>::read(input)?;
                let [azimuth, elevation] = direction;
                RangeBearing::new(range, azimuth, elevation, sd[0], sd[1]).map(Self::RangeBearing)
            }
            2 => {
                let pose = Isometry3::read(input)?;
                let (at, turn) = (pose.translation.vector, pose.rotation.coords);
                let (linear, angular) = <([f64; 3], [f64; 3])>::read(input)?;
                PoseNoise::new(linear, angular)
                    .and_then(|noise| RelativePose::new(at.into(), turn.into(), noise))
                    .map(|checked| Self::Pose(checked.exactly(pose)))
            }
            3 => {
                let (range, (sd, antenna)) = <(f64, (f64, [f64; 3]))>::read(input)?;
                Range::new(range, sd, antenna).map(Self::Range)
            }
            _ => return Err(CorruptState::Invalid),
        };
        relation.map_err(|_| CorruptState::Invalid)
    }
}
