//! Estimates, watermarks and events out.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};

use cogmap_proto::{Codec, Event, durable_key, estimate_key, events_key};
use serde::Serialize;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

use super::board::{Board, Notice};
use crate::engine::{AgentDesk, Messages, Outlet};

/// Nobody else's messages have this priority, so what others send never stands before these in the
/// queue of a link. One for all three: a link keeps the order of messages of one priority, and
/// clients rely upon an estimate before the watermark that covers its samples.
const PRIORITY: Priority = Priority::InteractiveHigh;

/// Publishes over Zenoh, on a thread of its own. What a congested link cannot take is dropped: the
/// next estimate supersedes it, and a client that misses a watermark asks for it.
#[derive(Debug)]
pub struct ZenohOutlet {
    board: Arc<Board>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl ZenohOutlet {
    /// Publishes in `codec`.
    ///
    /// # Panics
    /// The system cannot start a thread.
    pub fn new(session: Session, codec: Codec) -> Self {
        let board = Arc::new(Board::default());
        let publisher = Publisher { session, codec };
        let thread = {
            let board = Arc::clone(&board);
            Builder::new()
                .name("publisher".into())
                .spawn(move || publisher.run(&board))
                .expect("the system can start a thread")
        };
        Self {
            board,
            thread: Mutex::new(Some(thread)),
        }
    }

    /// Publishes what is due and ends; what comes later is not published.
    pub fn close(&self) {
        self.board.close();
        let mut thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        let thread = thread.take();
        if thread.is_some_and(|thread| thread.join().is_err()) {
            tracing::error!("the publisher ended with a panic");
        }
    }
}

impl Drop for ZenohOutlet {
    fn drop(&mut self) {
        self.board.close();
    }
}

impl Outlet for ZenohOutlet {
    fn estimate(&self, space: &Arc<str>, agent: &Arc<AgentDesk>) {
        self.board.agent(space, agent, Messages::ESTIMATE);
    }

    fn watermark(&self, space: &Arc<str>, agent: &Arc<AgentDesk>) {
        self.board.agent(space, agent, Messages::WATERMARK);
    }

    fn event(&self, event: &Arc<Event>) {
        self.board.event(event);
    }
}

/// The thread's state.
struct Publisher {
    session: Session,
    codec: Codec,
}

impl Publisher {
    fn run(&self, board: &Board) {
        let mut notices = Vec::new();
        while board.wait(&mut notices) {
            for notice in notices.drain(..) {
                match notice {
                    Notice::Event(event) => self.put(events_key(&event.space), &*event),
                    Notice::Agent(space, agent) => self.agent(&space, &agent),
                }
            }
        }
    }

    /// Publishes what is due of an agent, the estimate first. The watermark is read before the
    /// estimate, which therefore covers at least the same samples.
    fn agent(&self, space: &str, agent: &AgentDesk) {
        let due = agent.take_due(Messages::BOTH);
        let watermark = due.contain(Messages::WATERMARK).then(|| agent.watermark());
        // One that became due since may cover samples of this watermark.
        let estimate = due.contain(Messages::ESTIMATE)
            || (watermark.is_some()
                && agent
                    .take_due(Messages::ESTIMATE)
                    .contain(Messages::ESTIMATE));
        if estimate {
            let name = agent.name();
            agent.read_estimate(|estimate| self.put(estimate_key(space, name), estimate));
        }
        if let Some(watermark) = watermark {
            self.put(durable_key(space, agent.name()), &watermark);
        }
    }

    fn put<T: Serialize>(&self, key: String, message: &T) {
        let put = self
            .session
            .put(key, self.codec.encode(message))
            .encoding(self.codec.encoding())
            .congestion_control(CongestionControl::Drop)
            .priority(PRIORITY)
            .wait();
        if let Err(error) = put {
            tracing::debug!(%error, "publish");
        }
    }
}
