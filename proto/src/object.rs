//! Objects: what is touched, learned and known again.

use serde::{Deserialize, Serialize};

use crate::percept::Descriptor;

/// Begins or ends an episode with an object. What is felt in between counts in the frame of the
/// body when the episode began.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum ObjectMark {
    /// What is felt from here on teaches an object.
    Learn {
        /// Its name. One that is known is extended if the episode shows how its frame lies in the
        /// object's. Without a name it is the object that is recognised, or a new one. Nothing can
        /// be called `identify`.
        #[serde(default)]
        name: Option<String>,
        /// Contacts within this distance \[m\], 10 µm to 1 km, are of one place of a new object.
        #[serde(default = "spacing_m")]
        spacing_m: f64,
        /// How the frame may be turned against that of an object known before.
        #[serde(default)]
        orientation: Orientation,
        /// How exactly is felt.
        #[serde(default)]
        noise: TouchNoise,
    },
    /// What is felt from here on is to be recognised. If it turns out to be unknown, it is learned
    /// at the end.
    Identify {
        /// How the frame may be turned against an object's.
        #[serde(default)]
        orientation: Orientation,
        /// How exactly is felt.
        #[serde(default)]
        noise: TouchNoise,
    },
    /// The episode ends.
    End {},
    /// What is felt from here on is to be recognised, and nothing is learned from it, also in a
    /// space that learns unknown objects.
    Recognise {
        /// How the frame may be turned against an object's.
        #[serde(default)]
        orientation: Orientation,
        /// How exactly is felt.
        #[serde(default)]
        noise: TouchNoise,
    },
}

/// What is known of how the frame of an episode is turned against an object's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Orientation {
    /// The frames are parallel.
    Known {},
    /// By one of the 24 turns that take a cube into itself.
    Cube {},
    /// By one of these rotations, all equally likely: from the episode's frame into the object's,
    /// at most 1000.
    Finite {
        /// Unit quaternions `[x, y, z, w]`.
        rotations_xyzw: Vec<[f64; 4]>,
    },
    /// By any rotation. Contacts need normals then.
    Free {},
    /// By any rotation about the vertical: the z axes of both frames are parallel, as of things
    /// that stand on a table. Contacts need no normals.
    Yaw {},
}

impl Default for Orientation {
    fn default() -> Self {
        Self::Known {}
    }
}

impl ObjectMark {
    /// What it holds of varying length: bytes of its name, and number of rotations.
    pub fn lengths(&self) -> (usize, usize) {
        let (name, orientation) = match self {
            Self::Learn {
                name, orientation, ..
            } => (name.as_ref().map_or(0, String::len), orientation),
            Self::Identify { orientation, .. } | Self::Recognise { orientation, .. } => {
                (0, orientation)
            }
            Self::End {} => return (0, 0),
        };
        let rotations = match orientation {
            Orientation::Finite { rotations_xyzw } => rotations_xyzw.len(),
            Orientation::Known {}
            | Orientation::Cube {}
            | Orientation::Free {}
            | Orientation::Yaw {} => 0,
        };
        (name, rotations)
    }
}

/// Standard deviations of what is felt.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(default)]
pub struct TouchNoise {
    /// Of a contact's position per axis \[m\]; 2 mm when absent.
    pub position_sd_m: f64,
    /// Of a normal's direction per axis \[rad\]; 0.035 when absent.
    pub normal_sd_rad: f64,
    /// Of a level, in its channel's unit; 0.1 when absent.
    pub level_sd: f64,
}

impl Default for TouchNoise {
    fn default() -> Self {
        Self {
            position_sd_m: 0.002,
            normal_sd_rad: 0.035,
            level_sd: 0.1,
        }
    }
}

/// Places 4 mm apart, for things that a hand can hold.
fn spacing_m() -> f64 {
    0.004
}

/// A contact.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Position \[m\].
    pub position_m: [f64; 3],
    /// The surface's outward normal there, a unit vector.
    #[serde(default)]
    pub normal: Option<[f64; 3]>,
    /// What was felt, at most one level of each channel.
    #[serde(default)]
    pub levels: Vec<ContactLevel>,
    /// What was seen, at most one descriptor of each channel.
    #[serde(default)]
    pub descriptors: Vec<Descriptor>,
    /// What path integration has drifted since the first contact, per axis \[m\].
    #[serde(default)]
    pub drift_sd_m: f64,
    /// How it was come by; found when absent.
    #[serde(default)]
    pub reached: Reached,
}

