//! The window against a model of the service, over a channel that loses, repeats and reorders.

use std::collections::BTreeMap;
use std::time::Duration;

use cogmap_proto::{Marker, Sample, SampleBody, SeqRange, Watermark};

use super::{GAP_INTERVAL, GRACE, Heard, SILENCE, SILENCE_MAX, Window, WindowLimits};

const SESSION: u64 = 7;
const LIMITS: WindowLimits = WindowLimits {
    capacity_samples: 300,
    capacity_bytes: 1 << 20,
    batch_samples: 16,
    batch_bytes: 2000,
    batch_delay: Duration::from_millis(20),
};

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

/// A sample that tells its own number.
fn sample(seq: u64) -> Sample {
    Sample {
        stamp_ns: i64::try_from(seq).expect("test numbers are small"),
        body: SampleBody::Marker(Marker {
            label: String::new(),
            ends_trip: false,
        }),
    }
}

fn watermark(durable: u64, gap: Option<(u64, u64)>) -> Watermark {
    Watermark {
        session: SESSION,
        durable,
        applied: durable,
        gap: gap.map(|(from, to)| SeqRange { from, to }),
        rejected: Vec::new(),
        term: 0,
    }
}

/// A window that has sent `count` samples at time zero.
fn window_sent(count: u64) -> Window {
    let mut window = Window::new(SESSION, LIMITS);
    for seq in 0..count {
        assert_eq!(window.push(sample(seq), 10, ms(0)), seq);
    }
    window.hurry();
    take_all(&mut window, ms(0));
    window
}

/// Takes everything that is due: `(first, beyond, repeated)`.
fn take_all(window: &mut Window, now: Duration) -> Vec<(u64, u64, bool)> {
    std::iter::from_fn(|| window.take(now))
        .map(|run| (run.first_seq, run.first_seq + run.len as u64, run.repeated))
        .collect()
}

#[test]
fn a_batch_leaves_when_it_is_full_or_old() {
    let mut window = Window::new(SESSION, LIMITS);
    for seq in 0..18 {
        window.push(sample(seq), 10, ms(5));
    }
    assert_eq!(take_all(&mut window, ms(5)), [(0, 16, false)]);
    assert_eq!(window.wake_at(), Some(ms(25)));
    assert_eq!(take_all(&mut window, ms(24)), []);
    assert_eq!(take_all(&mut window, ms(25)), [(16, 18, false)]);
}

#[test]
fn a_batch_is_cut_at_its_byte_limit_but_never_empty() {
    let mut window = Window::new(SESSION, LIMITS);
    for (seq, bytes) in [(0, 1500), (1, 500), (2, 1), (3, 5000), (4, 1)] {
        window.push(sample(seq), bytes, ms(0));
    }
    window.hurry();
    let runs = take_all(&mut window, ms(0));
    assert_eq!(
        runs,
        [(0, 2, false), (2, 3, false), (3, 4, false), (4, 5, false)]
    );
}

#[test]
fn a_gap_is_sent_again_at_once_and_then_at_most_every_interval() {
    let mut window = window_sent(48);
    let gap = watermark(10, Some((10, 20)));
    window.hear(&gap, ms(50));
    assert_eq!(take_all(&mut window, ms(50)), [(10, 20, true)]);
    window.hear(&gap, ms(60));
    window.poll(ms(60));
    assert_eq!(take_all(&mut window, ms(60)), []);
    // The second report is not forgotten: it is acted on when the interval is over, once.
    let again_at = ms(50) + GAP_INTERVAL;
    assert_eq!(window.wake_at(), Some(again_at));
    window.poll(again_at);
    assert_eq!(take_all(&mut window, again_at), [(10, 20, true)]);
    window.poll(again_at + GAP_INTERVAL);
    assert_eq!(take_all(&mut window, again_at + GAP_INTERVAL), []);
}

#[test]
fn another_gap_does_not_wait_for_the_interval() {
    let mut window = window_sent(48);
    window.hear(&watermark(10, Some((10, 20))), ms(50));
    take_all(&mut window, ms(50));
    window.hear(&watermark(30, Some((30, 31))), ms(51));
    assert_eq!(take_all(&mut window, ms(51)), [(30, 31, true)]);
}

