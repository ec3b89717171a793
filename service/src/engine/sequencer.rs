//! Puts one agent's samples in order: duplicates out, gaps seen, late samples waited for.
//!
//! Pure: time comes as an argument, and the items are whatever the caller numbers. What comes out
//! is the one order in which samples are journaled, so any arrival order inside the window gives
//! the same journal.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use cogmap_proto::SeqRange;
use cogmap_proto::limits::SEQUENCE_LEAP_MAX;

/// The order of one agent's samples.
#[derive(Debug)]
pub(crate) struct Sequencer<T> {
    session: u64,
    /// Sequence number of the next sample in order.
    next: u64,
    /// Samples beyond a gap.
    waiting: BTreeMap<u64, T>,
    /// What they take in memory.
    waiting_bytes: usize,
    /// The number after the last sample that was dropped for want of room, while it is missing.
    dropped_to: Option<u64>,
    /// Samples that come from beyond the window.
    leap: Option<Leap>,
    /// When the present gap was first seen, or last became smaller.
    gap_since: Option<Instant>,
}

/// Consecutive samples that begin beyond the window: those of a robot that no longer has the ones
/// before, or of somebody who made a number up. The former keep coming.
#[derive(Clone, Copy, Debug)]
struct Leap {
    from: u64,
    to: u64,
    /// How far ahead a sample could be and wait.
    reach: u64,
    /// When they were first offered, and last.
    since: Instant,
    latest: Instant,
}

/// Waits for which a leap is remembered that nothing follows: as long as a slow robot may take
/// between two samples.
const LEAP_WAITS: u32 = 8;

/// Something that waits, and what it takes.
pub(crate) trait Weight {
    /// Memory that it holds \[bytes\].
    fn bytes(&self) -> usize;
}

/// How much may wait, or does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    /// Samples.
    pub(crate) samples: usize,
    /// Memory \[bytes\].
    pub(crate) bytes: usize,
}

impl Window {
    /// Nothing.
    pub(crate) const NONE: Self = Self {
        samples: 0,
        bytes: 0,
    };

    /// Counts anew what waits at one sequencer, where it was `before`.
    pub(crate) fn recount(&mut self, before: Self, after: Self) {
        self.samples = self.samples - before.samples + after.samples;
        self.bytes = self.bytes - before.bytes + after.bytes;
    }

    /// How much of it one may hold where `others` do: as much as it leaves free. So nobody takes it
    /// all, however many want to, and who comes later always finds some.
    pub(crate) fn fair_share(self, others: Self) -> Self {
        Self {
            samples: self.samples.saturating_sub(others.samples) / 2,
            bytes: self.bytes.saturating_sub(others.bytes) / 2,
        }
    }
}

/// What became of a run of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Offered {
    /// Samples that had been there before.
    pub(crate) duplicates: u64,
    /// Samples beyond the window, dropped.
    pub(crate) beyond_window: u64,
    /// Whether samples were put aside for earlier ones that are missing.
    pub(crate) reordered: u64,
}

/// How a message's session stands to the current one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SessionOrder {
    /// It is the current session.
    Current,
    /// It takes over.
    Newer,
    /// It has been taken over.
    Stale,
}

impl<T: Weight> Sequencer<T> {
    /// The sequencer of an agent whose next sample in order is `next`.
    pub(crate) fn new(session: u64, next: u64) -> Self {
        Self {
            session,
            next,
            waiting: BTreeMap::new(),
            waiting_bytes: 0,
            dropped_to: None,
            leap: None,
            gap_since: None,
        }
    }

    /// Current session.
    pub(crate) fn session(&self) -> u64 {
        self.session
    }

    /// Sequence number of the next sample in order.
    pub(crate) fn next(&self) -> u64 {
        self.next
    }

    /// The samples that wait for earlier ones.
    pub(crate) fn waiting(&self) -> Window {
        Window {
            samples: self.waiting.len(),
            bytes: self.waiting_bytes,
        }
    }

    /// How `session` stands to the current one.
    pub(crate) fn order_of(&self, session: u64) -> SessionOrder {
        match session.cmp(&self.session) {
            std::cmp::Ordering::Equal => SessionOrder::Current,
            std::cmp::Ordering::Greater => SessionOrder::Newer,
            std::cmp::Ordering::Less => SessionOrder::Stale,
        }
    }

    /// Begins a newer session; what waited of the old one is gone, and returned as a count.
    pub(crate) fn begin(&mut self, session: u64) -> Window {
        let dropped = self.waiting();
        *self = Self::new(session, 0);
        dropped
    }

    /// The missing samples, if later ones wait for them or were dropped because too many would.
    pub(crate) fn gap(&self) -> Option<SeqRange> {
        let first = self.waiting.first_key_value().map(|(&first, _)| first);
        let leap = self.leap.map(|leap| leap.to);
        let to = first.or(self.dropped_to).or(leap)?;
        Some(SeqRange {
            from: self.next,
            to,
        })
    }

