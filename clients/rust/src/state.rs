//! What a robot's callers, its sending thread and Zenoh's callbacks share: small, under one lock
//! that nobody holds across a put, a query or a callback of the user.

use std::collections::VecDeque;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use cogmap_proto::{Codec, Estimate, Problem, Rejection, Watermark};
use serde::de::DeserializeOwned;
use zenoh::query::ReplyError;

use crate::window::{Heard, Window};

/// Rejections remembered: the latest ones.
const REJECTIONS_MAX: usize = 256;

/// Kind of the problem that a session lies in the future.
const SESSION_IN_FUTURE: &str = "/problems/session-in-future";

/// What a robot has sent and heard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Samples sent for the first time.
    pub samples_sent: u64,
    /// Samples sent again.
    pub samples_resent: u64,
    /// Messages put on Zenoh.
    pub batches: u64,
    /// Messages that Zenoh refused to take. Their samples are held and sent again.
    pub puts_failed: u64,
    /// Times that the service was asked for the watermark because it was silent.
    pub queries: u64,
    /// Watermarks heard, those of other sessions included.
    pub watermarks: u64,
    /// Estimates heard, those of other sessions included.
    pub estimates: u64,
    /// Messages of the service that could not be read.
    pub undecodable: u64,
}

/// A callback for estimates.
pub(crate) type EstimateCallback = Arc<dyn Fn(&Estimate) + Send + Sync>;

/// The state under the lock.
pub(crate) struct State {
    pub(crate) window: Window,
    pub(crate) session: u64,
    pub(crate) superseded_by: Option<u64>,
    /// Why the service does not let this run begin.
    pub(crate) refused: Option<String>,
    pub(crate) watermark: Option<Watermark>,
    pub(crate) estimate: Option<Estimate>,
    pub(crate) on_estimate: Option<EstimateCallback>,
    pub(crate) rejections: VecDeque<Rejection>,
    pub(crate) counters: Counters,
    /// Stamp of the latest sample: a stamp taken from the clock never falls behind it.
    pub(crate) last_stamp_ns: i64,
    /// The sending thread waits and would not see a new sample by itself.
    pub(crate) sender_waits: bool,
    pub(crate) stop: bool,
    pub(crate) sender_ended: bool,
}

/// The state, its lock, and the two bells: one for the sending thread, one for callers who wait.
pub(crate) struct Shared {
    state: Mutex<State>,
    pub(crate) sender_bell: Condvar,
    pub(crate) caller_bell: Condvar,
    /// Nothing goes out any more: the robot was dropped, or its session is over. Beside the lock,
    /// because the sending thread looks at it before each put.
    over: AtomicBool,
    started: Instant,
}

impl fmt::Debug for Shared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Shared").finish_non_exhaustive()
    }
}

impl Shared {
    pub(crate) fn new(session: u64, window: Window) -> Self {
        Self {
            state: Mutex::new(State {
                window,
                session,
                superseded_by: None,
                refused: None,
                watermark: None,
                estimate: None,
                on_estimate: None,
                rejections: VecDeque::new(),
                counters: Counters::default(),
                last_stamp_ns: i64::MIN,
                sender_waits: false,
                stop: false,
                sender_ended: false,
            }),
            sender_bell: Condvar::new(),
            caller_bell: Condvar::new(),
            over: AtomicBool::new(false),
            started: Instant::now(),
        }
    }

    /// The window's clock.
    pub(crate) fn now(&self) -> Duration {
        self.started.elapsed()
    }

    /// Whether nothing may go out any more.
    pub(crate) fn is_over(&self) -> bool {
        self.over.load(Ordering::Relaxed)
    }

    /// From now on nothing goes out.
    pub(crate) fn set_over(&self) {
        self.over.store(true, Ordering::Relaxed);
    }

