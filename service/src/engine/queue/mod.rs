//! The bounded queue of a space's writer.
//!
//! A lane for each agent: whoever sends more than the writer can take fills his own and waits in
//! it; otherwise messages are taken in the order in which they came. A message costs a copy at each
//! end and no allocation, and the lock is held for these copies only.

mod frames;
mod lanes;

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use cogmap_proto::{Codec, Contact, ContactLevel, Sample};

use super::message::{Call, ObjectRequest, Request};
use super::sequencer::Weight;
use frames::Frames;
use lanes::{HEAD_BYTES, Lanes};

/// Bytes that the writer takes at once: little enough that whoever comes next is not far behind.
const TAKEN_BYTES: usize = 32 << 10;

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
    /// The agent's messages take up all the room that it may have beside others.
    LaneFull,
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
    lanes: Lanes,
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
    calls: VecDeque<Call>,
    handled: Load,
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
        let (mut waiting, lane) = self.0.room_for(agent, agent.len() + payload.len())?;
        waiting.lanes.push(lane, agent, codec, payload);
        self.0.ring(waiting);
        Ok(())
    }

    /// Queues a request, or gives up at once.
    pub(crate) fn request(&self, call: Call) -> Result<(), NotQueued> {
        let bytes = size_of_call(&call);
        let agent = match &call {
            Call::Samples(request) => &*request.agent,
            // A removal does not wait behind what the agent itself has sent.
            Call::Object(_) | Call::Removal(_) | Call::Instruction(_) => "",
        };
        let (mut waiting, lane) = self.0.room_for(agent, bytes)?;
        waiting.lanes.push_call(lane, call, bytes);
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
        waiting.settle(&mut self.taken.handled);
        if !self.taken.is_empty() {
            return waiting.load.messages;
        }
        if waiting.lanes.is_empty() {
            waiting.writer_sleeps = true;
            waiting = self
                .channel
                .bell
                .wait_timeout_while(waiting, patience, |waiting| {
                    waiting.lanes.is_empty() && !waiting.call
                })
                .unwrap_or_else(PoisonError::into_inner)
                .0;
            waiting.writer_sleeps = false;
        }
        waiting.call = false;
        waiting.load.messages
    }

    /// The next message.
    pub(crate) fn next(&mut self) -> Option<Message<'_>> {
        if self.taken.is_empty() {
            let mut waiting = self.channel.lock();
            waiting.settle(&mut self.taken.handled);
            self.taken.refill(&mut waiting.lanes);
        }
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

    /// The queue with room for a message of so many bytes made in it, and the lane of its agent.
    fn room_for(
        &self,
        agent: &str,
        bytes: usize,
    ) -> Result<(MutexGuard<'_, Waiting>, usize), NotQueued> {
        let mut waiting = self.lock();
        if waiting.closed {
            return Err(NotQueued::Closed);
        }
        let bytes = bytes + HEAD_BYTES;
        let free = Load {
            messages: self.messages_max.saturating_sub(waiting.load.messages),
            bytes: self.bytes_max.saturating_sub(waiting.load.bytes),
        };
        if free.messages == 0 || bytes > free.bytes {
            return Err(NotQueued::Full);
        }
        let lane = waiting.lanes.lane_for(agent, bytes, free)?;
        waiting.load.add(bytes);
        Ok((waiting, lane))
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

    /// Takes a message off.
    fn remove(&mut self, bytes: usize) {
        self.messages -= 1;
        self.bytes -= bytes;
    }
}

impl Waiting {
    /// Frees the room of what has been handled.
    fn settle(&mut self, handled: &mut Load) {
        let handled = std::mem::take(handled);
        self.load.messages -= handled.messages;
        self.load.bytes -= handled.bytes;
    }
}

impl Taken {
    fn is_empty(&self) -> bool {
        self.frames.is_empty() && self.calls.is_empty()
    }

    fn refill(&mut self, lanes: &mut Lanes) {
        self.frames.clear();
        lanes.take(&mut self.frames, &mut self.calls, TAKEN_BYTES);
    }

    fn next(&mut self) -> Option<Message<'_>> {
        if let Some(call) = self.calls.pop_front() {
            self.handled.add(HEAD_BYTES + size_of_call(&call));
            return Some(Message::Call(call));
        }
        let (agent, codec, payload) = self.frames.next()?;
        self.handled.add(HEAD_BYTES + agent.len() + payload.len());
        Some(Message::Encoded {
            agent,
            codec,
            payload,
        })
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
        Call::Instruction(request) => request.bytes(),
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

    /// Sends as many bytes as a message then counts.
    fn push(queue: &Queue, agent: &str, bytes: usize) -> Result<(), NotQueued> {
        let payload = vec![0; bytes - HEAD_BYTES - agent.len()];
        queue.push(agent, Codec::Postcard, &payload)
    }

    #[test]
    fn both_bounds_hold_and_room_comes_back_when_a_message_is_handled() {
        let (queue, mut inbox) = queue(4, 1000);
        assert_eq!(push(&queue, "a", 1001), Err(NotQueued::Full));
        assert_eq!(push(&queue, "a", 600), Ok(()));
        assert_eq!(push(&queue, "b", 600), Err(NotQueued::Full));
        assert_eq!(push(&queue, "b", 100), Ok(()));
        assert_eq!(push(&queue, "c", 100), Ok(()));
        assert_eq!(push(&queue, "d", 100), Ok(()));
        assert_eq!(push(&queue, "e", 100), Err(NotQueued::Full));
        assert_eq!(inbox.wait(Duration::ZERO), 4);
        assert!(inbox.next().is_some());
        assert_eq!(push(&queue, "e", 100), Err(NotQueued::Full));
        assert_eq!(inbox.wait(Duration::ZERO), 3);
        assert_eq!(push(&queue, "e", 600), Ok(()));
        drop(inbox);
        assert_eq!(push(&queue, "e", 100), Err(NotQueued::Closed));
    }

    #[test]
    fn one_agent_alone_cannot_fill_the_queue() {
        let (queue, mut inbox) = queue(1_000_000, 1_000_000);
        let fill = |agent: &str| {
            let taken = (0..1000).take_while(|_| push(&queue, agent, 1000).is_ok());
            taken.count()
        };
        let first = fill("first");
        assert_eq!(
            (first, push(&queue, "first", 1000)),
            (500, Err(NotQueued::LaneFull))
        );
        // Those who come later share what is left, and there is always some.
        assert_eq!(fill("second"), 250);
        assert_eq!(fill("third"), 125);
        assert_eq!(push(&queue, "honest", 1000), Ok(()));
        // Nothing is lost of what was taken.
        inbox.wait(Duration::ZERO);
        let mut received = 0;
        while inbox.next().is_some() {
            received += 1;
        }
        assert_eq!(received, 500 + 250 + 125 + 1);
        assert_eq!(inbox.wait(Duration::ZERO), 0);
    }

    #[test]
    fn messages_come_out_as_they_went_in() {
        let (queue, mut inbox) = queue(100, 100_000);
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
