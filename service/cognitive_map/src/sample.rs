//! Samples that make sense: constructors refuse what could not have been sensed.

use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3, Vector6};

use crate::geometry::se3;
use crate::object::ObjectMark;

/// Largest coordinate, length or speed \[m, m/s\].
const METRES_MAX: f64 = 1e8;
/// Largest angular rate \[rad/s\].
const RADIANS_PER_SECOND_MAX: f64 = 1e3;
/// Longest interval of one velocity sample \[s\].
const DURATION_S_MAX: f64 = 3600.0;
/// Farthest a unit vector's or quaternion's norm may be from one.
const UNIT_TOLERANCE: f64 = 1e-3;
/// Shortest and longest descriptor.
const DESCRIPTOR_LEN: std::ops::RangeInclusive<usize> = 8..=4096;
/// Longest label \[bytes\].
const LABEL_BYTES_MAX: usize = 128;

/// One valid sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Time on the sensor's clock \[ns\].
    pub stamp_ns: i64,
    /// What was sampled.
    pub body: SampleBody,
}

/// What a sample says.
#[derive(Clone, Debug, PartialEq)]
pub enum SampleBody {
    /// A displacement of the body since the previous motion sample.
    Motion(Motion),
    /// A scalar felt on a channel.
    Level(Level),
    /// A unit vector seen on a channel.
    Descriptor(Descriptor),
    /// A target seen relative to the body.
    Sighting(Sighting),
    /// Where the agent stands in `map`, told from outside.
    StartPose(StartPose),
    /// A named moment.
    Marker(Marker),
    /// An episode with an object begins or ends.
    Object(ObjectMark),
    /// The session ends here, and the trip under way with it.
    SessionEnd,
}

/// Why a sample is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidSample {
    /// A number is NaN, infinite or beyond its limit.
    #[error("a number is not finite or beyond its limit")]
    NumberOutOfRange,
    /// A quaternion's norm is not one.
    #[error("a quaternion is not a unit quaternion")]
    NonUnitQuaternion,
    /// A standard deviation is negative.
    #[error("a standard deviation is negative")]
    NegativeNoise,
    /// A descriptor has a wrong length or no direction.
    #[error("a descriptor has a wrong length or no direction")]
    InvalidDescriptor,
    /// A label is empty, too long or has control characters.
    #[error("a label is empty, too long or has control characters")]
    InvalidLabel,
    /// A surface normal is not a unit vector.
    #[error("a surface normal is not a unit vector")]
    InvalidNormal,
}

/// Standard deviations of a relative pose in right-perturbation coordinates (translation along, then
/// rotation about, the body axes x, y, z at its end) \[m, rad\]. Finite and not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseNoise(Vector6<f64>);

impl PoseNoise {
    /// # Errors
    /// A number is not finite, too large or negative.
    pub fn new(
        translation_sd_m: [f64; 3],
        rotation_sd_rad: [f64; 3],
    ) -> Result<Self, InvalidSample> {
        let [a, b, c] = deviations(translation_sd_m)?.into();
        let [d, e, f] = deviations(rotation_sd_rad)?.into();
        Ok(Self(Vector6::new(a, b, c, d, e, f)))
    }

    /// No noise at all.
    pub fn none() -> Self {
        Self(Vector6::zeros())
    }

    /// The standard deviations.
    pub fn sd(&self) -> &Vector6<f64> {
        &self.0
    }
}

/// A displacement of the body, in the body frame at its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    increment: Isometry3<f64>,
    noise: Option<PoseNoise>,
}

impl Motion {
    /// From a finished displacement \[m\] and a unit quaternion `[x, y, z, w]`.
    ///
    /// # Errors
    /// A number is out of range or the quaternion is not of unit norm.
    pub fn from_increment(
        translation_m: [f64; 3],
        rotation_xyzw: [f64; 4],
        noise: Option<PoseNoise>,
    ) -> Result<Self, InvalidSample> {
        Ok(Self {
            increment: pose(translation_m, rotation_xyzw)?,
            noise,
        })
    }

