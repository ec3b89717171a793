"""Laws of the window, without a network: the clock is a number, the channel a list."""

from __future__ import annotations

import random
from typing import Dict, List, Optional, Tuple

import pytest

from cogmap.window import Outgoing, Window, WindowLimits

#: What a watermark says: durable, applied, gap, term.
Heard = Tuple[int, int, Optional[Tuple[int, int]], int]

LIMITS = WindowLimits(capacity_samples=100, capacity_bytes=10_000, batch_samples=4)


def filled(count: int, limits: WindowLimits = LIMITS) -> Window:
    window = Window(limits)
    for seq in range(count):
        assert window.append(b"%d" % seq, 0.0) == seq
    return window


def take_all(window: Window, now: float) -> List[Outgoing]:
    batches: List[Outgoing] = []
    while True:
        outgoing = window.take(now)
        if outgoing is None:
            return batches
        batches.append(outgoing)


def test_a_full_batch_leaves_at_once_and_the_rest_after_the_delay() -> None:
    window = filled(6)
    assert take_all(window, 0.0) == [Outgoing(0, (b"0", b"1", b"2", b"3"), False)]
    assert window.wake_at() == pytest.approx(0.02)
    assert take_all(window, 0.019) == []
    assert take_all(window, 0.021) == [Outgoing(4, (b"4", b"5"), False)]


def test_hurry_sends_what_is_there_but_not_what_comes_later() -> None:
    window = filled(1)
    window.hurry()
    assert len(take_all(window, 0.0)) == 1
    window.append(b"1", 0.0)
    assert take_all(window, 0.0) == []


def test_batches_respect_the_byte_limit() -> None:
    window = Window(WindowLimits(capacity_bytes=10_000, batch_samples=4, batch_bytes=100))
    for _ in range(3):
        window.append(b"x" * 60, 0.0)
    window.append(b"x" * 500, 0.0)
    window.hurry()
    assert [len(batch.samples) for batch in take_all(window, 0.0)] == [1, 1, 1, 1]


def test_room_ends_by_samples_and_by_bytes_and_returns_with_the_watermark() -> None:
    window = filled(100)
    assert not window.has_room(1)
    take_all(window, 0.0)
    assert window.acknowledge(1, 1, None, 0.0)
    assert window.has_room(1)
    assert not window.has_room(10_000)
    assert window.acknowledge(100, 100, None, 0.0)
    assert window.has_room(1_000_000), "an empty window takes any sample"


def test_watermarks_out_of_order_or_beyond_what_was_sent_change_nothing() -> None:
    window = filled(8)
    take_all(window, 0.0)
    assert window.acknowledge(5, 5, None, 0.0)
    assert not window.acknowledge(3, 3, None, 0.0)
    assert not window.acknowledge(5, 5, None, 0.0)
    assert not window.acknowledge(9, 9, None, 0.0)
    assert (window.durable, window.pending) == (5, 3)


def test_a_gap_is_sent_again_at_once_but_not_again_and_again() -> None:
    window = filled(12)
    take_all(window, 0.0)
    window.acknowledge(2, 2, (3, 5), 1.0)
    assert take_all(window, 1.0) == [Outgoing(3, (b"3", b"4"), True)]
    window.acknowledge(2, 2, (3, 6), 1.1)
    assert take_all(window, 1.1) == []
    window.acknowledge(2, 2, (6, 7), 1.15)
    assert take_all(window, 1.15) == [Outgoing(6, (b"6",), True)], "another gap does not wait"


def test_a_gap_that_is_named_again_too_soon_is_sent_when_its_time_has_come() -> None:
    window = filled(12)
    take_all(window, 0.0)
    window.acknowledge(2, 2, (3, 5), 1.0)
    take_all(window, 1.0)
    window.acknowledge(2, 2, (3, 6), 1.1)
    assert window.wake_at() == pytest.approx(1.2)
    assert not window.watch(1.15) and take_all(window, 1.15) == []
    assert not window.watch(1.21)
    assert take_all(window, 1.21) == [Outgoing(3, (b"3", b"4", b"5"), True)]


def test_a_gap_that_closed_in_time_is_not_sent_twice() -> None:
    window = filled(12)
    take_all(window, 0.0)
    window.acknowledge(2, 2, (3, 5), 1.0)
    take_all(window, 1.0)
    window.acknowledge(2, 2, (3, 5), 1.1)
    window.acknowledge(5, 8, None, 1.15)
    assert not window.watch(1.3) and take_all(window, 1.3) == []


def test_a_service_that_forgot_what_it_had_applied_gets_it_again_at_once() -> None:
    window = filled(12)
    take_all(window, 0.0)
    window.acknowledge(4, 10, None, 0.1)
    assert take_all(window, 0.1) == []
    window.acknowledge(4, 4, None, 0.2)
    assert [batch.first_seq for batch in take_all(window, 0.2)] == [4]


