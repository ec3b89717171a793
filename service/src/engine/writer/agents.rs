//! The agents of a space: who is enrolled, who makes room, who is removed.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cogmap_proto::Sample;
use cognitive_map::{AgentId, CognitiveMap, Label, Record};

use super::{AgentSlot, Writer};
use crate::engine::agent_view::AgentView;
use crate::engine::counters::Drop;
use crate::engine::episodes::EndedEpisodes;
use crate::engine::message::{Change, IngestError, RemovalRequest};
use crate::engine::sequencer::{Sequencer, Window};
use crate::engine::shared::Shared;
use crate::engine::trajectory::Recorder;
use crate::journal::Entry;

/// An agent that was heard of within this time makes no room for others: names that come in great
/// numbers cannot drive out a robot that is at work.
const QUIET_MIN: Duration = Duration::from_secs(1);
/// How long a space in which nobody makes room is not searched again.
const FULL_PAUSE: Duration = Duration::from_millis(100);

impl Writer {
    /// Seats the agents of a recovered map.
    pub(super) fn restore_agents(&mut self, recorders: Vec<Recorder>, episodes: EndedEpisodes) {
        let now = Instant::now();
        let (mut recorders, mut episodes) = (recorders.into_iter(), episodes.0.into_iter());
        let known: Vec<_> = { self.map.agents_ever() }
            .map(|(id, agent)| {
                let recorder = recorders.next().unwrap_or_default();
                let name = agent.name().as_str();
                let durable = (agent.session(), agent.next_seq());
                let view = AgentView::new(id, name, self.shared.term, durable, recorder);
                view.put_ended_episode(episodes.next().flatten());
                let sequencer = Sequencer::new(agent.session(), agent.next_seq());
                let latest_ns = agent.stamp_ns().unwrap_or(i64::MIN);
                let slot = AgentSlot::new(view, sequencer, latest_ns, now);
                (slot, agent.is_enrolled())
            })
            .collect();
        for (number, (mut slot, is_enrolled)) in known.into_iter().enumerate() {
            slot.removed = !is_enrolled;
            if !is_enrolled {
                note_removal(&self.shared, &self.map, &mut self.vacant, &slot);
            }
            self.put_slot(number, slot);
        }
    }

    /// Enrols a new agent, unless there are too many.
    pub(super) fn enrol(&mut self, name: &str, now: Instant) -> Option<usize> {
        let label = Label::new(name).ok()?;
        if self.by_name.len() >= self.shared.agents_max && !self.make_room(now) {
            return None;
        }
        let number = self.vacant.pop_first().unwrap_or(self.agents.len());
        let id = AgentId(u32::try_from(number).ok()?);
        self.block.push(&Entry::Enrol {
            agent: id.0,
            name: name.into(),
        });
        self.records.push(Record::Enrol {
            agent: id,
            name: label,
        });
        let view = AgentView::new(id, name, self.shared.term, (0, 0), Recorder::default());
        self.put_slot(
            number,
            AgentSlot::new(view, Sequencer::new(0, 0), i64::MIN, now),
        );
        Some(number)
    }

    /// Puts an agent under a number that is the next one or vacant.
    pub(super) fn put_slot(&mut self, number: usize, slot: AgentSlot) {
        if !slot.removed {
            self.by_name.insert(slot.view.name().into(), number);
            self.shared.add_view(Arc::clone(&slot.view));
        }
        match self.agents.get_mut(number) {
            Some(vacant) => *vacant = slot,
            None => self.agents.push(slot),
        }
    }

    /// Makes room for one more agent: of those that were never in the map, and so have left nothing
    /// there, the one heard of longest ago goes. False where there is none.
    fn make_room(&mut self, now: Instant) -> bool {
        if self.full_until.is_some_and(|until| now < until) {
            return false;
        }
        if self.idlest_without_trace(now).is_some() {
            // What this round has brought may have led agents into the map.
            self.finish_round();
            if self.shared.health.failed().is_none()
                && let Some(slot) = self.idlest_without_trace(now)
            {
                let (space, agent) = (&self.shared.name, self.agents[slot].view.name());
                tracing::debug!(%space, agent, "removed to make room: it was never in the map");
                self.remove(slot);
                self.counters.made_room();
                // The map as it is says that the number will be vacant.
                self.vacant.insert(slot);
                return true;
            }
        }
        self.full_until = Some(now + FULL_PAUSE);
        false
    }

    fn idlest_without_trace(&self, now: Instant) -> Option<usize> {
        let slots = self.agents.iter().enumerate();
        let idle = slots.filter(|(_, slot)| {
            let quiet = now.saturating_duration_since(slot.heard);
            !slot.removed && quiet >= QUIET_MIN && !self.map.has_been_in_map(slot.view.id())
        });
        idle.min_by_key(|(_, slot)| slot.heard)
            .map(|(slot, _)| slot)
    }

    /// Removes an agent that someone wants removed. Whoever waits is answered when that is durable.
    pub(super) fn receive_removal(&mut self, request: RemovalRequest) {
        let RemovalRequest { agent, reply } = request;
        let refusal = self.shared.health.refusal();
        if refusal.is_some() {
            self.counters.dropped(Drop::StoreFailed);
        }
        let unknown = || IngestError::UnknownAgent(agent.to_string());
        let found = self.by_name.get(&agent).copied().ok_or_else(unknown);
        match refusal.map_or(found, Err) {
            Ok(slot) => {
                self.remove(slot);
                self.changes.push(Change::Made(reply));
            }
            Err(refusal) => {
                // Whoever asked may have gone.
                let _ = reply.send(Err(refusal));
            }
        }
    }

    /// Journals that an agent is removed. Its name is free at once.
    fn remove(&mut self, slot: usize) {
        let agent = &mut self.agents[slot];
        agent.removed = true;
        self.by_name.remove(agent.view.name());
        self.shared.remove_view(agent.view.name());
        let abandoned = agent.sequencer.begin(0);
        self.waiting.recount(abandoned, Window::NONE);
        self.counters.abandoned(abandoned.samples);
        let id = agent.view.id();
        self.block.push(&Entry::Remove { agent: id.0 });
        self.records.push(Record::Remove { agent: id });
        self.full_until = None;
    }
}

/// Notes what the map has made of a removed agent: its number is vacant, or it is remembered by
/// name. One whose number has gone to another agent already is neither.
pub(super) fn note_removal(
    shared: &Shared,
    map: &CognitiveMap,
    vacant: &mut std::collections::BTreeSet<usize>,
    slot: &AgentSlot,
) {
    let id = slot.view.id();
    if !slot.removed {
        return;
    }
    if map.is_vacant(id) {
        vacant.insert(id.0 as usize);
    } else {
        shared.note_former(slot.view.name(), id);
    }
}

impl AgentSlot {
    pub(super) fn new(
        view: AgentView,
        sequencer: Sequencer<Sample>,
        latest_ns: i64,
        heard: Instant,
    ) -> Self {
        Self {
            view: Arc::new(view),
            sequencer,
            latest_ns,
            heard,
            removed: false,
            applied: false,
            remind: false,
        }
    }
}
