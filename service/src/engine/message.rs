//! Messages to a space's writer, and the bounded queue that they wait in.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use cogmap_proto::{Codec, IngestAnswer, SampleBatch};
use tokio::sync::oneshot;

/// What a writer is told.
#[derive(Debug)]
pub(crate) enum Message {
    /// Samples of an agent.
    Samples(Samples),
    /// Look up: a snapshot is wished for, or the space closes.
    Wake,
}

/// Samples of an agent, still encoded or already decoded.
#[derive(Debug)]
pub(crate) struct Samples {
    pub(crate) agent: Box<str>,
    pub(crate) body: Body,
}

/// The samples themselves.
#[derive(Debug)]
pub(crate) enum Body {
    /// As they came; decoded by the writer, so that the transport's threads only copy.
    Encoded(Codec, Box<[u8]>),
    /// Decoded, and someone waits for the answer.
    Decoded(SampleBatch, Reply),
}

/// Whoever waits for samples to be durable.
pub(crate) type Reply = oneshot::Sender<Result<IngestAnswer, IngestError>>;

/// Why samples were not taken. None of these leaves a part of the request behind unsaid: what was
/// taken before the error stands in the agent's watermark.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IngestError {
    /// The space is still loading.
    #[error("the space is recovering")]
    Recovering,
    /// The writer's queue is full.
    #[error("the space's queue is full")]
    Busy,
    /// Samples before these are missing.
    #[error("sample {expected} of session {session} is next")]
    Gap {
        /// Current session.
        session: u64,
        /// Sequence number of the next sample in order.
        expected: u64,
    },
    /// A newer session has taken the agent over.
    #[error("session {current} has taken over")]
    StaleSession {
        /// The newer session.
        current: u64,
    },
    /// The space has as many agents as it may.
    #[error("the space has its full number of agents")]
    TooManyAgents,
    /// The store's disk is full.
    #[error("{0}")]
    DiskFull(String),
    /// The store failed otherwise.
    #[error("{0}")]
    Store(String),
    /// The space is closing.
    #[error("the space is closing")]
    Closed,
}

/// Sending end of a writer's queue, bounded in messages and in bytes.
///
/// The channel itself is unbounded and takes memory only for what waits; the bounds are counted
/// beside it.
#[derive(Clone, Debug)]
pub(crate) struct Queue {
    sender: Sender<Message>,
    waiting: Arc<Waiting>,
    messages_max: usize,
    bytes_max: usize,
}

/// Receiving end.
#[derive(Debug)]
pub(crate) struct Inbox {
    receiver: Receiver<Message>,
    waiting: Arc<Waiting>,
}

/// What waits in a queue.
#[derive(Debug, Default)]
struct Waiting {
    messages: AtomicUsize,
    bytes: AtomicUsize,
}

/// Why a message was not queued.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum NotQueued {
    /// The queue is full.
    Full,
    /// The writer is gone.
    Closed,
}

/// A queue of at most so many messages and bytes.
pub(crate) fn queue(messages_max: usize, bytes_max: usize) -> (Queue, Inbox) {
    let (sender, receiver) = channel();
    let waiting = Arc::new(Waiting::default());
    let inbox = Inbox {
        receiver,
        waiting: Arc::clone(&waiting),
    };
    (
        Queue {
            sender,
            waiting,
            messages_max,
            bytes_max,
        },
        inbox,
    )
}

impl Queue {
    /// Queues a message, or gives up at once.
    pub(crate) fn push(&self, message: Message) -> Result<(), NotQueued> {
        let size = message.size();
        let Waiting { messages, bytes } = &*self.waiting;
        // Counted before the send, so that the receiver never counts down below zero.
        let full = messages.fetch_add(1, Ordering::Relaxed) >= self.messages_max
            || bytes.fetch_add(size, Ordering::Relaxed) + size > self.bytes_max && {
                bytes.fetch_sub(size, Ordering::Relaxed);
                true
            };
        if full {
            messages.fetch_sub(1, Ordering::Relaxed);
            return Err(NotQueued::Full);
        }
        self.sender.send(message).map_err(|_| {
            self.waiting.taken(1, size);
            NotQueued::Closed
        })
    }
}

impl Inbox {
    /// Waits for messages and moves up to `most` of them to `inbox`. Returns after `patience` at the
    /// latest, then perhaps with none.
    pub(crate) fn drain(&self, inbox: &mut Vec<Message>, most: usize, patience: Duration) {
        let Ok(first) = self.receiver.recv_timeout(patience) else {
            return;
        };
        inbox.push(first);
        inbox.extend(self.receiver.try_iter().take(most - 1));
        self.waiting
            .taken(inbox.len(), inbox.iter().map(Message::size).sum());
    }

    /// Messages that wait.
    pub(crate) fn len(&self) -> usize {
        self.waiting.messages.load(Ordering::Relaxed)
    }
}

impl Drop for Inbox {
    /// Counts out what nobody will take, so that senders learn that the writer is gone rather than
    /// that the queue is full.
    fn drop(&mut self) {
        while let Ok(message) = self.receiver.try_recv() {
            self.waiting.taken(1, message.size());
        }
    }
}

impl Waiting {
    fn taken(&self, messages: usize, bytes: usize) {
        self.messages.fetch_sub(messages, Ordering::Relaxed);
        self.bytes.fetch_sub(bytes, Ordering::Relaxed);
    }
}

impl Message {
    fn size(&self) -> usize {
        match self {
            Self::Samples(Samples {
                body: Body::Encoded(_, bytes),
                ..
            }) => bytes.len(),
            Self::Samples(Samples {
                body: Body::Decoded(batch, _),
                ..
            }) => batch.samples.len() * size_of::<cogmap_proto::Sample>(),
            Self::Wake => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(bytes: usize) -> Message {
        let body = Body::Encoded(Codec::Postcard, vec![0; bytes].into());
        Message::Samples(Samples {
            agent: "a".into(),
            body,
        })
    }

    #[test]
    fn both_bounds_hold_and_room_comes_back() {
        let (queue, inbox) = queue(2, 100);
        assert_eq!(queue.push(message(101)), Err(NotQueued::Full));
        assert_eq!(queue.push(message(60)), Ok(()));
        assert_eq!(queue.push(message(60)), Err(NotQueued::Full));
        assert_eq!(queue.push(message(40)), Ok(()));
        assert_eq!(queue.push(message(0)), Err(NotQueued::Full));
        let mut drained = Vec::new();
        inbox.drain(&mut drained, 1, Duration::ZERO);
        assert_eq!((drained.len(), queue.push(message(60))), (1, Ok(())));
        drop(inbox);
        assert_eq!(queue.push(message(0)), Err(NotQueued::Closed));
    }
}