    /// Whether a run of samples from `first` on can be taken whole, as it is: it begins with the
    /// next sample in order and no gap is open.
    pub(crate) fn is_next(&self, first: u64) -> bool {
        let is_whole = self.waiting.is_empty() && self.dropped_to.is_none() && self.leap.is_none();
        first == self.next && is_whole
    }

    /// Whether a run of samples from `first` on leaps farther ahead than any loss explains. It is
    /// not to be offered.
    pub(crate) fn is_out_of_reach(&self, first: u64, count: usize) -> bool {
        let end = first.checked_add(count as u64);
        end.is_none_or(|end| end.saturating_sub(self.next) > SEQUENCE_LEAP_MAX)
    }

    /// Takes a run for which [`Sequencer::is_next`] holds.
    pub(crate) fn take_run(&mut self, count: u64) {
        self.next += count;
    }

    /// Offers consecutive samples from `first` on; passes those that are in order now to `accept`.
    /// Those that are not wait, up to `reach` ahead of the next one and as many as there is `room`
    /// for.
    ///
    /// They must not be [out of reach](Self::is_out_of_reach).
    pub(crate) fn offer(
        &mut self,
        first: u64,
        items: impl IntoIterator<Item = T>,
        (reach, room): (u64, Window),
        now: Instant,
        mut accept: impl FnMut(u64, T),
    ) -> Offered {
        let mut offered = Offered::default();
        let before = self.next;
        let is_leap = first.saturating_sub(self.next) >= reach;
        for (seq, item) in (first..).zip(items) {
            let bytes = item.bytes();
            if seq < self.next || self.waiting.contains_key(&seq) {
                offered.duplicates += 1;
            } else if seq == self.next {
                self.next += 1;
                accept(seq, item);
                self.release(&mut accept);
            } else if seq - self.next < reach
                && self.waiting.len() < room.samples
                && self.waiting_bytes + bytes <= room.bytes
            {
                self.waiting.insert(seq, item);
                self.waiting_bytes += bytes;
                offered.reordered += 1;
            } else {
                if !is_leap {
                    self.dropped_to = self.dropped_to.max(Some(seq + 1));
                }
                offered.beyond_window += 1;
            }
        }
        if is_leap && offered.beyond_window > 0 {
            self.note_leap(first, first + offered.beyond_window, reach, now);
        }
        self.note_gap(before, now);
        offered
    }

    /// Gives up a gap that has been waited for long enough: returns the lost range, and passes what
    /// waited for it to `accept`.
    ///
    /// One up to samples beyond the window is given up only if these have kept coming, one after
    /// the other or again, for half of the wait; if they have not, they are forgotten. So a message
    /// with a number that somebody made up loses nobody's samples.
    pub(crate) fn give_up(
        &mut self,
        timeout: Duration,
        now: Instant,
        lost: impl FnOnce(SeqRange),
        mut accept: impl FnMut(u64, T),
    ) {
        let Some(gap) = self.gap() else { return };
        if self
            .gap_since
            .is_none_or(|since| now.saturating_duration_since(since) < timeout)
        {
            return;
        }
        if let Some(leap) = self.leap.filter(|leap| leap.to == gap.to) {
            let lasted = leap.latest.saturating_duration_since(leap.since);
            if lasted < timeout / 2 {
                if now.saturating_duration_since(leap.latest) >= timeout * LEAP_WAITS {
                    self.leap = None;
                    self.note_gap(self.next, now);
                }
                return;
            }
        }
        lost(gap);
        self.next = gap.to;
        self.release(&mut accept);
        self.note_gap(gap.from, now);
    }

    /// Passes on what waited and is in order now.
    fn release(&mut self, accept: &mut impl FnMut(u64, T)) {
        while let Some(entry) = self.waiting.first_entry() {
            if *entry.key() != self.next {
                return;
            }
            let item = entry.remove();
            self.waiting_bytes -= item.bytes();
            accept(self.next, item);
            self.next += 1;
        }
    }

    /// Samples came from beyond the window.
    fn note_leap(&mut self, from: u64, to: u64, reach: u64, now: Instant) {
        let known = self
            .leap
            .filter(|leap| (leap.from..=leap.to).contains(&from));
        self.leap = Some(Leap {
            from: known.map_or(from, |leap| leap.from),
            to: known.map_or(to, |leap| leap.to.max(to)),
            reach,
            since: known.map_or(now, |leap| leap.since),
            latest: now,
        });
    }

    /// Restarts the wait when the gap is new or has moved.
    fn note_gap(&mut self, before: u64, now: Instant) {
        self.dropped_to = self.dropped_to.filter(|&to| to > self.next);
        if self.next != before
            && let Some(leap) = self.leap.take()
        {
            // The robot goes on: what is ahead of it is missing if it is near, and else was not its
            // own.
            let is_near = leap.from.saturating_sub(self.next) < leap.reach;
            if is_near && leap.to > self.next {
                self.dropped_to = self.dropped_to.max(Some(leap.to));
            }
        }
        if self.gap().is_none() {
            self.gap_since = None;
        } else if self.gap_since.is_none() || self.next != before {
            self.gap_since = Some(now);
        }
    }
}

#[cfg(test)]
mod tests;
