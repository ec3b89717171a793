//! A robot: the client's side of one agent in one space.

use std::fmt;
use std::sync::{Arc, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use cogmap_proto::{
    Codec, Estimate, Rejection, Sample, SampleBody, Watermark, durable_key, estimate_key,
    samples_key,
};
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

use crate::batch::{self, BATCH_BYTES_MAX};
use crate::error::ClientError;
use crate::sender::Sender;
use crate::settings::{RobotSettings, deadline};
use crate::state::{Counters, Shared, State};
use crate::window::{Window, WindowLimits};

/// How long dropping a robot waits for its sending thread, which may be inside a put.
const END_WAIT: Duration = Duration::from_secs(1);
/// How long an estimate may follow the watermark that shows its samples applied.
const ESTIMATE_GRACE: Duration = Duration::from_millis(200);

/// One run of an agent in a space: takes samples, numbers them, and sends each until the service
/// has it on disk.
///
/// All calls may come from several threads. `send` only puts a sample into the window; one thread
/// in the background sends batches and repeats what got lost.
///
/// Dropping a robot ends its thread within about a second and flushes nothing: what no watermark
/// covers by then may be lost. [`Robot::close`] flushes first.
///
/// Calls block, so in an async program they belong on a blocking thread.
pub struct Robot {
    shared: Arc<Shared>,
    space: String,
    agent: String,
    session: u64,
    codec: Codec,
    send_timeout: Duration,
    ends_session: bool,
    sender: Option<JoinHandle<()>>,
    // Held for their effect: dropping them undeclares.
    _watermarks: Subscriber<()>,
    _estimates: Subscriber<()>,
    zenoh: Session,
}

impl Robot {
    pub(crate) fn start(
        zenoh: Session,
        space: String,
        agent: String,
        settings: &RobotSettings,
    ) -> Result<Self, ClientError> {
        let session = settings.session_or_now();
        let limits = WindowLimits {
            capacity_samples: settings.window_samples,
            capacity_bytes: settings.window_bytes,
            batch_samples: settings.batch_samples,
            batch_bytes: BATCH_BYTES_MAX,
            batch_delay: settings.batch_delay,
        };
        let shared = Arc::new(Shared::new(session, Window::new(session, limits)));
        let heard = Arc::clone(&shared);
        let watermarks = zenoh
            .declare_subscriber(durable_key(&space, &agent))
            .callback(move |message| heard.hear_watermark(&message))
            .wait()
            .map_err(ClientError::Declare)?;
        let heard = Arc::clone(&shared);
        let estimates = zenoh
            .declare_subscriber(estimate_key(&space, &agent))
            .callback(move |message| heard.hear_estimate(&message))
            .wait()
            .map_err(ClientError::Declare)?;
        let publisher = zenoh
            .declare_publisher(samples_key(&space, &agent))
            .encoding(settings.codec.encoding())
            .congestion_control(CongestionControl::Block)
            .wait()
            .map_err(ClientError::Declare)?;
        let sender = Sender {
            shared: Arc::clone(&shared),
            zenoh: zenoh.clone(),
            publisher,
            space: space.clone(),
            agent: agent.clone(),
            session,
            codec: settings.codec,
            match_timeout: settings.match_timeout,
        }
        .start()?;
        Ok(Self {
            shared,
            space,
            agent,
            session,
            codec: settings.codec,
            send_timeout: settings.send_timeout,
            ends_session: settings.ends_session,
            sender: Some(sender),
            _watermarks: watermarks,
            _estimates: estimates,
            zenoh,
        })
    }

    /// Name of the space.
    pub fn space(&self) -> &str {
        &self.space
    }

    /// Name of the agent.
    pub fn agent(&self) -> &str {
        &self.agent
    }

    /// Number of this run of the agent.
    pub fn session(&self) -> u64 {
        self.session
    }

    /// The Zenoh session, to be shared with further robots
    /// ([`RobotBuilder::zenoh_session`](crate::RobotBuilder::zenoh_session)).
    pub fn zenoh_session(&self) -> &Session {
        &self.zenoh
    }

    /// Takes a sample and returns its sequence number. It leaves within `batch_delay`. Blocks
    /// while the window is full.
    ///
    /// # Errors
    /// The sample cannot be carried, the window stays full for `send_timeout`, or another session
    /// has taken over. The sample has then not been taken.
    pub fn send(&self, sample: Sample) -> Result<u64, ClientError> {
        let bytes = self.check(&sample)?;
        let mut state = self.room_for(self.shared.lock(), bytes, 0)?;
        let seq = self.push(&mut state, sample, bytes);
        Ok(seq)
    }

    /// Takes samples in order, lets them leave at once, and returns the sequence number of the
    /// first. Faster than sending them one by one: one lock for all. They go out in messages of
    /// up to `batch_samples`. Blocks while the window is full.
    ///
    /// # Errors
    /// As [`Robot::send`]. A sample that cannot be carried refuses the whole batch; when the
    /// window stays full, [`ClientError::WindowFull`] says how many were taken.
    pub fn send_batch(&self, samples: Vec<Sample>) -> Result<u64, ClientError> {
        let sizes = samples
            .iter()
            .map(|sample| self.check(sample))
            .collect::<Result<Vec<_>, _>>()?;
        let mut state = self.shared.lock();
        self.check_session(&state)?;
        let mut now = self.shared.now();
        let first_seq = state.window.next();
        for (taken, (sample, bytes)) in samples.into_iter().zip(sizes).enumerate() {
            if !state.window.has_room(bytes) {
                state.window.hurry();
                self.shared.sender_bell.notify_one();
                state = self.room_for(state, bytes, taken)?;
                now = self.shared.now();
            }
            state.last_stamp_ns = state.last_stamp_ns.max(sample.stamp_ns);
            state.window.push(sample, bytes, now);
        }
        state.window.hurry();
        drop(state);
        self.shared.sender_bell.notify_one();
        Ok(first_seq)
    }

    /// Takes a sample stamped with the system's clock, or with the stamp before it where the clock
    /// was set back: stamps of a session never run backwards.
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn send_now(&self, body: SampleBody) -> Result<u64, ClientError> {
        let mut sample = Sample {
            stamp_ns: unix_now_ns(),
            body,
        };
        let bytes = self.check(&sample)?;
        let mut state = self.room_for(self.shared.lock(), bytes, 0)?;
        sample.stamp_ns = sample.stamp_ns.max(state.last_stamp_ns);
        let seq = self.push(&mut state, sample, bytes);
        Ok(seq)
    }

    /// The sample's length on the wire at most, if a message can carry it.
    fn check(&self, sample: &Sample) -> Result<usize, ClientError> {
        let bytes = batch::bytes_max(sample, self.codec);
        if bytes > BATCH_BYTES_MAX {
            return Err(ClientError::SampleTooLong { bytes });
        }
        if !batch::is_carried(sample, self.codec) {
            return Err(ClientError::NotFinite);
        }
        Ok(bytes)
    }

    fn push(&self, state: &mut State, sample: Sample, bytes: usize) -> u64 {
        let now = self.shared.now();
        state.last_stamp_ns = state.last_stamp_ns.max(sample.stamp_ns);
        let seq = state.window.push(sample, bytes, now);
        if state.sender_waits && state.window.wants_sender(now) {
            self.shared.sender_bell.notify_one();
        }
        seq
    }

    fn room_for<'a>(
        &self,
        mut state: MutexGuard<'a, State>,
        bytes: usize,
        taken: usize,
    ) -> Result<MutexGuard<'a, State>, ClientError> {
        let mut until = None;
        loop {
            self.check_session(&state)?;
            if state.window.has_room(bytes) {
                return Ok(state);
            }
            let until = *until.get_or_insert_with(|| deadline(self.send_timeout));
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(ClientError::WindowFull {
                    pending: state.window.pending(),
                    taken,
                });
            }
            state = Shared::wait(&self.shared.caller_bell, state, left);
        }
    }

    fn check_session(&self, state: &State) -> Result<(), ClientError> {
        if let Some(detail) = &state.refused {
            return Err(ClientError::SessionRefused {
                detail: detail.clone(),
            });
        }
        state.superseded_by.map_or(Ok(()), |by| {
            Err(ClientError::SessionSuperseded {
                session: self.session,
                by,
            })
        })
    }

    /// Waits until every sample taken before the call is durable, i.e. on the service's disk or
    /// refused by it for good ([`Robot::rejections`]).
    ///
    /// # Errors
    /// That takes longer than `timeout`, or another session has taken over.
    pub fn flush(&self, timeout: Duration) -> Result<(), ClientError> {
        let deadline = deadline(timeout);
        let mut state = self.shared.lock();
        let target = state.window.next();
        state.window.hurry();
        self.shared.sender_bell.notify_one();
        loop {
            self.check_session(&state)?;
            if state.window.durable() >= target {
                return Ok(());
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(ClientError::FlushTimeout {
                    pending: state.window.pending(),
                    is_heard: state.watermark.is_some(),
                });
            }
            state = Shared::wait(&self.shared.caller_bell, state, left);
        }
    }

    /// Waits for an estimate that includes every sample taken before the call, and returns it.
    /// Where the last of them bring no estimate of their own (they were refused, for example), the
    /// latest estimate is returned as soon as the service has gone past them.
    ///
    /// # Errors
    /// There is none within `timeout`, or another session has taken over.
    pub fn estimate(&self, timeout: Duration) -> Result<Estimate, ClientError> {
        let deadline = deadline(timeout);
        let mut state = self.shared.lock();
        let target = state.window.next();
        state.window.hurry();
        self.shared.sender_bell.notify_one();
        let mut applied_at = None;
        loop {
            self.check_session(&state)?;
            let now = Instant::now();
            if let Some(estimate) = &state.estimate {
                // What was applied may be gone with the owner of the space.
                let is_applied = state.window.applied() >= target;
                applied_at = is_applied.then(|| applied_at.unwrap_or(now));
                let settled = applied_at.is_some_and(|at| now >= at + ESTIMATE_GRACE);
                if estimate.seq + 1 >= target || settled {
                    return Ok(estimate.clone());
                }
            }
            let left = deadline.saturating_duration_since(now);
            if left.is_zero() {
                return Err(ClientError::EstimateTimeout);
            }
            let pause = applied_at.map_or(left, |_| left.min(ESTIMATE_GRACE));
            state = Shared::wait(&self.shared.caller_bell, state, pause);
        }
    }

    /// The latest estimate of this session, without waiting.
    pub fn latest_estimate(&self) -> Option<Estimate> {
        self.shared.lock().estimate.clone()
    }

    /// Calls `callback` for every estimate of this session from now on, in place of an earlier
    /// callback. It runs on Zenoh's receiving thread: it has to be short, and must not call a
    /// method that waits (`send`, `flush`, `estimate`), because what these wait for arrives on
    /// that thread.
    pub fn on_estimate(&self, callback: impl Fn(&Estimate) + Send + Sync + 'static) {
        self.shared.lock().on_estimate = Some(Arc::new(callback));
    }

    /// The latest watermark of this session.
    pub fn watermark(&self) -> Option<Watermark> {
        self.shared.lock().watermark.clone()
    }

    /// Samples that the service refused for good, the latest 256 ranges.
    pub fn rejections(&self) -> Vec<Rejection> {
        self.shared.lock().rejections.iter().cloned().collect()
    }

    /// Samples taken that no watermark covers yet.
    pub fn pending(&self) -> u64 {
        self.shared.lock().window.pending()
    }

    /// What was sent and heard so far.
    pub fn counters(&self) -> Counters {
        self.shared.lock().counters
    }

    /// Ends the session, and the trip under way with it, flushes, then ends the robot whether or
    /// not that worked. The session's end is a sample, the last one; a robot that has sent nothing
    /// and one whose settings say so send none.
    ///
    /// # Errors
    /// As [`Robot::flush`]; what was not durable by then may be lost.
    pub fn close(self, timeout: Duration) -> Result<(), ClientError> {
        let deadline = deadline(timeout);
        if self.ends_session {
            self.end_session(timeout)?;
        }
        self.flush(deadline.saturating_duration_since(Instant::now()))
    }

    fn end_session(&self, timeout: Duration) -> Result<(), ClientError> {
        let body = SampleBody::SessionEnd {};
        let mut sample = Sample { stamp_ns: 0, body };
        let bytes = self.check(&sample)?;
        if !self.shared.lock().window.has_room(bytes) {
            self.flush(timeout)?;
        }
        let mut state = self.shared.lock();
        self.check_session(&state)?;
        if state.window.next() > 0 {
            // The robot's own clock may be another than this machine's.
            sample.stamp_ns = state.last_stamp_ns;
            self.push(&mut state, sample, bytes);
        }
        Ok(())
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        let deadline = Instant::now() + END_WAIT;
        let mut state = self.shared.lock();
        state.stop = true;
        self.shared.set_over();
        // The callback may own what the caller wants back now; it is dropped outside the lock.
        let callback = state.on_estimate.take();
        self.shared.sender_bell.notify_one();
        while !state.sender_ended {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            state = Shared::wait(&self.shared.caller_bell, state, left);
        }
        // A thread that is still inside a put ends by itself when the put returns.
        let ended = state.sender_ended;
        drop(state);
        drop(callback);
        if let Some(sender) = self.sender.take().filter(|_| ended) {
            // It only ends with an error if it panicked, and has said so on stderr.
            drop(sender.join());
        }
    }
}

impl fmt::Debug for Robot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Robot")
            .field("space", &self.space)
            .field("agent", &self.agent)
            .field("session", &self.session)
            .finish_non_exhaustive()
    }
}

fn unix_now_ns() -> i64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .ok()
        .and_then(|since| i64::try_from(since.as_nanos()).ok())
        .unwrap_or_default()
}
