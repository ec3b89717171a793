//! Orders of arrival, gaps, and leaps.

use super::*;
use proptest::prelude::*;

const WINDOW: Window = Window {
    samples: 32,
    bytes: 32 * 8,
};
const REACH: u64 = 32;

impl Weight for u64 {
    fn bytes(&self) -> usize {
        8
    }
}

fn offer(sequencer: &mut Sequencer<u64>, first: u64, count: u64, got: &mut Vec<u64>) -> Offered {
    sequencer.offer(
        first,
        first..first + count,
        WINDOW,
        REACH,
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
    sequencer.offer(2, [2_u64], WINDOW, REACH, at(0), |_, item| got.push(item));
    let mut lost = None;
    sequencer.give_up(
        timeout,
        at(9),
        |range| lost = Some(range),
        |_, item| got.push(item),
    );
    assert_eq!((lost, got.len()), (None, 0));
    // One missing sample comes: the wait begins anew.
    sequencer.offer(0, [0], WINDOW, REACH, at(9), |_, item| got.push(item));
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
    let offered = sequencer.offer(1, [1, 2, 3], window, REACH, Instant::now(), |_, item| {
        got.push(item);
    });
    assert_eq!((offered.reordered, offered.beyond_window), (2, 1));
}

#[test]
fn what_others_leave_no_room_for_is_missing() {
    let (mut sequencer, mut got) = (Sequencer::new(7, 0), Vec::new());
    let offered = sequencer.offer(
        10,
        10..15,
        Window::NONE,
        REACH,
        Instant::now(),
        |_, item| {
            got.push(item);
        },
    );
    assert_eq!(offered.beyond_window, 5);
    assert_eq!(sequencer.gap(), Some(SeqRange { from: 0, to: 15 }));
    // Those before come: the others were there, and are asked for again.
    offer(&mut sequencer, 0, 10, &mut got);
    assert_eq!(sequencer.gap(), Some(SeqRange { from: 10, to: 15 }));
    offer(&mut sequencer, 10, 5, &mut got);
    assert_eq!((got, sequencer.gap()), ((0..15).collect(), None));
}

#[test]
fn a_gap_wider_than_the_window_is_given_up_too() {
    let (mut sequencer, mut got) = (Sequencer::new(7, 0), Vec::new());
    let timeout = Duration::from_secs(10);
    let start = Instant::now();
    let at = |s| start + Duration::from_secs(s);
    sequencer.offer(1000, [1000_u64], WINDOW, REACH, at(0), |_, item| {
        got.push(item)
    });
    sequencer.offer(1001, [1001], WINDOW, REACH, at(5), |_, item| got.push(item));
    assert!(!sequencer.is_next(0), "a gap is open");
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
fn a_leap_that_nothing_follows_loses_nothing() {
    let (mut sequencer, mut got) = (Sequencer::new(7, 100), Vec::new());
    let timeout = Duration::from_secs(10);
    let start = Instant::now();
    let at = |s| start + Duration::from_secs(s);
    // Somebody made a number up, twice within the wait, and the robot rests meanwhile.
    for s in [0, 4] {
        sequencer.offer(1 << 20, [1 << 20], WINDOW, REACH, at(s), |_, item| {
            got.push(item)
        });
    }
    let mut lost = None;
    for s in [10, 13, 15, 90] {
        sequencer.give_up(timeout, at(s), |range| lost = Some(range), |_, _| {});
    }
    assert_eq!((lost, sequencer.gap()), (None, None));
    assert!(sequencer.is_next(100));
    offer(&mut sequencer, 100, 3, &mut got);
    assert_eq!(got, [100, 101, 102]);
}

#[test]
fn a_leap_does_not_lose_the_samples_of_a_robot_that_goes_on() {
    let (mut sequencer, mut got) = (Sequencer::new(7, 0), Vec::new());
    let timeout = Duration::from_secs(10);
    let start = Instant::now();
    let mut lost = None;
    for s in 0..60 {
        let now = start + Duration::from_secs(s);
        sequencer.offer(s, [s], WINDOW, REACH, now, |_, item| got.push(item));
        let forged = (1 << 20) + s;
        sequencer.offer(forged, [forged], WINDOW, REACH, now, |_, item| {
            got.push(item)
        });
        sequencer.give_up(timeout, now, |range| lost = Some(range), |_, _| {});
    }
    assert_eq!((got, lost), ((0..60).collect(), None));
}

#[test]
fn what_no_loss_explains_is_out_of_reach() {
    let sequencer: Sequencer<u64> = Sequencer::new(7, 100);
    assert!(!sequencer.is_out_of_reach(0, 4096));
    assert!(!sequencer.is_out_of_reach(100 + SEQUENCE_LEAP_MAX - 1, 1));
    assert!(sequencer.is_out_of_reach(100 + SEQUENCE_LEAP_MAX, 1));
    for first in [1 << 63, u64::MAX - 1, u64::MAX] {
        assert!(sequencer.is_out_of_reach(first, 1) && sequencer.is_out_of_reach(first, 4096));
    }
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
