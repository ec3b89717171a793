//! The bounded queue of a space's writer.
//!
//! Encoded messages are copied one behind the other into one buffer, which the writer takes whole:
//! no allocation for a message, and a lock that is held for one copy. Requests, which someone waits
//! for, are rare and stand beside it.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use cogmap_proto::{Codec, Contact, ContactLevel, Sample};

use super::message::{Call, ObjectRequest, Request};
use super::sequencer::Weight;

/// A buffer that has grown beyond this is given back when little of it is used.
const KEPT_BYTES: usize = 1 << 20;

/// Sending end, bounded in messages and in bytes.
#[derive(Clone, Debug)]
pub(crate) struct Queue(Arc<Channel>);

/// Receiving end: what the writer has taken from the queue and not yet handled.
#[derive(Debug)]
pub(crate) struct Inbox {
    channel: Arc<Channel>,
    taken: Taken,
}

/// Why a message was not queued.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum NotQueued {
    /// The queue is full.
    Full,
    /// The writer is gone.
    Closed,
}

#[derive(Debug)]
struct Channel {
    waiting: Mutex<Waiting>,
    bell: Condvar,
    messages_max: usize,
    bytes_max: usize,
}

/// What is between the two ends.
#[derive(Debug, Default)]
struct Waiting {
    frames: Frames,
    calls: Vec<Call>,
    /// What the bounds hold for: that which the writer has taken and not yet handled is part of it.
    load: Load,
    /// The writer is to look up although no message comes.
    call: bool,
    writer_sleeps: bool,
    closed: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Load {
    messages: usize,
    bytes: usize,
}

#[derive(Debug, Default)]
struct Taken {
    frames: Frames,
    calls: std::vec::IntoIter<Call>,
    handled: Load,
}

/// Encoded messages, one behind the other.
#[derive(Debug, Default)]
struct Frames {
    heads: Vec<Head>,
    bytes: Vec<u8>,
    /// How many heads and bytes have been read.
    read: Load,
}

#[derive(Clone, Copy, Debug)]
struct Head {
    codec: Codec,
    agent_len: usize,
    payload_len: usize,
}

/// A message as the writer takes it.
#[derive(Debug)]
pub(crate) enum Message<'a> {
    /// As it came over Zenoh.
    Encoded {
        /// Name of the agent, not yet checked.
        agent: &'a str,
        /// How the payload is written.
        codec: Codec,
        /// The batch.
        payload: &'a [u8],
    },
    /// Decoded, and someone waits for the answer.
    Call(Call),
}

/// A queue of at most so many messages and bytes.
pub(crate) fn queue(messages_max: usize, bytes_max: usize) -> (Queue, Inbox) {
    let channel = Arc::new(Channel {
        waiting: Mutex::default(),
        bell: Condvar::new(),
        messages_max,
        bytes_max,
    });
    let inbox = Inbox {
        channel: Arc::clone(&channel),
        taken: Taken::default(),
    };
    (Queue(channel), inbox)
}

impl Queue {
    /// Queues a message as it came, or gives up at once.
    pub(crate) fn push(&self, agent: &str, codec: Codec, payload: &[u8]) -> Result<(), NotQueued> {
        let mut waiting = self.0.room_for(agent.len() + payload.len())?;
        waiting.frames.push(agent, codec, payload);
        self.0.ring(waiting);
        Ok(())
    }

    /// Queues a request, or gives up at once.
    pub(crate) fn request(&self, call: Call) -> Result<(), NotQueued> {
        let mut waiting = self.0.room_for(size_of_call(&call))?;
        waiting.calls.push(call);
        self.0.ring(waiting);
        Ok(())
    }

    /// Lets the writer look up: a snapshot is wished for, or the space closes.
    pub(crate) fn call(&self) {
        let mut waiting = self.0.lock();
        waiting.call = true;
        self.0.ring(waiting);
    }
}