#[test]
fn silence_asks_then_sends_everything_again_and_backs_off() {
    let mut window = window_sent(10);
    let mut now = ms(0);
    for wait in [SILENCE, 2 * SILENCE, SILENCE_MAX, SILENCE_MAX] {
        assert_eq!(window.wake_at(), Some(now + wait));
        assert!(!window.poll(now + wait.checked_sub(ms(1)).expect("waits are long")));
        assert!(window.poll(now + wait));
        now += wait + GRACE;
        assert!(!window.poll(now));
        assert_eq!(take_all(&mut window, now), [(0, 10, true)]);
    }
    window.hear(&watermark(4, None), now);
    assert_eq!(window.wake_at(), Some(now + SILENCE));
    window.hear(&watermark(10, None), now);
    assert_eq!(window.wake_at(), None);
    assert!(!window.poll(now + SILENCE_MAX));
}

#[test]
fn an_answer_to_the_question_stops_the_repetition() {
    let mut window = window_sent(10);
    assert!(window.poll(SILENCE));
    window.hear(&watermark(6, None), SILENCE + ms(5));
    window.poll(SILENCE + GRACE);
    assert_eq!(take_all(&mut window, SILENCE + GRACE), []);
}

#[test]
fn a_restarted_service_gets_everything_again_at_once() {
    let mut window = window_sent(40);
    let mut before = watermark(10, None);
    before.applied = 40;
    window.hear(&before, ms(10));
    assert_eq!(window.applied(), 40);
    window.hear(&watermark(12, None), ms(500));
    assert_eq!(take_all(&mut window, ms(500)), [(12, 40, true)]);
}

/// A watermark of another owner: what it applied, and nothing else, is durable.
fn watermark_of(term: u64, durable: u64) -> Watermark {
    Watermark {
        term,
        ..watermark(durable, None)
    }
}

#[test]
fn another_owner_gets_what_it_may_not_have_at_once() {
    let mut window = window_sent(40);
    let mut before = watermark_of(3, 10);
    before.applied = 30;
    assert_eq!(window.hear(&before, ms(10)), Heard::Current);
    assert_eq!(take_all(&mut window, ms(10)), []);
    assert_eq!(window.hear(&watermark_of(4, 10), ms(11)), Heard::Current);
    assert_eq!((window.durable(), window.applied()), (10, 10));
    assert_eq!(take_all(&mut window, ms(11)), [(10, 40, true)]);
    // The next one within the interval of restarts, with all that was applied before.
    let mut next = watermark_of(5, 12);
    next.applied = 20;
    assert_eq!(window.hear(&next, ms(12)), Heard::Current);
    assert_eq!(take_all(&mut window, ms(12)), [(12, 40, true)]);
    // The same owner again is no other one.
    next.applied = 40;
    assert_eq!(window.hear(&next, ms(13)), Heard::Current);
    assert_eq!(take_all(&mut window, ms(13)), []);
}

#[test]
fn a_watermark_of_an_owner_before_counts_for_nothing() {
    let mut window = window_sent(40);
    assert_eq!(window.hear(&watermark_of(4, 10), ms(1)), Heard::Current);
    let mut late = watermark_of(3, 30);
    late.gap = Some(SeqRange { from: 30, to: 35 });
    assert_eq!(window.hear(&late, ms(2)), Heard::Stale);
    late.session = SESSION + 1;
    assert_eq!(window.hear(&late, ms(3)), Heard::Stale);
    assert_eq!((window.durable(), window.applied()), (10, 10));
    assert_eq!(take_all(&mut window, ms(3)), []);
    assert_eq!(window.hear(&watermark_of(4, 30), ms(4)), Heard::Current);
}

#[test]
fn an_estimate_tells_of_another_owner_and_its_watermark_brings_the_rest_again() {
    let mut window = window_sent(40);
    assert_eq!(window.hear(&watermark_of(3, 10), ms(1)), Heard::Current);
    assert!(!window.is_outdated(3) && !window.is_outdated(4) && window.is_outdated(3));
    assert_eq!(window.hear(&watermark_of(3, 20), ms(2)), Heard::Stale);
    assert_eq!(window.hear(&watermark_of(4, 10), ms(3)), Heard::Current);
    assert_eq!(take_all(&mut window, ms(3)), [(10, 40, true)]);
}

#[test]
fn what_is_durable_stays_so_in_a_later_term() {
    let mut window = window_sent(40);
    assert_eq!(window.hear(&watermark_of(3, 20), ms(1)), Heard::Current);
    assert_eq!(window.hear(&watermark_of(4, 10), ms(2)), Heard::Stale);
    assert_eq!(window.durable(), 20);
}

