//! What waits to be published: agents of whom something is due, and events.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use cogmap_proto::EventRecord;
use metrics::{Counter, counter};

use crate::engine::{AgentView, Messages};
use crate::metrics::UNPUBLISHED_EVENTS;

/// Most events that wait; further ones are dropped and counted.
const EVENTS_MAX: usize = 4096;

/// Where the engine leaves word and the publisher finds it. Of an agent nothing waits but that
/// something is due, however often it changes; so the board holds as many notices as there are
/// agents, and a bounded number of events.
pub(super) struct Board {
    notices: Mutex<Notices>,
    bell: Condvar,
    unpublished: Counter,
}

#[derive(Default)]
struct Notices {
    agents: Vec<Notice>,
    events: VecDeque<Arc<EventRecord>>,
    publisher_sleeps: bool,
    closed: bool,
}

/// Something to publish.
#[derive(Debug)]
pub(super) enum Notice {
    /// Something is due of this agent of the space.
    Agent(Arc<str>, Arc<AgentView>),
    /// An event.
    Event(Arc<EventRecord>),
}

impl Default for Board {
    fn default() -> Self {
        Self {
            notices: Mutex::default(),
            bell: Condvar::new(),
            unpublished: counter!(UNPUBLISHED_EVENTS),
        }
    }
}

impl std::fmt::Debug for Board {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Board").finish_non_exhaustive()
    }
}

impl Board {
    /// Makes messages of an agent due.
    pub(super) fn agent(&self, space: &Arc<str>, agent: &Arc<AgentView>, messages: Messages) {
        if agent.make_due(messages) {
            let mut notices = self.lock();
            notices
                .agents
                .push(Notice::Agent(Arc::clone(space), Arc::clone(agent)));
            self.ring(notices);
        }
    }

    /// Leaves an event, or counts that there was no room for it.
    pub(super) fn event(&self, event: &Arc<EventRecord>) {
        let mut notices = self.lock();
        if notices.events.len() >= EVENTS_MAX {
            return self.unpublished.increment(1);
        }
        notices.events.push_back(Arc::clone(event));
        self.ring(notices);
    }

    /// Lets the publisher end once it has published what is there.
    pub(super) fn close(&self) {
        let mut notices = self.lock();
        notices.closed = true;
        self.ring(notices);
    }

    /// Waits for something to publish and moves it to `taken`, events first. False when there is
    /// nothing and will be nothing.
    pub(super) fn wait(&self, taken: &mut Vec<Notice>) -> bool {
        let mut notices = self.lock();
        while notices.is_empty() {
            if notices.closed {
                return false;
            }
            notices.publisher_sleeps = true;
            notices = self
                .bell
                .wait(notices)
                .unwrap_or_else(PoisonError::into_inner);
            notices.publisher_sleeps = false;
        }
        taken.extend(notices.events.drain(..).map(Notice::Event));
        taken.append(&mut notices.agents);
        true
    }

    // A panic while the lock is held cannot leave half a change behind.
    fn lock(&self) -> MutexGuard<'_, Notices> {
        self.notices.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes the publisher if it sleeps, once.
    fn ring(&self, mut notices: MutexGuard<'_, Notices>) {
        let sleeps = std::mem::take(&mut notices.publisher_sleeps);
        drop(notices);
        if sleeps {
            self.bell.notify_one();
        }
    }
}

impl Notices {
    fn is_empty(&self) -> bool {
        self.agents.is_empty() && self.events.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::view_of;

    #[test]
    fn what_changes_often_is_due_once() {
        let (board, space, view) = (Board::default(), "lab".into(), Arc::new(view_of("ada")));
        for _ in 0..100_000 {
            board.agent(&space, &view, Messages::ESTIMATE);
            board.agent(&space, &view, Messages::WATERMARK);
        }
        let mut taken = Vec::new();
        assert!(board.wait(&mut taken));
        assert_eq!(taken.len(), 1);
        assert_eq!(view.take_due(Messages::BOTH), Messages::BOTH);
        board.agent(&space, &view, Messages::WATERMARK);
        assert!(board.wait(&mut taken));
        assert_eq!(
            (taken.len(), view.take_due(Messages::BOTH)),
            (2, Messages::WATERMARK)
        );
        board.close();
        assert!(!board.wait(&mut taken));
    }

    #[test]
    fn events_that_nobody_takes_are_bounded() {
        let board = Board::default();
        let event = cogmap_proto::Event {
            space: "lab".to_owned(),
            agent: "ada".to_owned(),
            map_revision: 1,
            stamp_ns: 0,
            kind: cogmap_proto::EventKind::AgentEnrolled {},
        };
        let id = cogmap_proto::EventId {
            revision: 1,
            index: 0,
        };
        let event = Arc::new(EventRecord { id, event });
        for _ in 0..2 * EVENTS_MAX {
            board.event(&event);
        }
        let mut taken = Vec::new();
        assert!(board.wait(&mut taken));
        assert_eq!(taken.len(), EVENTS_MAX);
    }
}
