//! The window of unacknowledged samples: numbering, acknowledgement, what to send again and when.
//!
//! No I/O and no clock: times come in as the span since any fixed moment, so that every loss and
//! delay can be tested without a network. The rules:
//!
//! - A sample is held until a watermark covers it.
//! - A watermark of this session that covers more than was sent is about another run's samples:
//!   two runs use one session number, and this one is over.
//! - A *gap* in a watermark is sent again at once, the same gap at most every [`GAP_INTERVAL`].
//! - A watermark whose `applied` has fallen back tells of a restarted service, and one of a larger
//!   *term* of another owner of the space: what the one before had only in memory is gone, and
//!   everything from `durable` on is sent again.
//! - What comes of a smaller term than the largest that was heard is outdated, and counts for
//!   nothing.
//! - When samples are out and the watermark has not moved for [`SILENCE`], the service is asked
//!   for it. If that moves nothing within [`GRACE`], everything from `durable` on is sent again.
//!   The wait doubles each time, up to [`SILENCE_MAX`], until the watermark moves.

use std::cmp::Ordering;
use std::collections::VecDeque;
use std::collections::vec_deque;
use std::time::Duration;

use cogmap_proto::{Sample, SeqRange, Watermark};

/// A watermark that does not move for this long is asked for.
const SILENCE: Duration = Duration::from_secs(1);
/// Longest such wait while nothing helps: a service that starts is found within this time.
const SILENCE_MAX: Duration = Duration::from_secs(4);
/// How long the answer may take before everything is sent again.
const GRACE: Duration = Duration::from_millis(200);
/// Least time between two repetitions of the same range: a round trip of a poor radio link.
const GAP_INTERVAL: Duration = Duration::from_millis(200);
/// Repetitions go in batches of at least this size, whatever the size of first batches.
const REPEAT_SAMPLES_MIN: usize = 64;

/// Bounds of a window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WindowLimits {
    /// Most samples held.
    pub(crate) capacity_samples: usize,
    /// Most bytes held; descriptors may be a hundred times longer than motion.
    pub(crate) capacity_bytes: usize,
    /// A batch leaves when it has this many samples …
    pub(crate) batch_samples: usize,
    /// … or this many bytes …
    pub(crate) batch_bytes: usize,
    /// … or when its first sample has waited this long.
    pub(crate) batch_delay: Duration,
}

/// Consecutive samples to be sent as one batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    /// Sequence number of the first one.
    pub(crate) first_seq: u64,
    /// How many.
    pub(crate) len: usize,
    /// Whether all of them have been sent before.
    pub(crate) repeated: bool,
}

/// What a watermark meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Heard {
    /// It is this session's latest word.
    Current,
    /// It is older than what is known, or of an earlier session.
    Stale,
    /// A later session has taken over, or another run uses this session's number.
    TakenOver,
}

struct Held {
    sample: Sample,
    bytes: usize,
}

/// Samples from the watermark on, by sequence number.
///
/// `durable <= sent <= next`: below `durable` a sample is acknowledged and gone, below `sent` it
/// was sent at least once, from `next` on it does not exist yet.
pub(crate) struct Window {
    limits: WindowLimits,
    session: u64,
    held: VecDeque<Held>,
    held_bytes: usize,
    durable: u64,
    sent: u64,
    applied: u64,
    /// The largest term that was heard of the agent.
    term: u64,
    /// Term of the latest watermark of this session.
    marked_term: Option<u64>,
    unsent_bytes: usize,
    unsent_since: Duration,
    /// Samples below this number do not wait for a full batch.
    hurry_below: u64,
    /// Disjoint ranges to send again, in order.
    repeat: Vec<SeqRange>,
    gap: Option<Gap>,
    restart_at: Option<Duration>,
    quiet_since: Duration,
    silence: Duration,
    asked_at: Option<Duration>,
}

/// The gap that was sent again last.
struct Gap {
    range: SeqRange,
    repeated_at: Duration,
    /// It was reported again too early; repeat it when the interval is over.
    again: bool,
}

impl Window {
    pub(crate) fn new(session: u64, limits: WindowLimits) -> Self {
        Self {
            limits,
            session,
            held: VecDeque::new(),
            held_bytes: 0,
            durable: 0,
            sent: 0,
            applied: 0,
            term: 0,
            marked_term: None,
            unsent_bytes: 0,
            unsent_since: Duration::ZERO,
            hurry_below: 0,
            repeat: Vec::new(),
            gap: None,
            restart_at: None,
            quiet_since: Duration::ZERO,
            silence: SILENCE,
            asked_at: None,
        }
    }

    /// Every sample below this number is on the service's disk.
    pub(crate) fn durable(&self) -> u64 {
        self.durable
    }

    /// Every sample below this number has been applied or rejected for good.
    pub(crate) fn applied(&self) -> u64 {
        self.applied
    }

