//! The cognitive map of a space: everything that is derived from its journal.

mod apply;
mod checkpoint;
mod effects;
mod enrolment;
mod felt;
mod following;
mod forgetting;
mod guidance;
mod header;
mod headings;
mod levels;
mod localization;
mod motion;
mod objects;
mod percepts;
mod prediction;
mod queries;
mod remembrance;
mod sequence;
mod sightings;
mod tuning;
mod ways;

use std::collections::BTreeMap;
use std::sync::Arc;

pub use checkpoint::{CheckpointPage, CorruptCheckpoint};
pub use felt::{Felt, FeltCue, FeltPlace, Looked};
pub use localization::Localization;
pub use prediction::{Predicted, Prediction};

use crate::agent::Agent;
use crate::estimator::{Estimator, Parameters};
use crate::event::Event;
use crate::guidance::Guidance;
use crate::input::Label;
use crate::input::{AgentId, Record, SkipReason};
use crate::keyframes::{KeyframeMap, KeyframeSettings};
use crate::memory::landmark::LandmarkMap;
use crate::memory::object::ObjectMemory;
use crate::memory::percept::PerceptMap;
use crate::memory::place::PlaceMap;
use crate::memory::strength::Clock;
use crate::memory::trip::TripMap;
use crate::memory::way::WayMap;
use crate::settings::Settings;
use grid::GridModules;
use state::PagedVec;

use apply::Fold;

/// Agents per page: few, because the agents change with every sample.
const AGENT_PAGE: usize = 4;

/// The cognitive map of a space, a fold over its journal: [`CognitiveMap::apply`] is the only way
/// to change it, and the same records in the same order give the same map, bit by bit.
///
/// A clone is a snapshot. It shares all memory with the original and stays as it is while the
/// original goes on; the original then copies the pages that it changes.
#[derive(Clone, Debug)]
pub struct CognitiveMap {
    settings: Arc<Settings>,
    modules: Arc<GridModules>,
    /// Number of records that had an effect.
    revision: u64,
    /// Whether some agent has defined the `map` frame. The estimator cannot tell: its frame of the
    /// map is empty again once all agents in it were set aside, and a start pose without bounds
    /// passes through it without defining anything.
    is_map_defined: bool,
    agents: PagedVec<Agent, AGENT_PAGE>,
    /// The agents by name.
    names: Arc<BTreeMap<Label, AgentId>>,
    /// Where agents and the landmarks seen lately are, jointly.
    estimator: Arc<Estimator>,
    /// What they did and saw, so that the past can be smoothed.
    keyframes: Arc<KeyframeMap>,
    pub(crate) places: PlaceMap,
    trips: TripMap,
    pub(crate) ways: WayMap,
    landmarks: LandmarkMap,
    percepts: PerceptMap,
    objects: ObjectMemory,
    /// Blockages, and the routes that agents follow.
    guidance: Arc<Guidance>,
}

impl CognitiveMap {
    /// The map of a space where nothing has happened yet.
    pub fn new(settings: Settings) -> Self {
        Self {
            modules: Arc::new(GridModules::new(&settings.grid())),
            places: PlaceMap::new(&settings),
            estimator: Arc::new(Estimator::new(Parameters::of(&settings))),
            keyframes: Arc::new(KeyframeMap::new(KeyframeSettings::of(&settings))),
            objects: ObjectMemory::new(settings.object_answer_probability),
            names: Arc::default(),
            settings: Arc::new(settings),
            revision: 0,
            is_map_defined: false,
            agents: PagedVec::default(),
            trips: TripMap::default(),
            ways: WayMap::default(),
            landmarks: LandmarkMap::default(),
            percepts: PerceptMap::default(),
            guidance: Arc::default(),
        }
    }