/// How a contact was come by, which says what its place tells about the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Reached {
    /// It was come upon, within a step of the contact before.
    #[default]
    Found,
    /// It was asked for: where it lies is the asker's choice.
    Aimed,
    /// It was drawn evenly from the whole surface.
    Drawn,
}

/// A level that was felt at a contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct ContactLevel {
    /// Name of the channel.
    pub channel: String,
    /// The value, in the channel's own unit.
    pub value: f64,
}

/// Teaches an object at once, in place of what was known of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct ObjectLesson {
    /// Contacts within this distance \[m\], 10 µm to 1 km, are of one place.
    #[serde(default = "spacing_m")]
    pub spacing_m: f64,
    /// How exactly was felt.
    #[serde(default)]
    pub noise: TouchNoise,
    /// The contacts, in the object's own frame; at least one, at most 4096.
    pub contacts: Vec<Contact>,
}

/// Asks which object a sequence of contacts is of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct IdentifyQuery {
    /// How the frame of the contacts may be turned against an object's.
    #[serde(default)]
    pub orientation: Orientation,
    /// How exactly was felt.
    #[serde(default)]
    pub noise: TouchNoise,
    /// The contacts, in the order in which they were felt, in a frame of their own; at least one,
    /// at most 256.
    pub contacts: Vec<Contact>,
}

/// What is known of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct ObjectSummary {
    /// Its name.
    pub name: String,
    /// How many places it has.
    pub places: u64,
    /// Distance within which contacts are of one place \[m\].
    pub spacing_m: f64,
    /// Corner of the box around its places with the least coordinates \[m\], in its own frame.
    pub min_m: [f64; 3],
    /// The corner with the largest.
    pub max_m: [f64; 3],
    /// How many contacts taught it.
    pub contacts: u64,
    /// In how many episodes and lessons.
    pub visits: u64,
    /// Typical distance between neighbouring places \[m\]; absent of a single place.
    #[serde(default)]
    pub gap_m: Option<f64>,
    /// Distance between places at which the surface between them would be known as exactly as it is
    /// felt \[m\]: what is above it should be felt more densely. Absent where places are dense, or
    /// too few to tell, or where contacts fall on them alone.
    #[serde(default)]
    pub advised_gap_m: Option<f64>,
    /// In the answer to a lesson that asks for it, another object for which this one would be
    /// taken, turned about the vertical or not.
    #[serde(default)]
    pub alike: Option<ObjectProbability>,
}

/// Objects of a space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct ObjectPage {
    /// The objects, by name.
    pub objects: Vec<ObjectSummary>,
    /// Name to go on after; absent on the last page.
    pub next: Option<String>,
}

/// An object with its places.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct ObjectDetail {
    /// What is known of it.
    pub summary: ObjectSummary,
    /// Its places, in the order in which they were first touched.
    pub places: Vec<ObjectPlace>,
}

/// A place of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct ObjectPlace {
    /// Mean position of its contacts \[m\], in the object's frame.
    pub position_m: [f64; 3],
    /// Mean outward normal, if one was felt.
    pub normal: Option<[f64; 3]>,
    /// How many contacts there were.
    pub contacts: f64,
    /// What was felt, by channel.
    pub levels: Vec<ObjectLevel>,
}

/// What was felt at a place of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct ObjectLevel {
    /// Name of the channel.
    pub channel: String,
    /// Mean.
    pub mean: f64,
    /// Standard deviation of what will be felt there, beside the sensor's noise.
    pub sd: f64,
}

