//! The one thread of a robot: it alone puts samples on Zenoh, so that they leave in order.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use cogmap_proto::{Codec, SESSION_PARAMETER, Verb, WatermarkQuery, query_key};
use zenoh::pubsub::Publisher;
use zenoh::{Session, Wait};

use crate::batch;
use crate::error::ClientError;
use crate::settings::deadline;
use crate::state::Shared;

/// How often a service is looked for before the first batch.
const MATCH_PAUSE: Duration = Duration::from_millis(10);
/// How long a query for the watermark may take.
const QUERY_TIMEOUT: Duration = Duration::from_secs(2);
/// How long the first batch waits for the watermark that the service has of this agent.
const FIRST_ANSWER: Duration = Duration::from_millis(200);
/// Longest sleep of the thread when nothing is due.
const IDLE: Duration = Duration::from_secs(60);

/// Most messages written under one lock. A put may wait for a slow link, and until then nothing
/// that was heard in the meantime can change what goes out.
const MESSAGES_AT_ONCE: usize = 16;

/// What the thread works with.
pub(crate) struct Sender {
    pub(crate) shared: Arc<Shared>,
    pub(crate) zenoh: Session,
    pub(crate) publisher: Publisher<'static>,
    pub(crate) space: String,
    pub(crate) agent: String,
    pub(crate) session: u64,
    pub(crate) codec: Codec,
    pub(crate) match_timeout: Duration,
}

/// What to do next, decided under the lock and done without it.
enum Step {
    Put,
    Ask,
    End,
}

impl Sender {
    pub(crate) fn start(self) -> Result<JoinHandle<()>, ClientError> {
        thread::Builder::new()
            .name("cogmap-sender".to_owned())
            .spawn(move || self.run())
            .map_err(ClientError::Thread)
    }

    fn run(self) {
        self.await_service();
        self.await_first_answer();
        let mut messages = Vec::with_capacity(MESSAGES_AT_ONCE);
        loop {
            match self.next_step(&mut messages) {
                Step::Put => self.put(&mut messages),
                Step::Ask => drop(self.ask()),
                Step::End => break,
            }
        }
        let shared = Arc::clone(&self.shared);
        // Undeclares the publisher, and closes the session where nobody shares it.
        drop(self);
        shared.lock().sender_ended = true;
        shared.caller_bell.notify_all();
    }

    /// Waits for a subscriber, because Zenoh drops what is put before one matches. A bounded wait:
    /// what is dropped is still held, and sent again.
    fn await_service(&self) {
        let deadline = deadline(self.match_timeout);
        while Instant::now() < deadline {
            match self.publisher.matching_status().wait() {
                Ok(status) if !status.matching() => {}
                _ => return,
            }
            let state = self.shared.lock();
            if state.stop {
                return;
            }
            drop(Shared::wait(&self.shared.sender_bell, state, MATCH_PAUSE));
        }
    }

    /// Asks for the watermark before anything is sent: if the service has samples of this session
    /// already, another run uses its number, and after the first put nobody could tell whose they
    /// are. A bounded wait, because a robot may start before its service.
    fn await_first_answer(&self) {
        // Nothing to tell apart: with an answer, without one or too late, sending is next. What the
        // answer says has gone to the state.
        let _ = self.ask().recv_timeout(FIRST_ANSWER);
    }

    /// Decides what is next. What is to be put is written into `messages`: all that is due, up to a
    /// bound, so that a fast robot takes the lock once for many of them.
    fn next_step(&self, messages: &mut Vec<Vec<u8>>) -> Step {
        let mut state = self.shared.lock();
        loop {
            if state.stop {
                return Step::End;
            }
            let now = self.shared.now();
            let over = state.superseded_by.is_some() || state.refused.is_some();
            if !over {
                if state.window.poll(now) {
                    state.counters.queries += 1;
                    return Step::Ask;
                }
                while messages.len() < MESSAGES_AT_ONCE
                    && let Some(run) = state.window.take(now)
                {
                    let samples = state.window.samples(run);
                    let bytes = batch::encode(self.session, run.first_seq, samples, self.codec);
                    messages.push(bytes);
                    state.counters.batches += 1;
                    if run.repeated {
                        state.counters.samples_resent += run.len as u64;
                    } else {
                        state.counters.samples_sent += run.len as u64;
                    }
                }
                if !messages.is_empty() {
                    return Step::Put;
                }
            }
            let due = state.window.wake_at().filter(|_| !over);
            let pause = due.map_or(IDLE, |at| at.saturating_sub(now).min(IDLE));
            state.sender_waits = true;
            state = Shared::wait(&self.shared.sender_bell, state, pause);
            state.sender_waits = false;
        }
    }

    fn put(&self, messages: &mut Vec<Vec<u8>>) {
        for bytes in messages.drain(..) {
            if self.shared.is_over() {
                break;
            }
            if self.publisher.put(bytes).wait().is_err() {
                self.shared.lock().counters.puts_failed += 1;
            }
        }
    }

    /// Asks for the watermark; the answer comes to a callback, and the receiver is told when it has
    /// been taken in, or cut off when there is none. A failure needs no handling: the window sends
    /// everything again when the answer stays away.
    fn ask(&self) -> Receiver<()> {
        let query = WatermarkQuery {
            agent: self.agent.clone(),
        };
        let key = query_key(&self.space, Verb::Watermark.as_str());
        let (told, answered) = channel();
        let shared = Arc::clone(&self.shared);
        let asked = self
            .zenoh
            .get(format!("{key}?{SESSION_PARAMETER}={}", self.session))
            .payload(self.codec.encode(&query))
            .encoding(self.codec.encoding())
            .timeout(QUERY_TIMEOUT)
            .callback(move |reply| {
                match reply.result() {
                    Ok(sample) => shared.hear_watermark(sample),
                    Err(refusal) => shared.hear_refusal(refusal),
                }
                // Nobody may wait for it.
                let _ = told.send(());
            })
            .wait();
        drop(asked);
        answered
    }
}