    /// From a body twist \[m/s, rad/s\] held for `duration_s`: the exact screw motion `exp(ξ Δt)`.
    ///
    /// # Errors
    /// A number is out of range or the duration is negative.
    pub fn from_velocity(
        linear_m_s: [f64; 3],
        angular_rad_s: [f64; 3],
        duration_s: f64,
        noise: Option<PoseNoise>,
    ) -> Result<Self, InvalidSample> {
        let linear = bounded(linear_m_s, METRES_MAX)?;
        let angular = bounded(angular_rad_s, RADIANS_PER_SECOND_MAX)?;
        if !(0.0..=DURATION_S_MAX).contains(&duration_s) {
            return Err(InvalidSample::NumberOutOfRange);
        }
        let increment = se3::exp(&(linear * duration_s), &(angular * duration_s));
        Ok(Self { increment, noise })
    }

    /// The displacement.
    pub fn increment(&self) -> &Isometry3<f64> {
        &self.increment
    }

    /// Its noise; the settings' odometry noise when absent.
    pub fn noise(&self) -> Option<&PoseNoise> {
        self.noise.as_ref()
    }
}

/// A label of a landmark, a channel or a marker: 1 to 128 bytes without control characters.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Label(Box<str>);

impl Label {
    /// # Errors
    /// The text is empty, too long or has control characters.
    pub fn new(text: &str) -> Result<Self, InvalidSample> {
        if text.is_empty() || text.len() > LABEL_BYTES_MAX || text.chars().any(char::is_control) {
            return Err(InvalidSample::InvalidLabel);
        }
        Ok(Self(text.into()))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// A scalar on a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    channel: Label,
    value: f64,
    offset_m: Vector3<f64>,
    normal: Option<Unit<Vector3<f64>>>,
}

impl Level {
    /// `offset_m` is where the sensor sits in the body frame, `normal` the surface's normal there.
    ///
    /// # Errors
    /// A number is out of range, or the normal is not a unit vector.
    pub fn new(
        channel: Label,
        value: f64,
        offset_m: [f64; 3],
        normal: Option<[f64; 3]>,
    ) -> Result<Self, InvalidSample> {
        if !value.is_finite() {
            return Err(InvalidSample::NumberOutOfRange);
        }
        let offset_m = bounded(offset_m, METRES_MAX)?;
        let normal = match normal {
            None => None,
            Some(normal) => {
                let normal = bounded(normal, METRES_MAX)?;
                if (normal.norm() - 1.0).abs() > UNIT_TOLERANCE {
                    return Err(InvalidSample::InvalidNormal);
                }
                Some(Unit::new_normalize(normal))
            }
        };
        Ok(Self {
            channel,
            value,
            offset_m,
            normal,
        })
    }

    /// Channel.
    pub fn channel(&self) -> &Label {
        &self.channel
    }

    /// Value, in the channel's unit.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Where the sensor sits in the body frame \[m\].
    pub fn offset_m(&self) -> &Vector3<f64> {
        &self.offset_m
    }

    /// Surface normal in the body frame.
    pub fn normal(&self) -> Option<&Unit<Vector3<f64>>> {
        self.normal.as_ref()
    }
}

/// A unit vector on a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Descriptor {
    channel: Label,
    vector: Box<[f32]>,
}

impl Descriptor {
    /// Normalises the vector.
    ///
    /// # Errors
    /// The vector is too short, too long, not finite or zero.
    pub fn new(channel: Label, vector: &[f32]) -> Result<Self, InvalidSample> {
        let norm = vector
            .iter()
            .map(|&x| f64::from(x) * f64::from(x))
            .sum::<f64>()
            .sqrt();
        if !DESCRIPTOR_LEN.contains(&vector.len()) || !norm.is_finite() || norm < 1e-12 {
            return Err(InvalidSample::InvalidDescriptor);
        }
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a component of a unit vector fits f32"
        )]
        let vector = vector
            .iter()
            .map(|&x| (f64::from(x) / norm) as f32)
            .collect();
        Ok(Self { channel, vector })
    }

    /// Channel.
    pub fn channel(&self) -> &Label {
        &self.channel
    }

    /// The unit vector.
    pub fn vector(&self) -> &[f32] {
        &self.vector
    }
}

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
}

