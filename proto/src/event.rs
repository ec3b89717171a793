//! Events: what happened in a space, for whoever follows it.

use std::fmt;
use std::num::ParseIntError;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::guidance::RouteFailure;
use crate::route::RouteStep;
use crate::watermark::SkipReason;

/// Which event of its space one is. Made of the record that brought it about, so it is the same
/// live, after a restart and in a replay, and later events have larger ids. As a text
/// `{map_revision}-{index}`, such as `4711-0`.
///
/// It stands beside the event: as `id` of a server-sent event and of a page, over Zenoh as the
/// attachment.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(try_from = "String", into = "String")]
pub struct EventId {
    /// Number of records that the map includes with the one that brought the event about.
    pub revision: u64,
    /// Number of that record's events before this one.
    pub index: u32,
}

/// Why a text is not an [`EventId`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an event's id is a map revision and an index, such as 4711-0, not {0:?}")]
pub struct EventIdError(String);

impl fmt::Display for EventId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}", self.revision, self.index)
    }
}

impl FromStr for EventId {
    type Err = EventIdError;

    fn from_str(text: &str) -> Result<Self, EventIdError> {
        let refused = |_: ParseIntError| EventIdError(text.to_owned());
        // A sign is no digit, though Rust reads it.
        let digits = |c: char| c.is_ascii_digit() || c == '-';
        let parts = text.split_once('-').filter(|_| text.chars().all(digits));
        let (revision, index) = parts.ok_or_else(|| EventIdError(text.to_owned()))?;
        Ok(Self {
            revision: revision.parse().map_err(refused)?,
            index: index.parse().map_err(refused)?,
        })
    }
}

impl TryFrom<String> for EventId {
    type Error = EventIdError;

    fn try_from(text: String) -> Result<Self, EventIdError> {
        text.parse()
    }
}

impl From<EventId> for String {
    fn from(id: EventId) -> Self {
        id.to_string()
    }
}

/// An event with its id.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct EventRecord {
    /// Its id.
    #[cfg_attr(feature = "schema", schema(value_type = String, pattern = "^[0-9]+-[0-9]+$"))]
    pub id: EventId,
    /// What happened.
    pub event: Event,
}

/// Events that somebody who follows them will not get: there were more than are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct MissedEvents {
    /// How many. Null where nobody counted: they are older than the start of the service, or the id
    /// asked for is of another past of the space.
    pub events: Option<u64>,
    /// Id of the oldest event that is kept; null where none is.
    #[cfg_attr(feature = "schema", schema(value_type = Option<String>))]
    pub next: Option<EventId>,
}

/// One page of the latest events.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct EventPage {
    /// The events, oldest first.
    pub events: Vec<EventRecord>,
    /// What happened after `after` and is not kept any more; absent where nothing did.
    pub missed: Option<MissedEvents>,
    /// Pass as `after` for the events that come after these; absent where there are none yet.
    #[cfg_attr(feature = "schema", schema(value_type = Option<String>))]
    pub next: Option<EventId>,
}

/// One event, published on `cogmap/{space}/events` and as a server-sent event.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Event {
    /// Space.
    pub space: String,
    /// Agent that caused it, or whose pose closed loops have corrected.
    pub agent: String,
    /// Number of records that the map includes with the one that brought it about.
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
    /// A trip was forgotten: there was no room for the leg recorded next. Its number is not given
    /// to another one.
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
        /// How probable it is: at least what the space's settings ask for, 0.995 by default.
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
    /// An episode was to teach an object and has not: it did not become clear how its frame lies in
    /// the object's.
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
    /// The agent was removed, by whoever runs the service or to make room. What it did in the map
    /// stays; a message under its name enrols another agent.
    AgentRemoved {},
    /// The agent came to a step of the route that it follows.
    RouteProgress {
        /// The place there; null beside the places.
        place: Option<u64>,
        /// Number of steps that are left.
        steps_left: u64,
        /// Length that is left \[m\].
        left_m: f64,
    },
    /// The agent was off its route, or a blockage came onto it: it follows another one from here.
    RouteLeft {
        /// How far off it was \[m\]; null where it was on the route.
        off_m: Option<f64>,
        /// The blockage that came onto the route; null where none did.
        blockage: Option<u64>,
        /// Length of the new route \[m\].
        length_m: f64,
        /// Number of its steps.
        steps_left: u64,
        /// The first 64 of them; the route of the agent tells all.
        steps: Vec<RouteStep>,
    },
    /// The agent has arrived where its route leads.
    RouteDone {},
    /// The agent follows no route any more, without having arrived.
    RouteFailed {
        /// Why.
        reason: RouteFailure,
        /// The blockages on the way that there would be.
        blockages: Vec<u64>,
    },
    /// Loops have closed: the agent's pose is corrected by the past relaxed. It comes for each
    /// agent of the map, whoever closed them, with each relaxation.
    LoopsClosed {
        /// Number of loop closures by which the past is relaxed: matches of samples, and revisits
        /// that were recognised.
        closures: u64,
        /// Number of matches of views by which it is.
        view_matches: u64,
        /// How far the agent's position has moved \[m\]. Its pose in `odom` goes on smoothly.
        moved_m: f64,
        /// How far the agent has turned \[rad\], 0 to π.
        turned_rad: f64,
        /// Its position in `map` since \[m\].
        translation_m: [f64; 3],
    },
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