def test_another_owner_gets_at_once_what_it_may_not_have() -> None:
    window = filled(12)
    take_all(window, 0.0)
    assert window.acknowledge(2, 10, None, 0.1, 3)
    assert take_all(window, 0.1) == []
    assert window.acknowledge(4, 4, None, 0.11, 4)
    assert [batch.first_seq for batch in take_all(window, 0.11)] == [4]
    # The next one within the interval of restarts, with all that was applied before.
    window.acknowledge(4, 12, None, 0.12, 5)
    assert [batch.first_seq for batch in take_all(window, 0.12)] == [4]
    # The same owner again is no other one.
    window.acknowledge(4, 12, None, 0.13, 5)
    assert take_all(window, 0.13) == []


def test_a_watermark_of_an_owner_before_counts_for_nothing() -> None:
    window = filled(12)
    take_all(window, 0.0)
    assert window.acknowledge(2, 2, None, 0.1, 4)
    assert not window.acknowledge(8, 8, (8, 9), 0.2, 3)
    assert window.durable == 2 and take_all(window, 0.2) == []
    assert window.acknowledge(8, 8, None, 0.3, 4)


def test_an_estimate_tells_of_another_owner_and_its_watermark_brings_the_rest_again() -> None:
    window = filled(12)
    take_all(window, 0.0)
    window.acknowledge(2, 2, None, 0.1, 3)
    assert [window.is_outdated(term) for term in (3, 4, 3, 4)] == [False, False, True, False]
    assert not window.acknowledge(8, 8, None, 0.2, 3)
    window.acknowledge(2, 2, None, 0.3, 4)
    assert [batch.first_seq for batch in take_all(window, 0.3)] == [2]


def test_what_is_durable_stays_so_in_a_later_term() -> None:
    window = filled(12)
    take_all(window, 0.0)
    window.acknowledge(8, 8, None, 0.1, 3)
    assert not window.acknowledge(4, 4, None, 0.2, 4)
    assert window.durable == 8


@pytest.mark.parametrize("gap", [(0, 2), (20, 30), (5, 5), (7, 6)])
def test_a_gap_outside_the_window_is_nothing(gap: Tuple[int, int]) -> None:
    window = filled(8)
    take_all(window, 0.0)
    window.acknowledge(2, 2, gap, 1.0)
    assert take_all(window, 1.0) == []


def test_a_gap_never_repeats_what_was_not_sent_yet() -> None:
    window = filled(6)
    window.take(0.0)
    window.acknowledge(0, 0, (2, 6), 0.0)
    assert window.take(0.0) == Outgoing(2, (b"2", b"3"), True)


def test_silence_asks_first_then_repeats_everything_and_then_waits_longer() -> None:
    window = filled(4)
    take_all(window, 0.0)
    assert not window.watch(0.99)
    assert window.watch(1.0)
    assert not window.watch(1.1)
    assert take_all(window, 1.19) == []
    assert not window.watch(1.2)
    assert [batch.first_seq for batch in take_all(window, 1.2)] == [0]
    assert not window.watch(3.1)
    assert window.watch(3.2), "two seconds after the repetition"


def test_an_answer_within_the_grace_spares_the_repetition() -> None:
    window = filled(4)
    take_all(window, 0.0)
    assert window.watch(1.0)
    window.acknowledge(4, 4, None, 1.05)
    assert not window.watch(9.0)
    assert take_all(window, 9.0) == []
    assert window.wake_at() is None


def test_the_wait_for_silence_is_bounded_and_progress_resets_it() -> None:
    window = filled(8)
    take_all(window, 0.0)
    now = 0.0
    asked: List[float] = []
    while len(asked) < 6:
        wake = window.wake_at()
        assert wake is not None
        now = max(now, wake)
        if window.watch(now):
            asked.append(now)
        take_all(window, now)
    waits = [round(later - earlier, 3) for earlier, later in zip(asked, asked[1:])]
    assert waits == [2.2, 4.2, 4.2, 4.2, 4.2]
    window.acknowledge(1, 1, None, now)
    assert not window.watch(now + 0.99)
    assert window.watch(now + 1.0)


def test_steady_sending_does_not_hide_the_silence() -> None:
    window = Window(LIMITS)
    asked: List[float] = []
    for eighth in range(16):
        window.append(b"x", eighth / 8)
        window.hurry()
        take_all(window, eighth / 8)
        if window.watch(eighth / 8):
            asked.append(eighth / 8)
    assert asked == [1.0]


def test_repeated_ranges_merge_and_shrink_with_the_watermark() -> None:
    window = filled(40, WindowLimits(batch_samples=40))
    take_all(window, 0.0)
    window.acknowledge(0, 0, (10, 20), 0.0)
    window.acknowledge(0, 0, (30, 35), 0.0)
    window.acknowledge(0, 0, (15, 25), 0.0)
    window.acknowledge(12, 12, None, 0.0)
    taken = [(batch.first_seq, len(batch.samples)) for batch in take_all(window, 0.0)]
    assert taken == [(12, 13), (30, 5)]