    /// A panic elsewhere leaves the state whole, because every change to it is a plain assignment
    /// or a queue operation; so a poisoned lock is taken all the same.
    pub(crate) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits at `bell`, at most for `timeout`.
    pub(crate) fn wait<'a>(
        bell: &Condvar,
        state: MutexGuard<'a, State>,
        timeout: Duration,
    ) -> MutexGuard<'a, State> {
        bell.wait_timeout(state, timeout)
            .unwrap_or_else(PoisonError::into_inner)
            .0
    }

    /// Takes in a sample of a Zenoh subscription or a reply, which should be a watermark.
    pub(crate) fn hear_watermark(&self, message: &zenoh::sample::Sample) {
        let Some(watermark) = self.decode::<Watermark>(message) else {
            return;
        };
        let now = self.now();
        let mut state = self.lock();
        state.counters.watermarks += 1;
        if state.superseded_by.is_some() && watermark.session <= state.session {
            // Two runs share the number, so nobody knows which of them this is about.
            return;
        }
        match state.window.hear(&watermark, now) {
            Heard::Stale => return,
            Heard::TakenOver => {
                let by = state.superseded_by.unwrap_or_default();
                state.superseded_by = Some(by.max(watermark.session));
                self.set_over();
            }
            Heard::Current => {
                state.remember_rejections(&watermark.rejected);
                state.watermark = Some(watermark);
            }
        }
        drop(state);
        self.sender_bell.notify_one();
        self.caller_bell.notify_all();
    }

    /// Takes in why a query for the watermark is refused. Only a session in the future ends the
    /// run: any other reason may pass, as when the service is loading or has not met the agent yet.
    pub(crate) fn hear_refusal(&self, refusal: &ReplyError) {
        let Ok(codec) = Codec::of_encoding(&refusal.encoding().to_string()) else {
            return; // Zenoh says that no answer came
        };
        let Ok(problem) = codec.decode::<Problem>(&refusal.payload().to_bytes()) else {
            self.lock().counters.undecodable += 1;
            return;
        };
        if problem.kind == SESSION_IN_FUTURE {
            self.lock().refused = Some(problem.detail);
            self.set_over();
            self.sender_bell.notify_one();
            self.caller_bell.notify_all();
        }
    }

    /// Takes in an estimate of a Zenoh subscription.
    pub(crate) fn hear_estimate(&self, message: &zenoh::sample::Sample) {
        let Some(estimate) = self.decode::<Estimate>(message) else {
            return;
        };
        let mut state = self.lock();
        state.counters.estimates += 1;
        let is_outdated = state.window.is_outdated(estimate.term);
        // Another owner of the space begins where the journal ends, which may be before.
        let age = |estimate: &Estimate| (estimate.term, estimate.seq);
        let known = state.estimate.as_ref();
        let is_late = known.is_some_and(|known| age(&estimate) < age(known));
        if estimate.session != state.session || is_outdated || is_late {
            return;
        }
        let callback = state.on_estimate.clone();
        let told = callback.as_ref().map(|_| estimate.clone());
        state.estimate = Some(estimate);
        drop(state);
        self.caller_bell.notify_all();
        if let (Some(callback), Some(estimate)) = (callback, told) {
            callback(&estimate);
        }
    }

    fn decode<T: DeserializeOwned>(&self, message: &zenoh::sample::Sample) -> Option<T> {
        let decoded = Codec::of_encoding(&message.encoding().to_string())
            .and_then(|codec| codec.decode(&message.payload().to_bytes()));
        if decoded.is_err() {
            self.lock().counters.undecodable += 1;
        }
        decoded.ok()
    }
}

impl State {
    /// Watermarks repeat the latest rejections, and the last range of them may have grown.
    fn remember_rejections(&mut self, rejected: &[Rejection]) {
        for rejection in rejected {
            let known = self.rejections.iter_mut().rev().find(|known| {
                known.range.from == rejection.range.from && known.reason == rejection.reason
            });
            match known {
                Some(known) => known.range.to = known.range.to.max(rejection.range.to),
                None => self.rejections.push_back(rejection.clone()),
            }
        }
        let excess = self.rejections.len().saturating_sub(REJECTIONS_MAX);
        self.rejections.drain(..excess);
    }
}
