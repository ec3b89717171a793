//! Agents: who samples the space, and where each of them is.

mod announced;
mod membership;
mod status;

use nalgebra::{Isometry3, Point3};

pub(crate) use announced::Announced;
pub(crate) use membership::Membership;
pub use status::Status;

use crate::estimator::Evidence;
use crate::input::Label;
use crate::memory::object::Episode;
use crate::memory::place::PlaceId;
use crate::memory::trip::{LegUnderWay, Recorder, TripId};
use grid::{GridModules, GridState, octant};
use place_filter::PlaceFilter;
use state::state_of_struct;

/// An agent of a space.
///
/// The first agent that moves or sees a landmark in an empty map defines the `map` frame: it starts
/// at identity. Any later agent is *unplaced* until a start pose says where it is, or until
/// enough landmarks and sightings of agents tie it to the map: its pose still counts from identity,
/// and nothing that it does changes what places, trips and landmarks the map knows.
#[derive(Clone, Debug)]
pub struct Agent {
    pub(crate) name: Label,
    pub(crate) membership: Membership,
    /// `None` before the first session.
    pub(crate) session: Option<u64>,
    /// Whether its latest sample ended the session.
    pub(crate) session_ended: bool,
    pub(crate) next_seq: u64,
    pub(crate) stamp_ns: Option<i64>,
    pub(crate) announced: Announced,
    /// Where the places were last asked who answers; `None` asks at the next motion.
    pub(crate) asked_at: Option<Point3<f64>>,
    /// Where and since when \[ns\] the agent has stayed within an eighth of a field radius.
    pub(crate) still_since: Option<(Point3<f64>, i64)>,
    /// The place that answered, and its confidence.
    pub(crate) place: Option<(PlaceId, f64)>,
    /// The place entered last; `None` once no place answers any more. It may have been forgotten.
    pub(crate) entered: Option<PlaceId>,
    pub(crate) recorder: Recorder,
    /// The first place of the session. It may have been forgotten.
    pub(crate) home: Option<PlaceId>,
    pub(crate) sightings: u64,
    pub(crate) percepts: u64,
    /// The episode with an object that is under way.
    pub(crate) episode: Option<Episode>,
    pub(crate) forgotten_matches: u64,
    /// What it sensed lately, and what that says of where it is.
    pub(crate) filter: PlaceFilter,
}

state_of_struct!(Agent {
    name,
    membership,
    session,
    session_ended,
    next_seq,
    stamp_ns,
    announced,
    asked_at,
    still_since,
    place,
    entered,
    recorder,
    home,
    sightings,
    percepts,
    episode,
    forgotten_matches,
    filter,
});

impl Agent {
    /// A new agent.
    pub(crate) fn new(name: Label, modules: &GridModules) -> Self {
        Self {
            name,
            membership: Membership::Enrolled,
            session: None,
            session_ended: false,
            next_seq: 0,
            stamp_ns: None,
            announced: Announced::new(modules),
            asked_at: None,
            still_since: None,
            place: None,
            entered: None,
            recorder: Recorder::default(),
            home: None,
            sightings: 0,
            percepts: 0,
            episode: None,
            forgotten_matches: 0,
            filter: PlaceFilter::default(),
        }
    }

    /// Whether the sample numbers up to and without `to` of a session hold news.
    pub(crate) fn awaits(&self, session: u64, to: u64) -> bool {
        self.is_enrolled()
            && self
                .session
                .is_none_or(|own| session > own || (session == own && to > self.next_seq))
    }

    /// The places that must not be forgotten: the one that answers here, and the one that the leg
    /// under way started from.
    pub(crate) fn holds(&self) -> [Option<PlaceId>; 2] {
        let leg = self.recorder.leg.as_ref();
        [
            self.place.map(|(place, _)| place),
            leg.map(LegUnderWay::from),
        ]
    }

    /// Whether it belongs to the space: it has not been removed.
    pub fn is_enrolled(&self) -> bool {
        self.membership == Membership::Enrolled
    }

    /// Name; of one that has been removed the name that it had.
    pub fn name(&self) -> &Label {
        &self.name
    }

    /// Current session; 0 before the first one.
    pub fn session(&self) -> u64 {
        self.session.unwrap_or(0)
    }

    /// Whether the session's latest sample said that it has ended.
    pub fn session_ended(&self) -> bool {
        self.session_ended
    }

    /// Every sample of the session below this number has been applied or skipped.
    pub fn next_seq(&self) -> u64 {
        self.next_seq
    }

    /// Stamp of the session's latest sample \[ns\].
    pub fn stamp_ns(&self) -> Option<i64> {
        self.stamp_ns
    }

    /// Whether it is known where the agent is in `map`.
    pub fn placed(&self) -> bool {
        self.announced.placed()
    }

    /// Contacts of the episode with an object that is under way; `None` where there is none.
    pub fn episode_contacts(&self) -> Option<u64> {
        self.episode.as_ref().map(Episode::count)
    }

    /// Pose in `map`; counted from identity while the agent is not placed.
    pub fn pose(&self) -> &Isometry3<f64> {
        &self.announced.in_map
    }

    /// Pose in `odom`: by motion alone since the session began.
    pub fn odometry(&self) -> &Isometry3<f64> {
        &self.announced.in_odom
    }

    /// What became of its sightings, of all sessions.
    pub fn evidence(&self) -> &Evidence {
        self.announced.evidence()
    }

    /// The place cell that answers strongest, with its confidence in \[0, 1\], as of the last time
    /// that the places were asked: less than an eighth of a field radius ago.
    pub fn place(&self) -> Option<(PlaceId, f64)> {
        self.place
    }

    /// Grid state.
    pub fn grid(&self) -> &GridState {
        &self.announced.grid
    }

    /// Length of the session's latest movement \[m\] (seed Eq. 2); 0 before the first one.
    pub fn displacement_m(&self) -> f64 {
        self.announced.latest.map_or(0.0, |latest| latest.norm())
    }

    /// Octant of the session's latest movement in `map`, 1 to 8.
    pub fn octant(&self) -> Option<u8> {
        self.announced
            .latest
            .map(|latest| octant::octant_of(&latest))
    }

    /// Angle between the session's latest two movements \[rad\], in \[0, π\] (seed Eq. 3); 0 before
    /// the second one.
    pub fn turning_rad(&self) -> f64 {
        let movements = self.announced.before_latest.zip(self.announced.latest);
        movements.map_or(0.0, |(before, latest)| {
            octant::turning_angle_rad(&before, &latest)
        })
    }

    /// Path travelled in this session \[m\].
    pub fn travelled_m(&self) -> f64 {
        self.announced.travelled_m
    }

    /// The trip under way, once its first leg is complete.
    pub fn trip(&self) -> Option<TripId> {
        self.recorder.trip
    }

    /// Sightings so far, of all sessions. Those of landmarks and of agents correct poses and map.
    pub fn sightings(&self) -> u64 {
        self.sightings
    }

    /// Levels and descriptors so far, of all sessions. Those sensed where a place answers teach it;
    /// the others are counted and stay in the journal.
    pub fn percepts(&self) -> u64 {
        self.percepts
    }

    /// Matches so far whose earlier sample was not, or no longer, remembered, of all sessions. They
    /// are dropped.
    pub fn forgotten_matches(&self) -> u64 {
        self.forgotten_matches
    }
}