#[test]
fn old_watermarks_and_old_sessions_change_nothing() {
    let mut window = window_sent(40);
    window.hear(&watermark(20, None), ms(1));
    assert_eq!(
        window.hear(&watermark(10, Some((10, 11))), ms(2)),
        Heard::Stale
    );
    let mut earlier = watermark(30, None);
    earlier.session = SESSION - 1;
    assert_eq!(window.hear(&earlier, ms(3)), Heard::Stale);
    assert_eq!((window.durable(), window.pending()), (20, 20));
    assert_eq!(take_all(&mut window, ms(3)), []);
}

#[test]
fn a_later_session_takes_over() {
    let mut window = window_sent(40);
    let mut later = watermark(0, None);
    later.session = SESSION + 1;
    assert_eq!(window.hear(&later, ms(1)), Heard::TakenOver);
    assert_eq!(window.durable(), 0);
}

#[test]
fn a_watermark_beyond_what_was_sent_is_of_another_run_with_this_number() {
    let mut window = window_sent(10);
    // Taken in, but not sent: no watermark of this run can cover it.
    window.push(sample(10), 10, ms(1));
    let mut applied = watermark(4, None);
    applied.applied = 11;
    for foreign in [applied, watermark(11, None), watermark(u64::MAX, None)] {
        assert_eq!(window.hear(&foreign, ms(1)), Heard::TakenOver);
        assert_eq!((window.durable(), window.pending()), (0, 11));
    }
    assert_eq!(window.hear(&watermark(10, None), ms(1)), Heard::Current);
    assert_eq!((window.durable(), window.pending()), (10, 1));
}

#[test]
fn before_the_first_sending_any_sample_of_this_session_is_of_another_run() {
    let mut window = Window::new(SESSION, LIMITS);
    window.push(sample(0), 10, ms(0));
    assert_eq!(window.hear(&watermark(0, None), ms(1)), Heard::Current);
    assert_eq!(window.hear(&watermark(1, None), ms(1)), Heard::TakenOver);
    assert_eq!(window.pending(), 1);
}

#[test]
fn a_gap_beyond_what_was_sent_is_cut() {
    let mut window = window_sent(10);
    window.hear(&watermark(0, Some((5, u64::MAX))), ms(1));
    assert_eq!(take_all(&mut window, ms(1)), [(5, 10, true)]);
    window.hear(&watermark(0, Some((9, 3))), ms(2));
    assert_eq!(take_all(&mut window, ms(2)), []);
}

#[test]
fn a_full_window_has_no_room_until_a_watermark_makes_some() {
    let mut window = Window::new(SESSION, LIMITS);
    assert!(
        window.has_room(usize::MAX),
        "an empty window takes any sample"
    );
    for seq in 0..300 {
        assert!(window.has_room(10));
        window.push(sample(seq), 10, ms(0));
    }
    assert!(!window.has_room(10));
    window.hurry();
    take_all(&mut window, ms(0));
    window.hear(&watermark(1, None), ms(1));
    assert!(window.has_room(10));
    window.push(sample(300), (1 << 20) - 2990, ms(1));
    window.hear(&watermark(100, None), ms(2));
    assert!(!window.has_room(2000), "bytes are bounded too");
    assert!(window.has_room(500));
}

/// `SplitMix64` (Steele, Lea & Flood 2014, Fig. 17).
struct Generator(u64);

impl Generator {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound
    }

    fn chance(&mut self, percent: u64) -> bool {
        self.below(100) < percent
    }
}

/// One direction of a link that loses, repeats and delays messages by up to `delay_ms`, so that
/// they overtake each other.
struct Channel<M> {
    under_way: BTreeMap<(u64, u64), M>,
    count: u64,
    loss_percent: u64,
    repeat_percent: u64,
    delay_ms: u64,
}

impl<M: Clone> Channel<M> {
    fn new(generator: &mut Generator) -> Self {
        Self {
            under_way: BTreeMap::new(),
            count: 0,
            loss_percent: generator.below(40),
            repeat_percent: generator.below(30),
            delay_ms: 1 + generator.below(40),
        }
    }

    fn put(&mut self, message: &M, now_ms: u64, generator: &mut Generator) {
        let copies = 1 + u64::from(generator.chance(self.repeat_percent));
        for _ in 0..copies {
            if !generator.chance(self.loss_percent) {
                let at = now_ms + 1 + generator.below(self.delay_ms);
                self.under_way.insert((at, self.count), message.clone());
                self.count += 1;
            }
        }
    }

