//! What the engine tells, to the thread that publishes it.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};

use cogmap_proto::{Codec, EventRecord};
use zenoh::Session;

use super::board::Board;
use super::publishing::PublishingThread;
use super::session::TransportError;
use crate::engine::{AgentView, Messages, Publisher};

/// Publishes over Zenoh, on a thread of its own. What a congested link cannot take is dropped: the
/// next estimate supersedes it, and a client that misses a watermark asks for it.
#[derive(Debug)]
pub struct ZenohPublisher {
    board: Arc<Board>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl ZenohPublisher {
    /// Publishes in `codec`.
    ///
    /// # Errors
    /// The declarations fail.
    ///
    /// # Panics
    /// The system cannot start a thread.
    pub async fn declare(session: Session, codec: Codec) -> Result<Self, TransportError> {
        let publisher = PublishingThread::declare(session, codec).await?;
        let board = Arc::new(Board::default());
        let thread = {
            let board = Arc::clone(&board);
            Builder::new()
                .name("publisher".into())
                .spawn(move || publisher.run(&board))
                .expect("the system can start a thread")
        };
        Ok(Self {
            board,
            thread: Mutex::new(Some(thread)),
        })
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

impl Drop for ZenohPublisher {
    fn drop(&mut self) {
        self.board.close();
    }
}

impl Publisher for ZenohPublisher {
    fn estimate(&self, space: &Arc<str>, agent: &Arc<AgentView>) {
        self.board.agent(space, agent, Messages::ESTIMATE);
    }

    fn watermark(&self, space: &Arc<str>, agent: &Arc<AgentView>) {
        self.board.agent(space, agent, Messages::WATERMARK);
    }

    fn event(&self, event: &Arc<EventRecord>) {
        self.board.event(event);
    }
}
