"""Stamps: those of the clock, and what is odd about those that are given."""

from __future__ import annotations

import warnings
from typing import List, Optional

import pytest

import cogmap
from cogmap.clock import SessionClock
from stand_in import StandIn

NOW_NS = 1_800_000_000_000_000_000
STEP = cogmap.Increment((0.1, 0, 0))
TURN = cogmap.Velocity((0.1, 0, 0), (0, 0, 0), 0.1)
MARK = cogmap.Marker("x")


def oddities(clock: SessionClock, *calls: object) -> List[str]:
    """What is told of `(body, stamp_ns, now_ns)` calls."""
    told = (clock.oddity(*call) for call in calls)  # type: ignore[misc]
    return [one for one in told if one is not None]


@pytest.mark.parametrize("body, step_s", [(STEP, 0.01), (TURN, 0.1), (TURN, 0.09)])
def test_a_robot_in_real_time_is_not_odd(body: cogmap.SampleBody, step_s: float) -> None:
    clock = SessionClock()
    calls = [(body, None, NOW_NS + int(step * step_s * 1e9)) for step in range(10_000)]
    assert oddities(clock, *calls) == []


@pytest.mark.parametrize("body, what", [(TURN, "motion of 2"), (STEP, "motion of 1")])
def test_simulated_time_without_stamps_is_told_once(body: cogmap.SampleBody, what: str) -> None:
    clock = SessionClock()
    calls = [(body, None, NOW_NS + step * 20_000) for step in range(10_000)]
    (told,) = oddities(clock, *calls)
    assert told.startswith(what) and "faster than real time" in told and "stamp_ns" in told


def test_simulated_time_with_stamps_is_not_odd() -> None:
    clock = SessionClock()
    assert oddities(clock, *[(TURN, step * 10**8, NOW_NS) for step in range(1000)]) == []


def test_what_is_felt_fast_is_not_odd() -> None:
    level = cogmap.Level("touch", 1)
    assert oddities(SessionClock(), *[(level, None, NOW_NS) for _ in range(1000)]) == []


@pytest.mark.parametrize("first, second", [(None, 5), (5, None)])
def test_two_clocks_are_told_once(first: Optional[int], second: Optional[int]) -> None:
    clock = SessionClock()
    calls = [(MARK, stamp, NOW_NS) for stamp in (first, second, first, second)]
    (told,) = oddities(clock, *calls)
    assert "are mixed" in told and "-1.8e+09 s from the system's clock" in told


def test_own_stamps_of_the_system_clock_may_be_mixed_with_none() -> None:
    calls = [(MARK, stamp, NOW_NS) for stamp in (None, NOW_NS - 10**8, None, NOW_NS + 10**8)]
    assert oddities(SessionClock(), *calls) == []


def test_stamps_never_run_backwards_by_themselves() -> None:
    clock = SessionClock()
    clock.take(0, NOW_NS)
    assert clock.stamp(NOW_NS - 5) == NOW_NS
    assert clock.stamp(NOW_NS + 5) == NOW_NS + 5


def test_the_first_of_each_run_of_stamps_that_run_backwards_is_remembered() -> None:
    clock = SessionClock()
    for seq, stamp_ns in enumerate([-5, 10, 9, 8, 11, 7]):
        clock.take(seq, stamp_ns)
    assert clock.backwards == {2: "stamp 9 before 10 [ns]", 5: "stamp 7 before 11 [ns]"}
    for seq in range(1000):
        clock.take(2 * seq, 20)
        clock.take(2 * seq + 1, 19)
    assert len(clock.backwards) == 256


def test_a_warning_names_the_robot_and_the_callers_line() -> None:
    with StandIn() as service, cogmap.Robot("lab", "ada", connect=service.endpoint) as robot:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            for step in range(100):
                robot.velocity([1, 0, 0], [0, 0, 0], 0.1)
            robot.send([cogmap.Sample(5, cogmap.Marker("x"))])
            robot.marker("y")
    assert [(one.category, one.filename) for one in caught] == [(cogmap.ClockWarning, __file__)] * 2
    assert all(str(one.message).startswith("robot ada: ") for one in caught)