    /// Number of the next sample.
    pub(crate) fn next(&self) -> u64 {
        self.durable + self.held.len() as u64
    }

    /// Samples that no watermark covers.
    pub(crate) fn pending(&self) -> u64 {
        self.held.len() as u64
    }

    /// Whether a sample of `bytes` fits. An empty window takes any sample.
    pub(crate) fn has_room(&self, bytes: usize) -> bool {
        self.held.is_empty()
            || (self.held.len() < self.limits.capacity_samples
                && self.held_bytes + bytes <= self.limits.capacity_bytes)
    }

    /// Takes a sample in and gives it its number. The caller has asked [`Self::has_room`].
    pub(crate) fn push(&mut self, sample: Sample, bytes: usize, now: Duration) -> u64 {
        let seq = self.next();
        if self.sent == seq {
            self.unsent_since = now;
        }
        self.held.push_back(Held { sample, bytes });
        self.held_bytes += bytes;
        self.unsent_bytes += bytes;
        seq
    }

    /// Lets all samples that are here now leave without waiting for a full batch.
    pub(crate) fn hurry(&mut self) {
        self.hurry_below = self.next();
    }

    /// Whether the sender has to look at the window: a batch is due, or a first sample has begun
    /// to wait for one.
    pub(crate) fn wants_sender(&self, now: Duration) -> bool {
        self.next() - self.sent == 1 || self.first_sending_due(now)
    }

    /// When the first samples leave even without a full batch.
    fn batch_due(&self) -> Duration {
        self.unsent_since.saturating_add(self.limits.batch_delay)
    }

    fn first_sending_due(&self, now: Duration) -> bool {
        let unsent = self.next() - self.sent;
        unsent > 0
            && (unsent >= self.limits.batch_samples as u64
                || self.unsent_bytes >= self.limits.batch_bytes
                || self.sent < self.hurry_below
                || now >= self.batch_due())
    }

    /// The next batch to send, counted as sent. Repetitions come first, because later samples
    /// wait for them at the service. `None` when nothing is due.
    pub(crate) fn take(&mut self, now: Duration) -> Option<Run> {
        if let Some(range) = self.repeat.first().copied() {
            let most = self.limits.batch_samples.max(REPEAT_SAMPLES_MIN) as u64;
            let run = Run {
                first_seq: range.from,
                len: self.batch_len(range.from, range.to.min(range.from + most)),
                repeated: true,
            };
            self.repeat[0].from = run.first_seq + run.len as u64;
            if self.repeat[0].from == range.to {
                self.repeat.remove(0);
            }
            if self.repeat.is_empty() {
                // The wait for an answer starts when the last repetition is out.
                self.quiet_since = now;
            }
            return Some(run);
        }
        if !self.first_sending_due(now) {
            return None;
        }
        if self.sent == self.durable {
            self.quiet_since = now;
        }
        let most = self.limits.batch_samples as u64;
        let run = Run {
            first_seq: self.sent,
            len: self.batch_len(self.sent, self.next().min(self.sent + most)),
            repeated: false,
        };
        self.unsent_bytes -= self.bytes_of(run);
        self.sent += run.len as u64;
        self.unsent_since = now;
        Some(run)
    }

    /// The samples of a run that [`Self::take`] has just returned.
    pub(crate) fn samples(&self, run: Run) -> impl ExactSizeIterator<Item = &Sample> + Clone {
        self.held_of(run).map(|held| &held.sample)
    }