impl Inbox {
    /// Waits until there is something to handle or the writer is called, at most for `patience`.
    /// Returns the number of messages that wait.
    pub(crate) fn wait(&mut self, patience: Duration) -> usize {
        let mut waiting = self.channel.lock();
        let handled = std::mem::take(&mut self.taken.handled);
        waiting.load.messages -= handled.messages;
        waiting.load.bytes -= handled.bytes;
        if !self.taken.is_empty() {
            return waiting.load.messages;
        }
        if waiting.is_empty() {
            waiting.writer_sleeps = true;
            waiting = self
                .channel
                .bell
                .wait_timeout_while(waiting, patience, |waiting| {
                    waiting.is_empty() && !waiting.call
                })
                .unwrap_or_else(PoisonError::into_inner)
                .0;
            waiting.writer_sleeps = false;
        }
        waiting.call = false;
        self.taken.frames.clear();
        std::mem::swap(&mut self.taken.frames, &mut waiting.frames);
        self.taken.calls = std::mem::take(&mut waiting.calls).into_iter();
        waiting.load.messages
    }

    /// The next message that [`Self::wait`] has taken.
    pub(crate) fn next(&mut self) -> Option<Message<'_>> {
        self.taken.next()
    }
}

impl Drop for Inbox {
    /// Lets go of what nobody will handle, so that whoever waits for an answer learns it.
    fn drop(&mut self) {
        let mut waiting = self.channel.lock();
        *waiting = Waiting {
            closed: true,
            ..Waiting::default()
        };
    }
}

impl Channel {
    // A panic while the lock is held cannot leave half a message behind: the heads come last.
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn room_for(&self, bytes: usize) -> Result<MutexGuard<'_, Waiting>, NotQueued> {
        let mut waiting = self.lock();
        if waiting.closed {
            return Err(NotQueued::Closed);
        }
        let mut load = waiting.load;
        load.add(bytes);
        if load.messages > self.messages_max || load.bytes > self.bytes_max {
            return Err(NotQueued::Full);
        }
        waiting.load = load;
        Ok(waiting)
    }

    /// Wakes the writer if it sleeps, once.
    fn ring(&self, mut waiting: MutexGuard<'_, Waiting>) {
        let sleeps = std::mem::take(&mut waiting.writer_sleeps);
        drop(waiting);
        if sleeps {
            self.bell.notify_one();
        }
    }
}

impl Load {
    /// Adds a message.
    fn add(&mut self, bytes: usize) {
        self.messages += 1;
        self.bytes += bytes;
    }
}

impl Waiting {
    fn is_empty(&self) -> bool {
        self.frames.heads.is_empty() && self.calls.is_empty()
    }
}

impl Taken {
    fn is_empty(&self) -> bool {
        self.frames.read.messages == self.frames.heads.len() && self.calls.len() == 0
    }

    fn next(&mut self) -> Option<Message<'_>> {
        if let Some(call) = self.calls.next() {
            self.handled.add(size_of_call(&call));
            return Some(Message::Call(call));
        }
        let (agent, codec, payload) = self.frames.next()?;
        self.handled.add(agent.len() + payload.len());
        Some(Message::Encoded {
            agent,
            codec,
            payload,
        })
    }
}

impl Frames {
    fn push(&mut self, agent: &str, codec: Codec, payload: &[u8]) {
        self.bytes.extend_from_slice(agent.as_bytes());
        self.bytes.extend_from_slice(payload);
        self.heads.push(Head {
            codec,
            agent_len: agent.len(),
            payload_len: payload.len(),
        });
    }

    fn next(&mut self) -> Option<(&str, Codec, &[u8])> {
        let Head {
            codec,
            agent_len,
            payload_len,
        } = *self.heads.get(self.read.messages)?;
        let start = self.read.bytes;
        self.read.add(agent_len + payload_len);
        let (agent, payload) = self.bytes[start..self.read.bytes].split_at(agent_len);
        let agent = str::from_utf8(agent).expect("a name was pushed as a str");
        Some((agent, codec, payload))
    }

