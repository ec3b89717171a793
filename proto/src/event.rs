//! Events: what happened in a space, for whoever follows it.

use serde::{Deserialize, Serialize};

use crate::watermark::SkipReason;

/// One event, published on `cogmap/{space}/events` and as a server-sent event.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Event {
    /// Space.
    pub space: String,
    /// Agent that caused it.
    pub agent: String,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// Stamp of the sample that caused it \[ns\].
    pub stamp_ns: i64,
    /// What happened.
    pub kind: EventKind,
}

/// What happened. New kinds are added at the end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// The space met a new agent.
    AgentEnrolled {},
    /// The agent began a session.
    SessionStarted {
        /// The session.
        session: u64,
    },
    /// A place cell was recruited.
    PlaceRecruited {
        /// The place.
        place: u64,
        /// Its position in `map` \[m\].
        translation_m: [f64; 3],
    },
    /// The agent came to a place that the space knew.
    PlaceEntered {
        /// The place.
        place: u64,
        /// Confidence of the recall, in \[0, 1\].
        confidence: f64,
    },
    /// A trip began.
    TripStarted {
        /// The trip.
        trip: u64,
    },
    /// A trip ended.
    TripEnded {
        /// The trip.
        trip: u64,
        /// Its number of legs.
        legs: u64,
        /// Why it ended.
        reason: TripEnd,
    },
    /// A landmark was seen for the first time.
    LandmarkLearned {
        /// Its label.
        landmark: String,
        /// Its position in `map` \[m\].
        translation_m: [f64; 3],
    },
    /// Samples were refused for good.
    SamplesSkipped {
        /// First sequence number.
        from: u64,
        /// First beyond.
        to: u64,
        /// Why.
        reason: SkipReason,
    },
    /// The agent passed a marker.
    MarkerPassed {
        /// Its label.
        label: String,
    },
    /// A percept was far from what its place remembers of the channel.
    PerceptSurprising {
        /// The place.
        place: u64,
        /// Name of the channel.
        channel: String,
        /// What kind of percept it was.
        percept: PerceptKind,
        /// Number of percepts that taught what to expect, 3 at least.
        percepts: u64,
        /// How far it was from that: for a level in standard deviations, above 4; for a descriptor
        /// one minus the cosine, above 0.5.
        surprise: f64,
    },
    /// A place was forgotten: there was no room for the one recruited next. Its number is not given
    /// to another one.
    PlaceForgotten {
        /// The place.
        place: u64,
        /// Its position in `map` \[m\].
        translation_m: [f64; 3],
    },
    /// A trip was forgotten: there was no room for the leg recorded next. Its number is not given to
    /// another one.
    TripForgotten {
        /// The trip.
        trip: u64,
        /// Its number of legs.
        legs: u64,
    },
    /// It became known where an agent stands in the map, by what it and others saw.
    AgentPlaced {
        /// Its position in `map` \[m\].
        translation_m: [f64; 3],
    },
    /// Fewer objects come into question for what the agent touches.
    ObjectsNarrowed {
        /// How many.
        live: u64,
    },
    /// What the agent touches is known.
    ObjectRecognised {
        /// Name of the object.
        object: String,
        /// How probable it is, 0.995 at least.
        probability: f64,
    },
    /// What the agent touches is none of the objects that were learned.
    ObjectUnknown {},
    /// An object was learned, or more of it.
    ObjectLearned {
        /// Its name.
        object: String,
        /// Contacts of the episode that taught it.
        contacts: u64,
    },
    /// An episode was to teach an object and has not: it did not become clear how its frame lies in the object's.
    ObjectNotLearned {
        /// Contacts of the episode.
        contacts: u64,
    },
    /// Two objects turned out to be one.
    ObjectsMerged {
        /// Name of the one that they are.
        object: String,
        /// Name that the other one had; nothing is called so any more.
        absorbed: String,
    },
    /// What had been joined to an object turned out to be another one.
    ObjectSplit {
        /// Name of the object, which is again what it was before.
        object: String,
        /// Name of the other one.
        part: String,
    },
    /// The agent was removed, by whoever runs the service or to make room. What it did in the map stays; a
    /// message under its name enrols another agent.
    AgentRemoved {},
}

/// What kind of percept a channel carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum PerceptKind {
    /// Scalars.
    Level,
    /// Unit vectors.
    Descriptor,
}

/// Why a trip ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum TripEnd {
    /// The agent stood still.
    Stillness,
    /// Samples were lost, or none came for a long time on the sensor's clock.
    Gap,
    /// The session ended.
    SessionEnd,
    /// A marker said so.
    Marker,
    /// The trip reached the longest allowed number of legs, or trips under way filled the space's
    /// budget of legs; the next one continues it.
    Full,
    /// The agent was told where it stands, which breaks the thread of motion.
    StartPose,
}
