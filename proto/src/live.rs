//! Ticks of a live stream: what changed in a space since the tick before.

use serde::{Deserialize, Serialize};

use crate::estimate::{Estimate, Status};
use crate::event::{EventRecord, MissedEvents};
use crate::sample::Target;

/// What changed in a space since the tick before of the same stream; everything in the first one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct LiveTick {
    /// Number of records that all of this includes; some of it may include more.
    pub map_revision: u64,
    /// Agents of which the estimate or the lag changed, by name; in the first tick all that have
    /// an estimate.
    pub agents: Vec<LiveAgent>,
    /// Names of agents that are gone.
    pub removed: Vec<String>,
    /// What happened, oldest first.
    pub events: Vec<EventRecord>,
    /// That events were missed before these.
    pub missed: Option<MissedEvents>,
    /// The latest sightings that were applied, at most 64, oldest first.
    pub sightings: Vec<LiveSighting>,
    /// Sizes of the space.
    pub counts: LiveCounts,
    /// How the service keeps up.
    pub health: LiveHealth,
}

/// Where an agent is, in short.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct LiveAgent {
    /// Its name.
    pub name: String,
    /// Its session.
    pub session: u64,
    /// Sequence number of the latest sample that the estimate includes.
    pub seq: u64,
    /// Stamp of that sample \[ns\].
    pub stamp_ns: i64,
    /// How it is localised.
    pub status: Status,
    /// Frame of the pose: `map`; or `unplaced` while the agent is lost and nothing ties it to the
    /// map.
    pub frame: String,
    /// Position in that frame \[m\].
    pub translation_m: [f64; 3],
    /// Orientation in that frame, unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// Upper triangle, row by row, of the covariance of the position along its axes \[m²\].
    pub position_covariance_m2: [f64; 6],
    /// Standard deviation of the orientation about them \[rad\].
    pub rotation_sd_rad: [f64; 3],
    /// The place cell that answers strongest, if any does.
    pub place: Option<u64>,
    /// Its confidence, in \[0, 1\]; 0 without a place.
    pub confidence: f64,
    /// Samples that are not durable yet, and those that wait for earlier ones.
    pub lag_samples: u64,
    /// Contacts of the episode with an object that is under way; null where there is none.
    pub contacts: Option<u64>,
    /// Whether the latest sample of its session ended it.
    #[serde(default)]
    pub session_ended: bool,
    /// How long before the tick the service received a message of it \[s\]; null before the first
    /// one since the service started.
    #[serde(default)]
    pub heard_ago_s: Option<f64>,
}

/// A sighting that was applied, as the line of sight in `map`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct LiveSighting {
    /// The agent that saw.
    pub agent: String,
    /// Stamp of the sighting \[ns\].
    pub stamp_ns: i64,
    /// Position of the agent in `map` once the sighting was applied \[m\].
    pub from_m: [f64; 3],
    /// Where the target is in `map` by the agent's pose and what was measured \[m\].
    pub to_m: [f64; 3],
    /// What was seen: a landmark or an agent.
    pub target: Target,
}

/// Sizes of a space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct LiveCounts {
    /// Agents.
    pub agents: u64,
    /// Places.
    pub places: u64,
    /// Trips.
    pub trips: u64,
    /// Landmarks.
    pub landmarks: u64,
    /// Objects.
    pub objects: u64,
}

/// How the service keeps up with what is sent to a space. Totals are since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct LiveHealth {
    /// Samples applied in a second, over about the last one; null in the first tick.
    pub samples_per_s: Option<f64>,
    /// Samples that wait for earlier ones, of all agents.
    pub waiting_samples: u64,
    /// Samples that are applied and not durable yet, of all agents.
    pub not_durable_samples: u64,
    /// Messages for the space that were dropped whole.
    pub dropped_messages: u64,
    /// Samples skipped for good.
    pub skipped_samples: u64,
    /// Samples received again.
    pub duplicate_samples: u64,
    /// Memory of the process that is in use \[bytes\]; null where the system does not tell.
    pub resident_bytes: Option<u64>,
}

impl LiveAgent {
    /// The short form of an estimate; what it does not say is 0, none or false.
    pub fn of(estimate: &Estimate) -> Self {
        // Rows of the upper triangle of six begin at 0, 6, 11, 15, 18 and 20.
        let c = &estimate.covariance;
        Self {
            name: estimate.agent.clone(),
            session: estimate.session,
            seq: estimate.seq,
            stamp_ns: estimate.stamp_ns,
            status: estimate.status,
            frame: estimate.frame.clone(),
            translation_m: estimate.translation_m,
            rotation_xyzw: estimate.rotation_xyzw,
            position_covariance_m2: [c[0], c[1], c[2], c[6], c[7], c[11]],
            rotation_sd_rad: [c[15], c[18], c[20]].map(|variance| variance.max(0.0).sqrt()),
            place: estimate.place,
            confidence: estimate.confidence,
            lag_samples: 0,
            contacts: None,
            session_ended: false,
            heard_ago_s: None,
        }
    }
}
