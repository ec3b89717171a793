//! Trips: the ways the team has gone.

mod leg;
mod map;
mod occurrences;
mod recorder;

pub use crate::memory::ids::TripId;
pub use leg::Leg;
pub(crate) use map::TripMap;
pub(crate) use recorder::{LegUnderWay, Recorder, interval_s};

use crate::input::AgentId;
use crate::memory::ids::PlaceId;
use crate::memory::strength::{Clock, Strength};
use state::{
    Codec, CorruptState, PagedVec, State, StateReader, StateWriter, state_of_enum, state_of_struct,
};

/// Most legs of a trip; a longer way is recorded as several trips. It bounds what one answer holds.
pub(crate) const LEGS_MAX: usize = 1024;
/// Legs per page.
pub(crate) const LEG_PAGE: usize = 16;
/// Most pages of legs of a trip.
pub(crate) const LEG_PAGES_MAX: u32 = 64;
/// Most trips of a space: as many as give every page of legs its own 32-bit number in a checkpoint.
pub(crate) const TRIPS_MAX: u32 = u32::MAX / LEG_PAGES_MAX;

const _: () = assert!(LEG_PAGE * LEG_PAGES_MAX as usize == LEGS_MAX);

/// Why a trip ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TripEnd {
    /// The agent stood still.
    Stillness,
    /// Samples were lost, none came for a long time on the sensor's clock, or the agent turned out
    /// to have been carried off.
    Gap,
    /// The session ended.
    SessionEnd,
    /// A marker said so.
    Marker,
    /// The trip reached the longest allowed number of legs, or trips under way filled the space's
    /// budget of legs; the next one goes on from there.
    Full,
    /// A start pose put the agent elsewhere: no motion leads there.
    StartPose,
}

/// A trip: legs from place to place, as one agent travelled them.
///
/// A trip is recorded when its first leg is complete, so every trip has at least one leg. Motion
/// that reaches no second place before the trip ends leaves no trip.
#[derive(Clone, Debug)]
pub struct Trip {
    agent: AgentId,
    session: u64,
    start_stamp_ns: i64,
    end_stamp_ns: i64,
    ended: Option<TripEnd>,
    length_m: f64,
    pub(crate) strength: Strength,
    legs: PagedVec<Leg, LEG_PAGE>,
}

impl Trip {
    /// A trip of no legs yet.
    pub(crate) fn new(agent: AgentId, session: u64, start_stamp_ns: i64, now: Clock) -> Self {
        Self {
            agent,
            session,
            start_stamp_ns,
            end_stamp_ns: start_stamp_ns,
            ended: None,
            length_m: 0.0,
            strength: Strength::new(now),
            legs: PagedVec::default(),
        }
    }

    /// Appends a leg that ended at `stamp_ns`.
    pub(crate) fn push(&mut self, leg: Leg, stamp_ns: i64, revision: u64) {
        self.length_m += leg.length_m();
        self.end_stamp_ns = stamp_ns;
        self.legs.push(leg, revision);
    }

    /// Ends the trip.
    pub(crate) fn end(&mut self, reason: TripEnd) {
        self.ended = Some(reason);
    }

    /// Whether no more legs fit.
    pub(crate) fn is_full(&self) -> bool {
        self.legs.len() >= LEGS_MAX
    }

    /// The agent that travelled.
    pub fn agent(&self) -> AgentId {
        self.agent
    }

    /// Its session.
    pub fn session(&self) -> u64 {
        self.session
    }

    /// Stamp of the start \[ns\].
    pub fn start_stamp_ns(&self) -> i64 {
        self.start_stamp_ns
    }

    /// Stamp of the latest leg's end \[ns\].
    pub fn end_stamp_ns(&self) -> i64 {
        self.end_stamp_ns
    }

    /// Why it ended; `None` while it goes on.
    pub fn ended(&self) -> Option<TripEnd> {
        self.ended
    }

    /// Length of the path \[m\].
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Number of legs, at least one.
    pub fn leg_count(&self) -> usize {
        self.legs.len()
    }

    /// A leg, counted from 0.
    pub fn leg(&self, index: usize) -> Option<&Leg> {
        self.legs.get(index)
    }

    /// The legs, in the order of travel.
    pub fn legs(&self) -> impl Iterator<Item = &Leg> {
        self.legs.iter()
    }

    /// The places that it leads through: where its first leg begins, then the end of each.
    pub fn places(&self) -> impl Iterator<Item = PlaceId> {
        self.places_from(0)
    }

    /// The places from a position on; 0 is where the first leg begins.
    pub(crate) fn places_from(&self, position: usize) -> impl Iterator<Item = PlaceId> {
        let start = (position == 0).then(|| self.legs.get(0).map(Leg::from));
        let ends = self.legs.iter_from(position.saturating_sub(1));
        start.flatten().into_iter().chain(ends.map(Leg::to))
    }

    /// Appends a checkpoint's page of legs.
    pub(crate) fn push_leg_page(
        &mut self,
        bytes: &[u8],
        revision: u64,
    ) -> Result<(), CorruptState> {
        if self.is_full() {
            return Err(CorruptState::Invalid);
        }
        self.legs.push_page(bytes, revision)
    }
}

state_of_struct!(Trip {
    agent,
    session,
    start_stamp_ns,
    end_stamp_ns,
    ended,
    length_m,
    strength,
    legs as LegDigests
});

/// Digests of legs, which are stored page by page beside their trip.
struct LegDigests;

impl Codec<PagedVec<Leg, LEG_PAGE>> for LegDigests {
    fn write(legs: &PagedVec<Leg, LEG_PAGE>, out: &mut StateWriter) {
        legs.write_digests(out);
    }

    /// The digests are passed over: the map's digest is compared in the end.
    fn read(input: &mut StateReader<'_>) -> Result<PagedVec<Leg, LEG_PAGE>, CorruptState> {
        let legs = usize::try_from(u64::read(input)?).unwrap_or(usize::MAX);
        if !(1..=LEGS_MAX).contains(&legs) {
            return Err(CorruptState::Invalid);
        }
        for _ in 0..legs.div_ceil(LEG_PAGE) {
            u128::read(input)?;
        }
        Ok(PagedVec::default())
    }
}

state_of_enum!(TripEnd {
    Stillness = 0,
    Gap = 1,
    SessionEnd = 2,
    Marker = 3,
    Full = 4,
    StartPose = 5
});
