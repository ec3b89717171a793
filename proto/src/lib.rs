//! What may cross a wire.
//!
//! One description of every message serves three codecs: postcard for Rust clients, CBOR and JSON
//! for everyone else, with the same field names in both. The Zenoh `Encoding` of a message (or the
//! `Content-Type` of an HTTP body) says which codec it is in; nothing is guessed.
//!
//! **Version rule.** The version stands in the postcard encoding string ([`POSTCARD_V1`]), because
//! postcard has no field tags: a change there is a new enum variant at the end, or a new version.
//! CBOR and JSON evolve by addition: a reader ignores sample fields it does not know, and a field
//! that it does not find takes its documented default.
//!
//! Units are SI, angles radians, stamps nanoseconds of the sensor's clock. Quaternions are
//! `[x, y, z, w]` as in ROS.

mod answer;
mod bounded;
mod cbor;
mod channel;
mod codec;
mod encoding;
mod error;
mod estimate;
mod event;
mod felt;
mod field;
mod guidance;
mod key;
pub mod limits;
mod live;
mod localize;
mod name;
mod narrow;
mod object;
mod percept;
mod predict;
mod query;
mod remembered;
mod route;
mod sample;
mod sequence;
mod settings;
mod watermark;
mod wording;

pub use answer::{
    AgentAt, AgentDetail, AgentPage, AgentSummary, Evidence, GridModuleState, GridState,
    IngestAnswer, Landmark, LandmarkPage, Leg, Place, PlacePage, Problem, RecallAnswer,
    RecalledPlace, Rivals, SpaceInfo, SpaceList, StampedPose, Trajectory, Trip, TripDetail,
    TripPage,
};
pub use channel::{Channel, ChannelKind, ChannelList, Compass, LearnedChannel};
pub use codec::Codec;
pub use encoding::{CBOR, JSON, POSTCARD_V1};
pub use error::DecodeError;
pub use estimate::{Estimate, Status};
pub use event::{
    Event, EventId, EventIdError, EventKind, EventPage, EventRecord, MissedEvents, PerceptKind,
    TripEnd,
};
pub use felt::{FeltAnswer, FeltPercept, FeltPlace, FeltQuery, Looked};
pub use field::at_field;
pub use guidance::{
    Blockage, BlockageList, BlockageRequest, FollowRequest, FollowedRoute, FollowedRoutePage,
    FollowedRouteSummary, RouteFailure,
};
pub use key::{
    AgentKey, KeyError, SESSION_PARAMETER, durable_key, estimate_key, events_key, json_key,
    query_key, samples_key,
};
pub use live::{LiveAgent, LiveCounts, LiveHealth, LiveSighting, LiveTick};
pub use localize::{Localization, LocalizationHypothesis, LocalizeQuery, LocalizedPose};
pub use name::{Name, NameError};
pub use object::{
    AgentObject, Contact, ContactLevel, EndedEpisode, EpisodeKind, Identification, IdentifyQuery,
    NextTouch, ObjectDetail, ObjectLesson, ObjectLevel, ObjectMark, ObjectPage, ObjectPlace,
    ObjectPose, ObjectProbability, ObjectSummary, ObjectVerdict, Orientation, OtherPose, Reached,
    RivalObject, TouchNoise,
};
pub use percept::{Descriptor, Level};
pub use predict::{ExpectedPercept, MotionBody, PredictAnswer, PredictQuery, PredictedPercept};
pub use query::{PerceptCue, RecallQuery, Verb, WatermarkQuery};
pub use remembered::{PlacePercepts, RememberedPercept};
pub use route::{
    RetraceDirection, Route, RouteAnswer, RouteAvoid, RouteBack, RouteBox, RouteCost, RouteEnd,
    RouteFormat, RoutePose, RouteQuery, RouteRetrace, RouteReverse, RouteStep, RouteWay, Way,
    WayTraversals,
};
pub use sample::{
    Increment, Marker, MotionNoise, Relation, Sample, SampleBatch, SampleBody, Sighting, StartPose,
    Target, Velocity,
};
pub use sequence::{NextPlace, SequenceAnswer, SequenceElement, SequenceQuery, SequenceTrip};
pub use settings::{NoiseSettings, Recruitment, SpaceSettings};
pub use watermark::{Rejection, SeqRange, SkipReason, Watermark};
