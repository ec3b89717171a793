//! Events: what a record brought about.

use nalgebra::Point3;

use crate::input::Label;
use crate::input::{AgentId, SkipReason};
use crate::memory::blockage::BlockageId;
use crate::memory::landmark::LandmarkId;
use crate::memory::percept::ChannelId;
use crate::memory::place::PlaceId;
use crate::memory::trip::{TripEnd, TripId};
use crate::route::Route;
use object_recognition::{ObjectId, Posterior};

/// One event.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The agent that caused it, or whose pose closed loops have corrected.
    pub agent: AgentId,
    /// Stamp of the sample that caused it \[ns\]; for a skip, of the latest sample before it;
    /// 0 where there is none.
    pub stamp_ns: i64,
    /// What happened.
    pub kind: EventKind,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum EventKind {
    /// The space met a new agent.
    AgentEnrolled,
    /// The agent began a session.
    SessionStarted {
        /// The session.
        session: u64,
    },
    /// The agent entered a new lattice cell of a grid module; the reference point moved there.
    CellEntered {
        /// Index of the module, finest first.
        module: u8,
        /// Lattice index of the new reference point.
        reference: [i64; 3],
    },
    /// A place cell was recruited.
    PlaceRecruited {
        /// The place.
        place: PlaceId,
        /// Its position in `map` \[m\].
        position: Point3<f64>,
    },
    /// The agent came to a known place.
    PlaceEntered {
        /// The place.
        place: PlaceId,
        /// Confidence of the recall, in \[0, 1\].
        confidence: f64,
    },
    /// A trip began.
    TripStarted {
        /// The trip.
        trip: TripId,
    },
    /// A trip ended.
    TripEnded {
        /// The trip.
        trip: TripId,
        /// Its number of legs.
        legs: usize,
        /// Why.
        reason: TripEnd,
    },
    /// It became known where an agent is in the map, by what it and others saw.
    AgentPlaced {
        /// Its position in `map` \[m\].
        position: Point3<f64>,
    },
    /// Loops have closed: the agent's pose is corrected by the past relaxed.
    LoopsClosed(LoopsClosed),
    /// A landmark was seen for the first time.
    LandmarkLearned {
        /// The landmark.
        landmark: LandmarkId,
        /// Its position in `map` \[m\].
        position: Point3<f64>,
    },
    /// Samples were skipped.
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
        label: Label,
    },
    /// A place was forgotten, because there was no room for the one recruited next.
    PlaceForgotten {
        /// The place.
        place: PlaceId,
        /// Its position in `map` \[m\].
        position: Point3<f64>,
    },
    /// A trip was forgotten, because there was no room for the leg recorded next.
    TripForgotten {
        /// The trip.
        trip: TripId,
        /// Its number of legs.
        legs: usize,
    },
    /// Fewer objects come into question for what the agent touches.
    ObjectsNarrowed {
        /// How many.
        live: u32,
    },
    /// What the agent touches is known.
    ObjectRecognised {
        /// The object.
        object: ObjectId,
        /// Its name.
        name: Label,
        /// How probable that is.
        probability: f64,
    },
    /// What the agent touches is none of the objects that were learned.
    ObjectUnknown,
    /// An object was learned, or more of it.
    ObjectLearned {
        /// The object.
        object: ObjectId,
        /// Its name.
        name: Label,
        /// Contacts of this episode.
        contacts: u64,
    },
    /// An episode was to teach an object and has not: it did not become clear how its frame lies in
    /// the object's.
    ObjectNotLearned {
        /// Contacts of this episode.
        contacts: u64,
    },
    /// Two objects turned out to be one.
    ObjectsMerged {
        /// The one that they are.
        object: ObjectId,
        /// Its name.
        name: Label,
        /// Name of the one that is no more.
        absorbed: Label,
    },
    /// What had been joined to an object turned out to be another one.
    ObjectSplit {
        /// The object.
        object: ObjectId,
        /// Its name.
        name: Label,
        /// The other one.
        part: ObjectId,
        /// Its name.
        part_name: Label,
    },
    /// An episode with an object ended, in which something was sensed.
    EpisodeEnded {
        /// Session of the agent that it was part of.
        session: u64,
        /// Whether it was to teach an object.
        teaches: bool,
        /// What its contacts said in the end, before anything was learned from it; none where it
        /// taught an object by its name.
        posterior: Option<Box<Posterior>>,
    },
    /// A percept was sensed where a place remembers its channel; before the place learned from it.
    PerceptCompared {
        /// The place.
        place: PlaceId,
        /// The channel.
        channel: ChannelId,
        /// Number of percepts that taught what to expect.
        percepts: u64,
        /// How far it was from that: for a level in deviations, of which the channel's floor is the
        /// least; for a descriptor one minus the cosine, 0 to 2.
        surprise: f64,
    },
    /// The agent came to a step of the route that it follows.
    RouteProgress {
        /// The place there; `None` beside the places.
        place: Option<PlaceId>,
        /// Number of steps that are left.
        steps_left: usize,
        /// Length of the way that is left \[m\].
        rest_m: f64,
    },
    /// The route that the agent follows leads nowhere from where it is now; it follows another one.
    RouteLeft(Box<RouteLeft>),
    /// The agent has arrived where its route leads.
    RouteDone,
    /// The agent follows no route any more, without having arrived.
    RouteFailed {
        /// Why.
        failure: RouteFailure,
    },
    /// The agent was removed: by that name the space knows nobody any more.
    AgentRemoved {
        /// Its name.
        name: Label,
    },
}

/// What closed loops have brought an agent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopsClosed {
    /// Number of loop closures by which the past is relaxed.
    pub closures: usize,
    /// Number of matches of views by which it is.
    pub view_matches: usize,
    /// How far the agent's position has moved \[m\].
    pub moved_m: f64,
    /// How far it has turned \[rad\], 0 to π.
    pub turned_rad: f64,
    /// Its position in `map` since \[m\].
    pub position: Point3<f64>,
}

/// Why an agent follows another route than before, and which.
#[derive(Clone, Debug, PartialEq)]
pub struct RouteLeft {
    /// How far off the route it was \[m\]; `None` where it was on it.
    pub off_m: Option<f64>,
    /// The blockage that came onto it; `None` where none did.
    pub blockage: Option<BlockageId>,
    /// The route that it follows from here on.
    pub route: Route,
}

/// Why an agent follows no route any more.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RouteFailure {
    /// No way leads there any more; the blockages on that which would.
    NoWay(Vec<BlockageId>),
    /// The goal has been forgotten.
    GoalForgotten,
    /// No place is near the agent.
    NothingNear,
    /// It is not known where the agent is.
    AgentLost,
    /// The agent has begun another session.
    SessionEnded,
}
