//! Samples: what a robot did (motion) and what it felt or saw (percepts).

use serde::{Deserialize, Serialize};

use crate::object::ObjectMark;
use crate::percept::{Descriptor, Level};

/// Consecutive samples of one agent: sample `i` of the batch has the number `first_seq + i`.
///
/// An agent numbers its samples from 0 within a *session* (one run of the agent).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct SampleBatch {
    /// The run of the agent. A larger number takes over from a smaller one, so the largest of all
    /// is refused; by convention the Unix time of the start \[ns\].
    pub session: u64,
    /// Sequence number of the first sample.
    pub first_seq: u64,
    /// The samples, in order; at least one, at most [`crate::limits::BATCH_SAMPLES_MAX`].
    pub samples: Vec<Sample>,
}

/// One sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Sample {
    /// Time on the sensor's clock \[ns\]; never runs backwards within a session.
    pub stamp_ns: i64,
    /// What was sampled.
    pub body: SampleBody,
}

/// What a sample says. New kinds are added at the end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum SampleBody {
    /// Motion as a finished displacement.
    Increment(Increment),
    /// Motion as a velocity held for a time.
    Velocity(Velocity),
    /// A scalar felt on a channel.
    Level(Level),
    /// A unit vector seen on a channel.
    Descriptor(Descriptor),
    /// A target seen at a place relative to the body.
    Sighting(Sighting),
    /// Where the agent stands in the map, told from outside.
    StartPose(StartPose),
    /// A named moment; may end the trip under way.
    Marker(Marker),
    /// An episode with an object begins or ends.
    Object(ObjectMark),
    /// The session ends, and the trip under way with it: a robot's last word. Samples that come
    /// after it all the same go on as before.
    SessionEnd {},
}

/// The body's displacement since the previous motion sample, in the body frame at its start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Increment {
    /// Displacement \[m\].
    pub translation_m: [f64; 3],
    /// Rotation as a unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// Noise of this increment; the space's odometry noise when absent.
    #[serde(default)]
    pub noise: Option<MotionNoise>,
}

/// A body twist held over the `duration_s` that end at the sample's stamp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Velocity {
    /// Linear velocity in the body frame \[m/s\].
    pub linear_m_s: [f64; 3],
    /// Angular velocity in the body frame \[rad/s\].
    pub angular_rad_s: [f64; 3],
    /// How long the twist was held \[s\], at least 0.
    pub duration_s: f64,
    /// Noise of the resulting increment; the space's odometry noise when absent.
    #[serde(default)]
    pub noise: Option<MotionNoise>,
}

/// Standard deviations along and about the body axes x, y, z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct MotionNoise {
    /// Of the translation \[m\].
    pub translation_sd_m: [f64; 3],
    /// Of the rotation vector \[rad\].
    pub rotation_sd_rad: [f64; 3],
}

/// A target seen from the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Sighting {
    /// What was seen.
    pub target: Target,
    /// Where it was seen.
    pub relation: Relation,
}

/// What a sighting is of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// A landmark, by its label.
    Landmark(String),
    /// Another agent of the space, by its name.
    Agent(String),
    /// Where this agent itself was at the sample of this sequence number: a loop closure found
    /// outside.
    OwnSample(u64),
}

/// Where a target was seen, in the body frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Relation {
    /// Position of the target.
    Position {
        /// Position \[m\].
        translation_m: [f64; 3],
        /// Standard deviation along each body axis \[m\].
        sd_m: [f64; 3],
    },
    /// Distance and direction of the target.
    RangeBearing {
        /// Distance \[m\].
        range_m: f64,
        /// Direction in the x-y plane, left positive \[rad\].
        azimuth_rad: f64,
        /// Direction above the x-y plane \[rad\].
        #[serde(default)]
        elevation_rad: f64,
        /// Standard deviation of the distance \[m\].
        range_sd_m: f64,
        /// Standard deviation of either direction \[rad\].
        bearing_sd_rad: f64,
    },
    /// Full pose of the target.
    Pose {
        /// Position \[m\].
        translation_m: [f64; 3],
        /// Orientation as a unit quaternion `[x, y, z, w]`.
        rotation_xyzw: [f64; 4],
        /// Noise of the relation, in the target's frame.
        noise: MotionNoise,
    },
    /// Distance of the target alone, as ultra-wideband radios measure it.
    Range {
        /// Distance \[m\].
        range_m: f64,
        /// Standard deviation of the distance \[m\].
        range_sd_m: f64,
        /// Position of the antenna in the body frame \[m\].
        #[serde(default)]
        offset_m: [f64; 3],
    },
}

/// Where the agent stands in the space's `map` frame, told from outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct StartPose {
    /// Position in `map` \[m\].
    pub translation_m: [f64; 3],
    /// Orientation in `map` as a unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// How well it is known, along and about the body axes; exact when absent.
    #[serde(default)]
    pub noise: Option<MotionNoise>,
}

/// A named moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Marker {
    /// Its label.
    pub label: String,
    /// Whether the trip under way ends here.
    #[serde(default)]
    pub ends_trip: bool,
}