/// What a sequence of contacts says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Identification {
    /// Space.
    pub space: String,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// The answer, once one is as probable as the space's settings ask for, 99.5 % by default.
    pub verdict: ObjectVerdict,
    /// Probability of each object that has one of at least 10⁻⁶, most probable first.
    pub objects: Vec<ObjectProbability>,
    /// Probability that it is none of them.
    pub unknown: f64,
    /// How many objects have a probability above one hundredth.
    pub live_objects: u64,
    /// How many hypotheses, each an object in a pose, hold 99 % of all evidence.
    pub live_hypotheses: u64,
    /// Entropy over objects and unknown \[nats\].
    pub entropy_nats: f64,
    /// Contacts that were taken in.
    pub contacts: u64,
    /// How well the best explanation fits, in standard deviations of what a right one does: about 0
    /// for what was learned, far below −3 for what was not.
    pub fit: f64,
    /// Pose in the most probable object.
    pub pose: Option<ObjectPose>,
    /// Where the next touch would tell most.
    pub next_touch: Option<NextTouch>,
    /// Share of the most probable object's places that a contact has come near, where its pose is
    /// known: what is left of it may differ.
    #[serde(default)]
    pub explored: Option<f64>,
    /// What speaks for the most probable object against the second.
    #[serde(default)]
    pub rival: Option<RivalObject>,
}

/// The second most probable object, and what the contacts say against it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct RivalObject {
    /// Its name.
    pub name: String,
    /// How much each contact, in the order in which they were felt, speaks for the most probable
    /// object against this one \[nats\]; below zero for this one.
    pub contacts_nats: Vec<f64>,
}

/// The answer to which object it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum ObjectVerdict {
    /// More contacts are needed.
    Undecided {},
    /// This one.
    Object {
        /// Its name.
        name: String,
    },
    /// None that was learned.
    Unknown {},
}

/// Probability of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct ObjectProbability {
    /// Its name.
    pub name: String,
    /// Its probability.
    pub probability: f64,
}

/// Where the frame of the contacts lies in an object's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct ObjectPose {
    /// The object.
    pub object: String,
    /// Origin of the contacts' frame in the object's \[m\].
    pub translation_m: [f64; 3],
    /// Its orientation there as a unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// Covariance of its error along and about its own axes: upper triangle, row by row \[m², m
    /// rad, rad²\].
    pub covariance: [f64; 21],
    /// Share of the object's evidence that this pose holds.
    pub share: f64,
    /// Other poses with a share: of something symmetric, the symmetric ones.
    pub others: Vec<OtherPose>,
}

/// Another pose that explains the contacts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct OtherPose {
    /// Origin of the contacts' frame in the object's \[m\].
    pub translation_m: [f64; 3],
    /// Its orientation there as a unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// Its share of the evidence.
    pub share: f64,
}

/// A touch that would tell much.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct NextTouch {
    /// Where to touch \[m\], in the frame of the contacts.
    pub position_m: [f64; 3],
    /// The way to move on the approach, in the same frame.
    pub approach: Option<[f64; 3]>,
    /// Information expected from it \[nats\].
    pub gain_nats: f64,
}

/// The episode of an agent with an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct AgentObject {
    /// Space.
    pub space: String,
    /// Agent.
    pub agent: String,
    /// What the episode under way is for; absent when there is none.
    pub episode: Option<EpisodeKind>,
    /// What its contacts say; in the frame of the body when the episode began.
    pub identification: Option<Identification>,
    /// The latest episode that has ended; absent when there was none in which something was felt.
    /// Also kept when the robot has closed its session, and over a restart of the service.
    #[serde(default)]
    pub last: Option<EndedEpisode>,
    /// The contacts of the episode under way, oldest first, in the frame of the body when it began:
    /// at most the first 128, by which it recognises. Without descriptors, which may be long.
    #[serde(default)]
    pub contacts: Vec<Contact>,
}

/// An episode with an object that has ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct EndedEpisode {
    /// What it was for.
    pub episode: EpisodeKind,
    /// Session of the agent that it was part of.
    pub session: u64,
    /// Stamp of the sample that ended it \[ns\].
    pub stamp_ns: i64,
    /// What its contacts said in the end, before anything was learned from it; absent when it
    /// taught an object by its name.
    pub identification: Option<Identification>,
}

/// What an episode is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum EpisodeKind {
    /// It teaches an object.
    Learn,
    /// It is to recognise one.
    Identify,
}

impl EpisodeKind {
    /// What an episode is for that teaches or does not.
    pub fn of(teaches: bool) -> Self {
        if teaches { Self::Learn } else { Self::Identify }
    }
}
