//! Watermarks: the acknowledgement of samples.

use serde::{Deserialize, Serialize};

/// How far an agent's samples have come. Published on `cogmap/{space}/{agent}/durable` whenever it
/// moves, when a gap is seen, and on the start of the service.
///
/// A client keeps every sample at or above `durable` and sends it again after a gap, a reconnect or
/// a silence. A watermark of a larger session than the client's own means that the agent's name has
/// been taken over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Watermark {
    /// The agent's current session.
    pub session: u64,
    /// Every sample below this sequence number is on disk.
    pub durable: u64,
    /// Every sample below this sequence number has been applied, or rejected for good.
    pub applied: u64,
    /// The samples that are missing now, while later ones wait for them.
    pub gap: Option<SeqRange>,
    /// Samples refused for good, the latest few.
    pub rejected: Vec<Rejection>,
    /// Number of the owner of the space's journal that wrote it: each later owner has a larger one;
    /// 0 on one machine. A watermark with a smaller term than the largest that was heard of the
    /// agent is outdated. From one term to the next `applied` may go back, and `durable` never
    /// does.
    #[serde(default)]
    pub term: u64,
}

/// The sequence numbers from `from` up to but without `to`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct SeqRange {
    /// First.
    pub from: u64,
    /// First beyond.
    pub to: u64,
}

/// A range of samples refused for good, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Rejection {
    /// Which samples.
    pub range: SeqRange,
    /// Why.
    pub reason: SkipReason,
}

/// Why a sample was refused for good. New reasons are added at the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum SkipReason {
    /// A number is NaN, infinite or beyond its limit.
    NumberOutOfRange,
    /// A quaternion is not a unit quaternion.
    NonUnitQuaternion,
    /// A standard deviation is negative.
    NegativeNoise,
    /// The stamp runs backwards within the session.
    TimeBackwards,
    /// A descriptor has a wrong length or no direction.
    InvalidDescriptor,
    /// A channel, landmark, agent, object or marker label is empty, too long or has forbidden
    /// characters, or is one that nothing can be called.
    InvalidLabel,
    /// A surface normal is not a unit vector.
    InvalidNormal,
    /// The sample never came, and the wait for it is over.
    Lost,
    /// The sample's number is more than 2³² ahead of the next one in order.
    SequenceLeap,
}
