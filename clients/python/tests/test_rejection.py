"""Refused samples are told in ranges, each sample once."""

from __future__ import annotations

import logging
import random
from typing import List, Set, Tuple

import pytest

import cogmap
from cogmap.rejection import Rejections, sentences
from stand_in import StandIn

LATE = cogmap.SkipReason.TIME_BACKWARDS
LOST = cogmap.SkipReason.LOST


def refused(start: int, stop: int, reason: cogmap.SkipReason = LATE) -> cogmap.Rejection:
    return cogmap.Rejection(cogmap.SeqRange(start, stop), reason)


def test_a_range_that_grows_from_watermark_to_watermark_is_told_once() -> None:
    rejections = Rejections()
    for stop in range(50, 66):
        rejections.take((refused(3, 4), refused(49, stop)), now=stop * 0.01)
        assert rejections.tell(now=stop * 0.01) == ()
    assert rejections.tell_at() == pytest.approx(0.9)
    assert rejections.tell(now=0.91) == (refused(3, 4), refused(49, 65))
    rejections.take((refused(3, 4), refused(49, 65)), now=1.0)
    assert rejections.tell_at() is None
    rejections.take((refused(3, 4), refused(49, 70)), now=1.0)
    assert rejections.tell(now=1.0, at_once=True) == (refused(65, 70),)
    assert rejections.ranges == (refused(3, 4), refused(49, 70))


def test_single_samples_are_one_range_and_another_reason_is_another() -> None:
    rejections = Rejections()
    rejections.take(tuple(refused(seq, seq + 1) for seq in (7, 5, 6)), now=0)
    rejections.take((refused(8, 10, LOST),), now=0)
    assert rejections.ranges == (refused(5, 8), refused(8, 10, LOST))
    assert [rejections.reason_of(seq) for seq in (4, 5, 7, 8, 10)] == [None, LATE, LATE, LOST, None]


def test_what_is_refused_again_and_again_is_told_less_and_less_often() -> None:
    rejections = Rejections()
    told_at: List[float] = []
    for step in range(100_000):
        now = step * 0.01
        rejections.take((refused(0, step + 1),), now)
        if rejections.tell(now):
            told_at.append(now)
    assert told_at[0] == pytest.approx(1.0, abs=0.02)
    assert len(told_at) < 25, "in a thousand seconds"


@pytest.mark.parametrize("seed", range(20))
def test_every_sample_is_told_once_whatever_the_watermarks_say(seed: int) -> None:
    chance = random.Random(seed)
    reasons = {seq: chance.choice((LATE, LOST, None)) for seq in range(200)}
    rejections, now = Rejections(), 0.0
    told: List[cogmap.Rejection] = []
    latest: List[cogmap.Rejection] = []
    for seq, reason in reasons.items():
        if reason is not None:
            latest.append(refused(seq, seq + 1, reason))
        if chance.random() < 0.5:
            rejections.take(tuple(latest[-16:]), now)
        now += chance.choice((0.0, 0.1, 0.4))
        told += rejections.tell(now)
    rejections.take(tuple(latest[-16:]), now)
    told += rejections.tell(now, at_once=True)
    samples: List[Tuple[int, cogmap.SkipReason]] = [
        (seq, one.reason) for one in told for seq in range(one.range.start, one.range.stop)
    ]
    assert len(samples) == len(set(samples))
    assert set(samples) == {(seq, reason) for seq, reason in reasons.items() if reason is not None}


def test_many_ranges_are_one_sentence_for_each_reason() -> None:
    stamps = {49: "stamp 5 before 10 [ns]", 99: "not of these"}
    assert sentences([refused(49, 65)], stamps) == [
        "samples 49 to 64 refused: time_backwards (stamp 5 before 10 [ns])"
    ]
    assert sentences([refused(7, 8, LOST)], {}) == ["sample 7 refused: lost"]
    odd = [refused(seq, seq + 1) for seq in range(1, 64, 2)]
    assert sentences([*odd, refused(80, 90, LOST)], {}) == [
        "32 samples from 1 to 63 refused: time_backwards",
        "samples 80 to 89 refused: lost",
    ]


def test_a_robot_says_one_line_for_a_range(caplog: pytest.LogCaptureFixture) -> None:
    heard: List[cogmap.Rejection] = []
    told: Set[str] = set()
    with caplog.at_level(logging.WARNING, "cogmap"), StandIn() as service:
        with cogmap.Robot("lab", "ada", connect=service.endpoint, batch_samples=1) as robot:
            robot.on_rejection(heard.append)
            robot.marker("on time", stamp_ns=1000)
            for seq in range(1, 17):
                service.rejected = (refused(1, seq + 1),)
                robot.marker("late", stamp_ns=990 - seq)
                robot.flush()
        told = {record.getMessage() for record in caplog.records}
    assert [one.range.start for one in heard][0] == 1 and heard[-1].range.stop == 17
    assert sum(one.range.stop - one.range.start for one in heard) == 16
    assert len(caplog.records) <= 3, "not a line for each sample, however slow the machine is"
    if len(told) == 1:
        assert told == {"ada: samples 1 to 16 refused: time_backwards (stamp 989 before 1000 [ns])"}
