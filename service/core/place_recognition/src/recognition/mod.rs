//! Place recognition as a whole: all that is remembered of what was seen.

mod bytes;
mod kidnap;
mod relocalise;
mod revisit;

pub use bytes::Part;
pub use relocalise::{Guess, Relocalised};
pub use revisit::Revisit;

use crate::relocalisation::{KidnapTests, Searches};
use crate::sequences::ViewMemory;
use crate::similarity::ViewLog;
use crate::tracking::{Tracked, Tracker, ViewMap};
use crate::tuning::tracking::{AGENTS_MAX, IDLE_RECORDS};
use crate::view::{SensedTurn, View};
use crate::waking::{Found, Waking};
use state::PagedVec;

/// What agents have seen, and the searches of those that do not know where they are.
///
/// It never changes anybody's pose: its answers are values. A clone shares all pages.
#[derive(Clone, Debug)]
pub struct PlaceRecognition {
    /// The revision under which changes are noted; for checkpoints only.
    revision: u64,
    views: ViewMemory,
    /// What agents that do not know where they are have seen since.
    searches: Searches,
    /// Whether what agents of the map see contradicts where they are believed to be.
    kidnap_tests: KidnapTests,
    /// Mean views of cells, and the filters of agents that search among them.
    waking: Waking,
    /// The particles of agents that know about where they are.
    trackers: PagedVec<Tracker, 1>,
}

impl Default for PlaceRecognition {
    /// Without any view, at revision 1: a checkpoint since revision 0 holds everything.
    fn default() -> Self {
        Self {
            revision: 1,
            views: ViewMemory::default(),
            searches: Searches::default(),
            kidnap_tests: KidnapTests::default(),
            waking: Waking::default(),
            trackers: PagedVec::default(),
        }
    }
}

impl PlaceRecognition {
    /// Says under which revision changes are noted from now on: a checkpoint since a revision holds
    /// the later ones.
    pub fn set_revision(&mut self, revision: u64) {
        self.revision = revision;
    }

    /// An agent was put somewhere else: what it sees from now on is not beside what it saw.
    pub fn cut(&mut self, agent: u32) {
        self.views.cut(agent, self.revision);
        self.end_tracking(agent);
    }

    /// All that agents of the map saw.
    pub fn views(&self) -> &ViewLog {
        &self.views.log
    }

    /// The number of the channel of a view, if anything was seen on it before.
    pub fn channel_of(&self, view: &View<'_>) -> Option<u8> {
        self.views.known_channel(view)
    }

    /// The channels of views: number, name, numbers of a view, and how many of its views are
    /// logged.
    pub fn channels(&self) -> impl Iterator<Item = (u8, &str, u16, usize)> {
        (0..).zip(&self.views.channels).map(|(number, channel)| {
            let logged = self.views.log.views.iter();
            let n_logged = logged.filter(|view| view.channel == number).count();
            (number, &*channel.name, channel.dimension, n_logged)
        })
    }

    /// All that agents of the map saw, if enough of it is new to be matched again; it counts as
    /// matched from then on.
    pub fn take_due_views(&mut self) -> Option<ViewLog> {
        if !self.views.log.is_due() {
            return None;
        }
        let due = self.views.log.clone();
        self.views.log.matched();
        Some(due)
    }

    /// Where an agent that knows about where it is, at a view that was remembered last, is among
    /// those of maps; `None` if they do not say. `stamp_ns` is that of the sample.
    pub fn track<'a>(
        &mut self,
        view: &View<'_>,
        stamp_ns: i64,
        mut maps: impl Iterator<Item = &'a ViewMap>,
    ) -> Option<Tracked> {
        let logged = self.views.taken.take();
        let logged = logged.filter(|logged| logged.sample == view.sample)?;
        let map = maps.find(|map| map.channel() == logged.channel)?;
        let revision = self.revision;
        let number = self.tracker_of(view.sample.agent)?;
        let is_same =
            { self.trackers.get(number) }.is_some_and(|tracker| tracker.is_of(view.sample));
        if !is_same {
            let tracker = Tracker::new(view, stamp_ns);
            match self.trackers.get_mut(number, revision) {
                Some(slot) => *slot = tracker,
                None => self.trackers.push(tracker, revision),
            }
        }
        let tracker = self.trackers.get_mut(number, revision)?;
        tracker.used = revision;
        tracker.step(view, stamp_ns, &logged, map)
    }

    /// The number of an agent's tracker, or of one in whose place it comes; `None` where all are
    /// in use.
    fn tracker_of(&self, agent: u32) -> Option<usize> {
        let own = { self.trackers.iter() }.position(|one| one.agent == agent);
        let new = (self.trackers.len() < AGENTS_MAX).then_some(self.trackers.len());
        own.or(new).or_else(|| {
            let is_idle = |one: &Tracker| self.revision.saturating_sub(one.used) > IDLE_RECORDS;
            self.trackers.iter().position(is_idle)
        })
    }

    /// Ends the tracking of an agent: it begins anew about its estimate.
    pub fn end_tracking(&mut self, agent: u32) {
        let own = { self.trackers.iter() }.position(|one| one.agent == agent);
        if let Some(tracker) = own.and_then(|own| self.trackers.get_mut(own, self.revision)) {
            tracker.restart();
        }
    }

    /// Views so far of an agent that is tracked which fit where it was.
    pub fn fitting_views(&self, agent: u32) -> u64 {
        let own = { self.trackers.iter() }.find(|one| one.agent == agent);
        own.map_or(0, |tracker| tracker.fitting)
    }

    /// Whether what later views are compared with is of a channel that is there.
    pub fn is_view_map(&self, map: &ViewMap) -> bool {
        map.is_sound(self.views.logged_length(map.channel()))
    }

    /// Bytes of memory that the views take.
    pub fn bytes(&self) -> usize {
        let particles: usize = self.trackers.iter().map(Tracker::bytes).sum();
        self.views.bytes() + self.waking.bytes() + self.trackers.bytes() + particles
    }

    /// Learns from the view of an agent that knows where it is what views say of cells. `turn` is
    /// that of its odometry in the map by other senses.
    pub fn teach_cells(&mut self, view: &View<'_>, turn: Option<SensedTurn>) {
        self.waking.teach(view, turn, self.revision);
    }

    /// A view of an agent that does not know where it is; answers the pose among the cells of the
    /// map, once that is sure. `turn` is as for [`teach_cells`](Self::teach_cells).
    pub fn wake(&mut self, view: &View<'_>, turn: Option<SensedTurn>) -> Option<Found> {
        self.waking.seek(view, turn, self.revision)
    }

    /// Whether agents that do not know where they are are sought among the cells by these views.
    pub fn is_sought_among_cells(&self, view: &View<'_>) -> bool {
        self.waking.is_sought_by(view)
    }

    /// Whether an agent that was found among the cells is still followed there.
    pub fn is_waking(&self, agent: u32, session: u32) -> bool {
        self.waking.is_following(agent, session)
    }

    /// Ends the search of an agent among the cells.
    pub fn end_waking(&mut self, agent: u32) {
        self.waking.end(agent, self.revision);
    }
}