    /// Applies the next record of the journal, and appends to `events` what it brought about.
    ///
    /// Every record is legal. One that says nothing new has no effect at all: the enrolment of an
    /// agent that is there (or is neither next in line nor vacant, or has another one's name), the
    /// removal of one that is not, a place or a way that is there already, a lesson or an
    /// instruction that is not next in line, a sample of an unknown or removed agent, of an earlier
    /// session, or with a sequence number that has been applied or skipped. A sample whose number
    /// is ahead first skips the missing ones as [`SkipReason::Lost`]. Work and memory per sample
    /// are bounded, whatever the size of the map; one by which an agent leaves the route that it
    /// follows takes a search among the ways.
    pub fn apply(&mut self, record: &Record, events: &mut Vec<Event>) {
        match record {
            Record::Enrol { agent, name } => self.enrol(*agent, name, events),
            Record::Remove { agent } => {
                self.remove(*agent, events);
                self.stop_following(*agent);
            }
            Record::Instruct {
                number,
                instruction,
            } => self.instruct(*number, instruction, events),
            Record::Sample {
                agent,
                session,
                seq,
                sample,
            } => {
                // The last number of all has no successor, so it is never a sample's.
                let Some(next_seq) = seq.checked_add(1) else {
                    return;
                };
                let Some(mut fold) = self.fold(*agent, *session, next_seq, events) else {
                    return;
                };
                fold.drop_forgotten();
                fold.enter_session(*session, Some(sample.stamp_ns));
                fold.skip(*seq, SkipReason::Lost);
                fold.end_blockages_by(sample.stamp_ns);
                fold.sample(*seq, sample);
                fold.finish();
                self.go_along(*agent, events);
            }
            Record::Skip {
                agent,
                session,
                from,
                to,
                reason,
            } => {
                if from >= to {
                    return;
                }
                let Some(mut fold) = self.fold(*agent, *session, *to, events) else {
                    return;
                };
                fold.drop_forgotten();
                fold.enter_session(*session, None);
                fold.skip(*from, SkipReason::Lost);
                fold.skip(*to, *reason);
                fold.finish();
            }
            Record::Remember(remembrance) => self.remember(remembrance),
            Record::TeachObject {
                number,
                name,
                lesson,
            } => {
                if self.objects.awaits(*number) {
                    self.revision += 1;
                    let now = Clock::at(self.revision, &self.settings);
                    self.objects.teach(name, lesson, now, self.revision);
                }
            }
            Record::ForgetObject { number, name } => {
                if self.objects.awaits(*number) {
                    self.revision += 1;
                    self.objects.forget(name, self.revision);
                }
            }
        }
    }

    /// Opens the map for the samples up to and without `to` of an agent, if they hold news.
    fn fold<'a>(
        &'a mut self,
        agent_id: AgentId,
        session: u64,
        to: u64,
        events: &'a mut Vec<Event>,
    ) -> Option<Fold<'a>> {
        if !self.agents.get(agent_id.0 as usize)?.awaits(session, to) {
            return None;
        }
        self.open(agent_id, events)
    }

    /// Opens the map for a record of an agent that has an effect.
    fn open<'a>(&'a mut self, agent_id: AgentId, events: &'a mut Vec<Event>) -> Option<Fold<'a>> {
        let index = agent_id.0 as usize;
        self.agents.get(index)?;
        self.revision += 1;
        let agent = self.agents.get_mut(index, self.revision)?;
        let keyframes = Arc::make_mut(&mut self.keyframes);
        keyframes.set_revision(self.revision);
        Some(Fold {
            settings: &self.settings,
            modules: &self.modules,
            revision: self.revision,
            now: Clock::at(self.revision, &self.settings),
            is_map_defined: &mut self.is_map_defined,
            places: &mut self.places,
            trips: &mut self.trips,
            ways: &mut self.ways,
            landmarks: &mut self.landmarks,
            estimator: Arc::make_mut(&mut self.estimator),
            effects: Vec::new(),
            keyframes,
            names: &self.names,
            percepts: &mut self.percepts,
            objects: &mut self.objects,
            guidance: &mut self.guidance,
            agent_id,
            held: agent.holds(),
            stamp_ns: agent.stamp_ns.unwrap_or(0),
            agent,
            events,
        })
    }
}