@pytest.mark.parametrize("name, value", [("batch_samples", 0), ("batch_samples", 5000)])
def test_senseless_limits_are_refused(name: str, value: int) -> None:
    with pytest.raises(ValueError):
        WindowLimits(**{name: value})


class LossyService:
    """Stands in for the service: puts samples in order, forgets what is not durable on a
    restart."""

    def __init__(self) -> None:
        self.waiting: Dict[int, bytes] = {}
        self.journal: List[bytes] = []
        self.durable = 0
        self.term = 0

    def receive(self, batch: Outgoing) -> None:
        for seq, sample in enumerate(batch.samples, batch.first_seq):
            if seq >= len(self.journal) and seq < len(self.journal) + 64:
                self.waiting[seq] = sample
        while len(self.journal) in self.waiting:
            self.journal.append(self.waiting.pop(len(self.journal)))

    def commit(self) -> None:
        self.durable = len(self.journal)

    def restart(self) -> None:
        del self.journal[self.durable :]
        self.waiting.clear()

    def watermark(self) -> Heard:
        gap = (len(self.journal), min(self.waiting)) if self.waiting else None
        return self.durable, len(self.journal), gap, self.term


@pytest.mark.parametrize("seed", range(60))
def test_every_sample_arrives_once_and_in_order_through_a_bad_channel(seed: int) -> None:
    """Messages of both directions are lost, repeated, delayed and overtake each other, the service
    restarts: at the end it has exactly what was appended, and the window is empty."""
    chance = random.Random(seed)
    total = chance.randrange(1, 400)
    loss = chance.choice([0.0, 0.1, 0.5, 0.8])
    limits = WindowLimits(
        capacity_samples=chance.choice([1, 7, 100]), batch_samples=chance.choice([1, 3, 64])
    )
    window, service = Window(limits), LossyService()
    there: List[Tuple[float, int, Outgoing]] = []
    back: List[Tuple[float, Heard]] = []
    appended, now, serial = 0, 0.0, 0

    def answer(at: float) -> None:
        if chance.random() >= loss:
            back.append((at + chance.uniform(0, 0.3), service.watermark()))

    while service.durable < total or window.pending:
        assert now < 20_000, f"seed {seed} stands still at {service.durable} of {total}"
        while appended < total and window.has_room(8):
            window.append(b"%d" % appended, now)
            appended += 1
        for batch in take_all(window, now):
            assert 1 <= len(batch.samples) <= 64
            for _ in range(chance.choice([1, 1, 1, 2])):
                if chance.random() >= loss:
                    serial += 1
                    there.append((now + chance.uniform(0, 0.3), serial, batch))
        if window.watch(now):
            answer(now)
        now += chance.choice([0.001, 0.01, 0.1])
        for item in sorted(item for item in there if item[0] <= now):
            there.remove(item)
            service.receive(item[2])
            if chance.random() < 0.5:
                service.commit()
            answer(now)
        if chance.random() < 0.01:
            service.restart()
            # An embedded store has one owner; one on object storage has another one from now on.
            service.term += seed % 2
            answer(now)
        elif chance.random() < 0.1:
            service.commit()
        for arrival in [item for item in back if item[0] <= now]:
            back.remove(arrival)
            durable, applied, gap, term = arrival[1]
            window.acknowledge(durable, applied, gap, now, term)
        assert window.durable <= service.durable, "only the service's word empties the window"

    assert service.journal == [b"%d" % seq for seq in range(total)]
    assert window.pending == 0 and window.wake_at() is None


def test_a_service_that_is_back_is_asked_and_gets_what_its_watermark_does_not_cover() -> None:
    window = filled(12)
    take_all(window, 0.0)
    window.acknowledge(2, 2, None, 0.0)
    assert window.rejoin(5.0), "ask"
    assert take_all(window, 5.0) == [], "and send nothing before the answer"
    assert window.acknowledge(8, 8, None, 5.05)
    assert [(batch.first_seq, len(batch.samples)) for batch in take_all(window, 5.05)] == [(8, 4)]
    assert not window.watch(5.1), "the next silence begins then"
    assert window.wake_at() == pytest.approx(6.05)


def test_a_service_that_is_back_and_does_not_answer_gets_everything_soon() -> None:
    window = filled(4)
    take_all(window, 0.0)
    assert window.rejoin(5.0)
    assert not window.watch(5.1) and take_all(window, 5.1) == []
    assert not window.watch(5.2)
    assert [batch.first_seq for batch in take_all(window, 5.2)] == [0]


def test_a_service_that_is_back_is_not_asked_when_everything_is_acknowledged() -> None:
    window = filled(4)
    take_all(window, 0.0)
    window.acknowledge(4, 4, None, 0.0)
    assert not window.rejoin(5.0)
    assert take_all(window, 5.0) == []