    fn held_of(&self, run: Run) -> vec_deque::Iter<'_, Held> {
        let start = self.index(run.first_seq);
        self.held.range(start..start + run.len)
    }

    fn bytes_of(&self, run: Run) -> usize {
        self.held_of(run).map(|held| held.bytes).sum()
    }

    fn index(&self, seq: u64) -> usize {
        usize::try_from(seq - self.durable).expect("a held sample's index fits in memory")
    }

    /// How many samples from `from` on make a batch: at least one, up to `to` or the byte limit.
    fn batch_len(&self, from: u64, to: u64) -> usize {
        let mut bytes = 0;
        self.held
            .range(self.index(from)..self.index(to))
            .take_while(|held| {
                bytes += held.bytes;
                bytes <= self.limits.batch_bytes
            })
            .count()
            .max(1)
    }

    /// Notes the term of an estimate or a watermark of the agent. Says whether it is outdated:
    /// written by an owner of the space that has lost it.
    pub(crate) fn is_outdated(&mut self, term: u64) -> bool {
        let is_outdated = term < self.term;
        self.term = self.term.max(term);
        is_outdated
    }

    /// Takes in a watermark, which may come late, twice or out of order.
    pub(crate) fn hear(&mut self, watermark: &Watermark, now: Duration) -> Heard {
        if self.is_outdated(watermark.term) {
            return Heard::Stale;
        }
        match watermark.session.cmp(&self.session) {
            Ordering::Greater => return Heard::TakenOver,
            Ordering::Less => return Heard::Stale,
            Ordering::Equal => {}
        }
        // The service cannot have applied what this run never sent. `applied` moves before
        // `durable`, so it tells first; taken as this run's own, the watermark would acknowledge
        // samples that the service drops as duplicates.
        if watermark.applied.max(watermark.durable) > self.sent {
            return Heard::TakenOver;
        }
        // What is on disk stays there, so a lower `durable` can only be an old message.
        if watermark.durable < self.durable {
            return Heard::Stale;
        }
        self.advance(watermark.durable, now);
        let fell_back = watermark.applied < self.applied;
        self.applied = watermark.applied;
        let before = self.marked_term.replace(watermark.term);
        let is_other_owner = before.is_some_and(|before| before < watermark.term);
        let is_restart = fell_back && self.restart_at.is_none_or(|at| now >= at + GAP_INTERVAL);
        if is_other_owner || is_restart {
            self.restart_at = Some(now);
            self.repeat_all();
        }
        match watermark.gap {
            Some(gap) => self.hear_gap(gap, now),
            None => self.gap = None,
        }
        Heard::Current
    }

    fn hear_gap(&mut self, range: SeqRange, now: Duration) {
        if let Some(gap) = &mut self.gap
            && gap.range.from == range.from
            && now < gap.repeated_at + GAP_INTERVAL
        {
            gap.range = range;
            gap.again = true;
            return;
        }
        self.repeat_gap(range, now);
    }

    fn repeat_gap(&mut self, range: SeqRange, now: Duration) {
        self.gap = Some(Gap {
            range,
            repeated_at: now,
            again: false,
        });
        self.schedule(range);
    }

    /// Drops what the watermark covers.
    fn advance(&mut self, durable: u64, now: Duration) {
        if durable <= self.durable {
            return;
        }
        let covered = self.index(durable);
        self.held_bytes -= self
            .held
            .drain(..covered)
            .map(|held| held.bytes)
            .sum::<usize>();
        self.durable = durable;
        self.repeat.retain_mut(|range| {
            range.from = range.from.max(durable);
            range.from < range.to
        });
        self.quiet_since = now;
        self.silence = SILENCE;
        self.asked_at = None;
    }

    /// Adds a range to what is to be sent again, merged with the ranges that it touches.
    fn schedule(&mut self, range: SeqRange) {
        let mut merged = SeqRange {
            from: range.from.max(self.durable),
            to: range.to.min(self.sent),
        };
        if merged.from >= merged.to {
            return;
        }
        self.repeat.retain(|other| {
            let apart = other.to < merged.from || merged.to < other.from;
            if !apart {
                merged.from = merged.from.min(other.from);
                merged.to = merged.to.max(other.to);
            }
            apart
        });
        let at = self
            .repeat
            .partition_point(|other| other.from < merged.from);
        self.repeat.insert(at, merged);
    }

    fn repeat_all(&mut self) {
        self.schedule(SeqRange {
            from: self.durable,
            to: self.sent,
        });
    }

    /// Looks at the clock; schedules what has to be sent again. `true` says: ask the service for
    /// the watermark now.
    pub(crate) fn poll(&mut self, now: Duration) -> bool {
        if let Some(gap) = &self.gap
            && gap.again
            && now >= gap.repeated_at + GAP_INTERVAL
        {
            self.repeat_gap(gap.range, now);
        }
        if self.durable == self.sent || !self.repeat.is_empty() {
            return false;
        }
        if let Some(asked_at) = self.asked_at {
            if now >= asked_at + GRACE {
                self.asked_at = None;
                self.silence = (self.silence * 2).min(SILENCE_MAX);
                self.repeat_all();
            }
            return false;
        }
        let ask = now >= self.quiet_since + self.silence;
        if ask {
            self.asked_at = Some(now);
        }
        ask
    }

    /// When [`Self::poll`] or [`Self::take`] may next have something to do; `None` while all is
    /// acknowledged.
    pub(crate) fn wake_at(&self) -> Option<Duration> {
        if !self.repeat.is_empty() {
            return Some(Duration::ZERO);
        }
        let first_sending = (self.sent < self.next()).then(|| self.batch_due());
        let gap = self
            .gap
            .as_ref()
            .filter(|gap| gap.again)
            .map(|gap| gap.repeated_at + GAP_INTERVAL);
        let silence = (self.durable < self.sent).then(|| match self.asked_at {
            Some(asked_at) => asked_at + GRACE,
            None => self.quiet_since + self.silence,
        });
        [first_sending, gap, silence].into_iter().flatten().min()
    }
}

#[cfg(test)]
mod tests;