/// A full pose relative to the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativePose {
    pose: Isometry3<f64>,
    noise: PoseNoise,
}

impl RelativePose {
    /// # Errors
    /// A number is out of range or the quaternion is not of unit norm.
    pub fn new(
        translation_m: [f64; 3],
        rotation_xyzw: [f64; 4],
        noise: PoseNoise,
    ) -> Result<Self, InvalidSample> {
        Ok(Self {
            pose: pose(translation_m, rotation_xyzw)?,
            noise,
        })
    }

    /// The same with a pose that was read back as it was: normalising anew might change its last bit.
    pub(crate) fn exactly(self, pose: Isometry3<f64>) -> Self {
        Self { pose, ..self }
    }

    /// Pose of the target in the body frame.
    pub fn pose(&self) -> &Isometry3<f64> {
        &self.pose
    }

    /// Its noise, in the target's frame.
    pub fn noise(&self) -> &PoseNoise {
        &self.noise
    }
}

/// Where the agent stands in `map`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartPose {
    pose: Isometry3<f64>,
    noise: PoseNoise,
}

impl StartPose {
    /// # Errors
    /// A number is out of range or the quaternion is not of unit norm.
    pub fn new(
        translation_m: [f64; 3],
        rotation_xyzw: [f64; 4],
        noise: PoseNoise,
    ) -> Result<Self, InvalidSample> {
        Ok(Self {
            pose: pose(translation_m, rotation_xyzw)?,
            noise,
        })
    }

    /// The pose.
    pub fn pose(&self) -> &Isometry3<f64> {
        &self.pose
    }

    /// Its noise, along and about the body axes.
    pub fn noise(&self) -> &PoseNoise {
        &self.noise
    }
}

/// A named moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Marker {
    /// Its label.
    pub label: Label,
    /// Whether the trip under way ends here.
    pub ends_trip: bool,
}

/// A vector of finite numbers not larger than `limit`.
fn bounded(numbers: [f64; 3], limit: f64) -> Result<Vector3<f64>, InvalidSample> {
    if numbers.iter().all(|x| x.abs() <= limit) {
        Ok(numbers.into())
    } else {
        Err(InvalidSample::NumberOutOfRange) // NaN too: no comparison with it holds
    }
}

/// A vector of finite standard deviations.
fn deviations(sd: [f64; 3]) -> Result<Vector3<f64>, InvalidSample> {
    let sd = bounded(sd, METRES_MAX)?;
    if sd.iter().any(|&x| x < 0.0) {
        Err(InvalidSample::NegativeNoise)
    } else {
        Ok(sd)
    }
}

/// A pose from a translation \[m\] and a unit quaternion `[x, y, z, w]`.
fn pose(translation_m: [f64; 3], rotation_xyzw: [f64; 4]) -> Result<Isometry3<f64>, InvalidSample> {
    let translation = Translation3::from(bounded(translation_m, METRES_MAX)?);
    let [x, y, z, w] = rotation_xyzw;
    let quaternion = Quaternion::new(w, x, y, z);
    let norm = quaternion.norm();
    if !norm.is_finite() {
        return Err(InvalidSample::NumberOutOfRange);
    }
    if (norm - 1.0).abs() > UNIT_TOLERANCE {
        return Err(InvalidSample::NonUnitQuaternion);
    }
    let rotation = UnitQuaternion::new_normalize(quaternion);
    Ok(Isometry3::from_parts(translation, rotation))
}