    fn arrived(&mut self, now_ms: u64) -> Vec<M> {
        let later = self.under_way.split_off(&(now_ms + 1, 0));
        std::mem::replace(&mut self.under_way, later)
            .into_values()
            .collect()
    }
}

/// What the service promises: applies in order, holds a bounded number of early samples, makes
/// durable in groups, and after a crash knows only what was durable.
#[derive(Default)]
struct Service {
    journal: Vec<u64>,
    durable: u64,
    early: BTreeMap<u64, u64>,
    term: u64,
}

impl Service {
    const EARLY_MAX: usize = 200;

    fn applied(&self) -> u64 {
        self.journal.len() as u64
    }

    fn take(&mut self, batch: &[(u64, u64)]) {
        for &(seq, content) in batch {
            let early = seq > self.applied() && self.early.len() < Self::EARLY_MAX;
            if seq == self.applied() || early {
                self.early.insert(seq, content);
            }
            while let Some(content) = self.early.remove(&self.applied()) {
                self.journal.push(content);
            }
        }
    }

    fn crash(&mut self) {
        self.journal
            .truncate(usize::try_from(self.durable).expect("small"));
        self.early.clear();
    }

    fn watermark(&self) -> Watermark {
        Watermark {
            session: SESSION,
            durable: self.durable,
            applied: self.applied(),
            gap: self.early.keys().next().map(|&to| SeqRange {
                from: self.applied(),
                to,
            }),
            rejected: Vec::new(),
            term: self.term,
        }
    }
}

/// Sends `total` samples; returns what the service journalled.
fn run(seed: u64, total: u64) -> Vec<u64> {
    let mut generator = Generator(seed);
    let mut window = Window::new(SESSION, LIMITS);
    let mut service = Service::default();
    let mut there: Channel<Vec<(u64, u64)>> = Channel::new(&mut generator);
    let mut back: Channel<Watermark> = Channel::new(&mut generator);
    let commit_ms = 1 + generator.below(30);
    let mut crashes = generator.below(3);
    for now_ms in 0..600_000 {
        let now = ms(now_ms);
        for _ in 0..generator.below(6) {
            let next = window.next();
            if next < total && window.has_room(10) {
                window.push(sample(next), 10, now);
            }
        }
        assert!(window.pending() <= LIMITS.capacity_samples as u64);
        // The sending thread: it looks only when the window said that it should.
        if window.wants_sender(now) || window.wake_at().is_some_and(|at| at <= now) {
            let ask = window.poll(now);
            while let Some(run) = window.take(now) {
                assert!(run.len <= 64, "seed {seed}: batch of {}", run.len);
                let seqs = run.first_seq..;
                let contents = window.samples(run).map(|s| s.stamp_ns.cast_unsigned());
                let batch: Vec<_> = seqs.zip(contents).collect();
                there.put(&batch, now_ms, &mut generator);
            }
            if ask {
                back.put(&service.watermark(), now_ms, &mut generator);
            }
        }
        for batch in there.arrived(now_ms) {
            let known = service.watermark().gap;
            service.take(&batch);
            let gap = service.watermark().gap;
            if gap.is_some() && gap != known {
                back.put(&service.watermark(), now_ms, &mut generator);
            }
        }
        if now_ms % commit_ms == 0 && service.durable < service.applied() {
            service.durable = service.applied();
            back.put(&service.watermark(), now_ms, &mut generator);
        }
        if crashes > 0 && generator.chance(1) && generator.chance(10) {
            crashes -= 1;
            service.crash();
            // An embedded store has one owner; one on object storage has another one from now on.
            service.term += seed % 2;
            back.put(&service.watermark(), now_ms, &mut generator);
        }
        for watermark in back.arrived(now_ms) {
            assert_ne!(window.hear(&watermark, now), Heard::TakenOver);
            assert!(window.durable() <= service.durable, "seed {seed}");
        }
        if window.durable() == total {
            return service.journal;
        }
    }
    panic!(
        "seed {seed}: only {} of {total} acknowledged",
        window.durable()
    );
}

#[test]
fn every_sample_arrives_exactly_once_over_any_channel() {
    const TOTAL: u64 = 2000;
    for seed in 0..200 {
        let journal = run(seed, TOTAL);
        assert!(
            journal.iter().copied().eq(0..TOTAL),
            "seed {seed}: the journal is not the samples in order"
        );
    }
}
