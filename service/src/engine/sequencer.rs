//! Puts one agent's samples in order: duplicates out, gaps seen, late samples waited for.
//!
//! Pure: time comes as an argument, and the items are whatever the caller numbers. What comes out is
//! the one order in which samples are journaled, so any arrival order inside the window gives the same
//! journal.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use cogmap_proto::SeqRange;

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
    /// The number after the last sample that was dropped beyond the window, while it is missing.
    dropped_to: Option<u64>,
    /// When the present gap was first seen, or last became smaller.
    gap_since: Option<Instant>,
}

/// Something that waits, and what it takes.
pub(crate) trait Weight {
    /// Memory that it holds \[bytes\].
    fn bytes(&self) -> usize;
}

/// How much may wait, or does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    /// Samples, and how far ahead of the next one they may be.
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

    /// What is left of it beside `used`.
    pub(crate) fn beside(self, used: Self) -> Self {
        Self {
            samples: self.samples.saturating_sub(used.samples),
            bytes: self.bytes.saturating_sub(used.bytes),
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
        let to = first.or(self.dropped_to)?;
        Some(SeqRange {
            from: self.next,
            to,
        })
    }

    /// Whether a run of samples from `first` on can be taken whole, as it is: it begins with the next
    /// sample in order and no gap is open.
    pub(crate) fn is_next(&self, first: u64) -> bool {
        first == self.next && self.waiting.is_empty() && self.dropped_to.is_none()
    }

    /// Takes a run for which [`Sequencer::is_next`] holds.
    pub(crate) fn take_run(&mut self, count: u64) {
        self.next += count;
    }

    /// Offers consecutive samples from `first` on; passes those that are in order now to `accept`.
    pub(crate) fn offer(
        &mut self,
        first: u64,
        items: impl IntoIterator<Item = T>,
        window: Window,
        now: Instant,
        mut accept: impl FnMut(u64, T),
    ) -> Offered {
        let mut offered = Offered::default();
        let before = self.next;
        for (seq, item) in (first..).zip(items) {
            let bytes = item.bytes();
            if seq < self.next || self.waiting.contains_key(&seq) {
                offered.duplicates += 1;
            } else if seq == self.next {
                self.next += 1;
                accept(seq, item);
                self.release(&mut accept);
            } else if self.waiting.len() < window.samples
                && seq - self.next < window.samples as u64
                && self.waiting_bytes + bytes <= window.bytes
            {
                self.waiting.insert(seq, item);
                self.waiting_bytes += bytes;
                offered.reordered += 1;
            } else {
                self.dropped_to = self.dropped_to.max(Some(seq + 1));
                offered.beyond_window += 1;
            }
        }
        self.note_gap(before, now);
        offered
    }

    /// Gives up a gap that has been waited for long enough: returns the lost range, and passes what
    /// waited for it to `accept`.
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

    /// Restarts the wait when the gap is new or has moved.
    fn note_gap(&mut self, before: u64, now: Instant) {
        self.dropped_to = self.dropped_to.filter(|&to| to > self.next);
        if self.gap().is_none() {
            self.gap_since = None;
        } else if self.gap_since.is_none() || self.next != before {
            self.gap_since = Some(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const WINDOW: Window = Window {
        samples: 32,
        bytes: 32 * 8,
    };

    impl Weight for u64 {
        fn bytes(&self) -> usize {
            8
        }
    }

    fn offer(
        sequencer: &mut Sequencer<u64>,
        first: u64,
        count: u64,
        got: &mut Vec<u64>,
    ) -> Offered {
        sequencer.offer(
            first,
            first..first + count,
            WINDOW,
            Instant::now(),
            |seq, item| {
                assert_eq!(seq, item, "each sample keeps its number");
                got.push(item);
            },
        )
    }

    #[test]
    fn a_gap_is_seen_and_filled() {
        let (mut sequencer, mut got) = (Sequencer::new(7, 0), Vec::new());
        offer(&mut sequencer, 0, 3, &mut got);
        let offered = offer(&mut sequencer, 5, 2, &mut got);
        assert_eq!(
            (got.as_slice(), offered.reordered),
            ([0, 1, 2].as_slice(), 2)
        );
        assert_eq!(sequencer.gap(), Some(SeqRange { from: 3, to: 5 }));
        offer(&mut sequencer, 3, 2, &mut got);
        assert_eq!(got, [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(sequencer.gap(), None);
    }

    #[test]
    fn a_gap_is_given_up_only_after_its_time_without_progress() {
        let (mut sequencer, mut got) = (Sequencer::new(7, 0), Vec::new());
        let start = Instant::now();
        let timeout = Duration::from_secs(10);
        let at = |s: u64| start + Duration::from_secs(s);
        sequencer.offer(2, [2_u64], WINDOW, at(0), |_, item| got.push(item));
        let mut lost = None;
        sequencer.give_up(
            timeout,
            at(9),
            |range| lost = Some(range),
            |_, item| got.push(item),
        );
        assert_eq!((lost, got.len()), (None, 0));
        // One missing sample comes: the wait begins anew.
        sequencer.offer(0, [0], WINDOW, at(9), |_, item| got.push(item));
        sequencer.give_up(
            timeout,
            at(18),
            |range| lost = Some(range),
            |_, item| got.push(item),
        );
        assert_eq!(lost, None);
        sequencer.give_up(
            timeout,
            at(19),
            |range| lost = Some(range),
            |_, item| got.push(item),
        );
        assert_eq!(lost, Some(SeqRange { from: 1, to: 2 }));
        assert_eq!((got.as_slice(), sequencer.next()), ([0, 2].as_slice(), 3));
    }

    #[test]
    fn what_is_beyond_the_window_is_dropped_and_said() {
        let (mut sequencer, mut got) = (Sequencer::new(7, 0), Vec::new());
        let offered = offer(&mut sequencer, 1, 64, &mut got);
        assert_eq!((offered.reordered, offered.beyond_window), (31, 33));
        let waiting = sequencer.waiting();
        assert_eq!((waiting.samples, waiting.bytes), (31, 31 * 8));
        assert_eq!(sequencer.gap(), Some(SeqRange { from: 0, to: 1 }));
        // With the missing one, those that waited follow; those that were dropped are missing now.
        offer(&mut sequencer, 0, 1, &mut got);
        assert_eq!(sequencer.gap(), Some(SeqRange { from: 32, to: 65 }));
        offer(&mut sequencer, 32, 33, &mut got);
        assert_eq!(got, (0..65).collect::<Vec<_>>());
        assert_eq!((sequencer.gap(), sequencer.waiting()), (None, Window::NONE));
    }

    #[test]
    fn what_waits_is_bounded_in_bytes() {
        let (mut sequencer, mut got) = (Sequencer::new(7, 0), Vec::new());
        let window = Window {
            bytes: 20,
            ..WINDOW
        };
        let offered = sequencer.offer(1, [1, 2, 3], window, Instant::now(), |_, item| {
            got.push(item);
        });
        assert_eq!((offered.reordered, offered.beyond_window), (2, 1));
    }

    #[test]
    fn a_gap_wider_than_the_window_is_given_up_too() {
        let (mut sequencer, mut got) = (Sequencer::new(7, 0), Vec::new());
        let timeout = Duration::from_secs(10);
        let start = Instant::now();
        let at = |s| start + Duration::from_secs(s);
        sequencer.offer(1000, [1000_u64], WINDOW, at(0), |_, item| got.push(item));
        sequencer.offer(1001, [1001], WINDOW, at(5), |_, item| got.push(item));
        assert_eq!(sequencer.waiting(), Window::NONE);
        assert_eq!(sequencer.gap(), Some(SeqRange { from: 0, to: 1002 }));
        let mut lost = None;
        sequencer.give_up(timeout, at(9), |range| lost = Some(range), |_, _| {});
        assert_eq!(lost, None);
        sequencer.give_up(timeout, at(10), |range| lost = Some(range), |_, _| {});
        assert_eq!(lost, Some(SeqRange { from: 0, to: 1002 }));
        // From here on the stream is taken again.
        offer(&mut sequencer, 1002, 3, &mut got);
        assert_eq!((got, sequencer.gap()), (vec![1002, 1003, 1004], None));
    }

    #[test]
    fn a_newer_session_begins_at_zero_and_an_older_one_is_stale() {
        let mut sequencer: Sequencer<u64> = Sequencer::new(7, 40);
        assert_eq!(sequencer.order_of(7), SessionOrder::Current);
        assert_eq!(sequencer.order_of(6), SessionOrder::Stale);
        assert_eq!(sequencer.order_of(8), SessionOrder::Newer);
        offer(&mut sequencer, 42, 2, &mut Vec::new());
        assert_eq!(sequencer.begin(8).samples, 2);
        assert_eq!(
            (sequencer.session(), sequencer.next(), sequencer.gap()),
            (8, 0, None)
        );
    }

    proptest! {
        /// Any order of overlapping runs inside the window gives every sample exactly once, in order.
        #[test]
        fn any_arrival_order_gives_one_order(
            shuffle in Just((0..24_u64).collect::<Vec<_>>()).prop_shuffle(),
            lengths in prop::collection::vec(1..8_u64, 24),
        ) {
            let (mut sequencer, mut got) = (Sequencer::new(1, 0), Vec::new());
            let mut offered = 0;
            let mut duplicates = 0;
            for (&first, &length) in shuffle.iter().zip(&lengths) {
                let length = length.min(24 - first);
                offered += length;
                duplicates += offer(&mut sequencer, first, length, &mut got).duplicates;
            }
            prop_assert_eq!(got, (0..24).collect::<Vec<_>>());
            prop_assert_eq!(offered, 24 + duplicates);
            prop_assert_eq!(sequencer.gap(), None);
        }
    }
}
