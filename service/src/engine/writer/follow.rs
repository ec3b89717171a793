//! Following: the map of a space that another process writes, folded as its journal grows.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use cognitive_map::{AgentId, Record};

use super::{AgentSlot, Writer};
use crate::decode::records_of;
use crate::engine::agent_view::AgentView;
use crate::engine::queue::Inbox;
use crate::engine::recovery::RecoveryError;
use crate::engine::sequencer::Sequencer;
use crate::engine::trajectory::Recorder;
use crate::journal::entries;
use crate::store::StoreError;

/// How often is looked whether the journal has grown.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);
/// How long it is read at each look after it has grown: the store tells that a moment before what
/// has come can be read.
const SETTLES: Duration = Duration::from_millis(100);
/// How often it is read in any case, should that moment have been a long one.
const READ_INTERVAL: Duration = Duration::from_secs(1);

impl Writer {
    /// Folds what comes into the journal until the space closes.
    ///
    /// # Errors
    /// The journal cannot be read on.
    pub(crate) fn follow(mut self, mut inbox: Inbox) -> Result<(), RecoveryError> {
        self.publish_initial();
        let (mut progress, mut changed, mut read) = (None, Instant::now(), None);
        while !self.shared.closing.load(Ordering::Acquire) {
            let looked = Instant::now();
            let now = Some(self.shared.store.progress());
            if now != progress {
                (progress, changed) = (now, looked);
            }
            let is_due = |read: Instant| looked.saturating_duration_since(read) >= READ_INTERVAL;
            if looked < changed + SETTLES || read.is_none_or(is_due) {
                read = self.read_on_if_reachable()?.then_some(looked);
            }
            if read.is_some() {
                self.shared.note_caught_up(looked);
            }
            self.shared.serve_snapshots(&self.map);
            inbox.wait(LOOK_INTERVAL);
            // Nobody sends anything here; whoever does learns that nobody takes it.
            while inbox.next().is_some() {}
        }
        self.counters.gone();
        Ok(())
    }

    /// Folds the blocks that have come, unless the storage is away: what is known grows old then.
    fn read_on_if_reachable(&mut self) -> Result<bool, RecoveryError> {
        match self.read_on() {
            Ok(()) => Ok(true),
            Err(RecoveryError::Store(StoreError::Unreachable(error))) => {
                tracing::debug!(space = %self.shared.name, error, "follow the journal");
                Ok(false)
            }
            Err(error) => Err(error),
        }
    }

    /// Folds the blocks that have come.
    fn read_on(&mut self) -> Result<(), RecoveryError> {
        let store = std::sync::Arc::clone(&self.shared.store);
        for block in store.journal(self.shared.number, self.next_block) {
            let (number, bytes) = block?;
            if number != self.next_block {
                return Err(RecoveryError::MissingBlock(self.next_block));
            }
            let of_block = |error| RecoveryError::Block {
                block: number,
                error,
            };
            for entry in &entries(&bytes).map_err(of_block)? {
                records_of(entry, |record| self.records.push(record));
            }
            self.seat();
            self.next_block += 1;
            self.apply();
            self.records.clear();
            self.publish();
        }
        Ok(())
    }

    /// Seats those who enrol in the records, and lets those go who are removed, as the writer does
    /// before it applies them.
    fn seat(&mut self) {
        let records = std::mem::take(&mut self.records);
        for record in &records {
            match record {
                Record::Enrol { agent, name } => self.seat_agent(*agent, name.as_str()),
                Record::Remove { agent } => {
                    let slot = &mut self.agents[agent.0 as usize];
                    slot.removed = true;
                    self.by_name.remove(slot.view.name());
                    self.shared.remove_view(slot.view.name());
                }
                _ => {}
            }
        }
        self.records = records;
    }

    fn seat_agent(&mut self, id: AgentId, name: &str) {
        let number = id.0 as usize;
        self.vacant.remove(&number);
        let view = AgentView::new(id, name, self.shared.term, (0, 0), Recorder::default());
        let slot = AgentSlot::new(view, Sequencer::new(0, 0), i64::MIN, Instant::now());
        self.put_slot(number, slot);
    }
}