    fn clear(&mut self) {
        if self.bytes.capacity() > KEPT_BYTES && self.bytes.len() < self.bytes.capacity() / 4 {
            *self = Self::default();
        }
        self.heads.clear();
        self.bytes.clear();
        self.read = Load::default();
    }
}

fn size_of_call(call: &Call) -> usize {
    match call {
        Call::Samples(request) => size_of_request(request),
        Call::Object(ObjectRequest { name, lesson, .. }) => {
            let contacts = lesson.iter().flat_map(|(lesson, _)| &lesson.contacts);
            // Twice: as it came, and as the map takes it.
            name.as_str().len() + 2 * contacts.map(size_of_contact).sum::<usize>()
        }
        Call::Removal(request) => request.agent.len(),
    }
}

fn size_of_contact(contact: &Contact) -> usize {
    let levels = contact.levels.iter();
    let descriptors = contact.descriptors.iter();
    size_of::<Contact>()
        + levels
            .map(|level| size_of::<ContactLevel>() + level.channel.len())
            .sum::<usize>()
        + descriptors
            .map(|seen| seen.channel.len() + size_of_val(seen.vector.as_slice()))
            .sum::<usize>()
}

fn size_of_request(request: &Request) -> usize {
    request.agent.len()
        + request
            .batch
            .samples
            .iter()
            .map(Sample::bytes)
            .sum::<usize>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn push(queue: &Queue, bytes: usize) -> Result<(), NotQueued> {
        queue.push("a", Codec::Postcard, &vec![0; bytes - 1])
    }

    #[test]
    fn both_bounds_hold_and_room_comes_back_when_a_message_is_handled() {
        let (queue, mut inbox) = queue(2, 100);
        assert_eq!(push(&queue, 101), Err(NotQueued::Full));
        assert_eq!(push(&queue, 60), Ok(()));
        assert_eq!(push(&queue, 60), Err(NotQueued::Full));
        assert_eq!(push(&queue, 40), Ok(()));
        assert_eq!(push(&queue, 1), Err(NotQueued::Full));
        assert_eq!(inbox.wait(Duration::ZERO), 2);
        assert_eq!(push(&queue, 1), Err(NotQueued::Full));
        assert!(inbox.next().is_some());
        assert_eq!(inbox.wait(Duration::ZERO), 1);
        assert_eq!(push(&queue, 60), Ok(()));
        drop(inbox);
        assert_eq!(push(&queue, 1), Err(NotQueued::Closed));
    }

    #[test]
    fn messages_come_out_as_they_went_in() {
        let (queue, mut inbox) = queue(100, 1000);
        let sent = [
            ("ada", Codec::Cbor, vec![1, 2, 3]),
            ("bob", Codec::Postcard, Vec::new()),
            ("ada", Codec::Json, vec![4; 90]),
        ];
        for (agent, codec, payload) in &sent {
            queue.push(agent, *codec, payload).expect("there is room");
        }
        inbox.wait(Duration::ZERO);
        let mut received = Vec::new();
        while let Some(Message::Encoded {
            agent,
            codec,
            payload,
        }) = inbox.next()
        {
            received.push((agent.to_owned(), codec, payload.to_vec()));
        }
        let sent = sent.map(|(agent, codec, payload)| (agent.to_owned(), codec, payload));
        assert_eq!(received, sent);
        assert_eq!(inbox.wait(Duration::ZERO), 0);
    }

    #[test]
    fn a_call_wakes_the_writer_without_a_message() {
        let (queue, mut inbox) = queue(1, 1);
        let caller = std::thread::spawn(move || queue.call());
        assert_eq!(inbox.wait(Duration::from_secs(600)), 0);
        caller.join().expect("the caller ends");
    }
}
