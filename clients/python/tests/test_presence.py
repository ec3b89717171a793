"""A robot whose space is not there, and one whose service goes and comes back."""

from __future__ import annotations

import threading
import time
from typing import Iterator

import pytest

import cogmap
from cogmap import window
from cogmap.problem import Problem
from stand_in import StandIn
from test_robot import ada, eventually, levels


@pytest.fixture
def service() -> Iterator[StandIn]:
    with StandIn() as service:
        yield service


def test_a_misspelt_space_is_an_error_at_once(service: StandIn) -> None:
    began = time.monotonic()
    with pytest.raises(cogmap.ApiError) as raised:
        cogmap.Robot("labb", "ada", connect=service.endpoint)
    assert time.monotonic() - began < 5.0
    assert (raised.value.status, raised.value.kind) == (404, "/problems/unknown-space")
    where = f"cogmap/labb/query/watermark at {service.endpoint}"
    assert str(raised.value) == f"404 unknown space: no such space ({where})"
    threads = [thread.name for thread in threading.enumerate()]
    assert not [name for name in threads if name.startswith("cogmap-labb")]


def test_an_agent_that_is_not_known_yet_is_no_error(service: StandIn) -> None:
    service.problem = Problem("/problems/unknown-agent", "unknown agent", 404, "no agent 'ada'")
    with ada(service) as robot:
        robot.marker("x")
        robot.flush()


def test_a_service_that_is_busy_is_asked_again(service: StandIn) -> None:
    service.problem = Problem("/problems/busy", "busy", 503, "too much is under way")
    with ada(service) as robot:
        robot.marker("x")
        robot.flush()


def test_a_space_that_is_deleted_is_an_error_until_it_is_there_again(service: StandIn) -> None:
    with ada(service) as robot:
        robot.marker("x")
        robot.flush()
        service.loses = lambda number: True
        service.problem = Problem("/problems/unknown-space", "unknown space", 404, "no space 'lab'")
        robot.marker("y")
        with pytest.raises(cogmap.ApiError, match="no space 'lab'"):
            robot.flush(30.0)
        with pytest.raises(cogmap.ApiError, match="no space 'lab'"):
            robot.marker("z")
        service.loses, service.problem = (lambda number: False), None
        assert eventually(lambda: robot.pending == 0)
        robot.marker("z")
    assert [sample.body for sample in service.journal] == [cogmap.Marker(label) for label in "xyz"]


def test_a_space_that_is_there_again_is_noticed_although_nothing_is_outstanding(
    service: StandIn,
) -> None:
    with ada(service) as robot:
        robot.marker("x")
        robot.flush()
        problem = Problem("/problems/unknown-space", "unknown space", 404, "no space 'lab'")
        # As when an answer that was on its way comes after the space is there again.
        robot._run._take_problem(problem)
        robot._run._wake.set()
        with pytest.raises(cogmap.ApiError):
            robot.marker("y")
        assert eventually(lambda: not raises(robot))
        robot.marker("y")


def raises(robot: cogmap.Robot) -> bool:
    try:
        robot.estimate(0.0)
    except cogmap.ApiError:
        return True
    return False


def test_a_service_that_is_not_there_is_told_with_key_and_address() -> None:
    service = StandIn()
    try:
        robot = ada(service, match_timeout_s=0.1, window_samples=1, send_timeout_s=0.2)
        robot.marker("x")
        told = f": no service listens to cogmap/lab/ada/samples at {service.endpoint}"
        with pytest.raises(
            cogmap.Timeout, match=f"^1 samples of agent ada are not durable .*{told}$"
        ):
            robot.flush(0.3)
        with pytest.raises(cogmap.Timeout, match=f"^no estimate of agent ada .*{told}$"):
            robot.estimate(0.1)
        with pytest.raises(cogmap.WindowFull, match=told):
            robot.marker("y")
        with pytest.raises(cogmap.Timeout, match=told):
            robot.close(0.1)
    finally:
        service.close()


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """No silence is long enough to send anything again."""
    for name in ("silence_s", "silence_max_s"):
        monkeypatch.setattr(window.WindowLimits, name, 3600.0)
    defaults = list(window.WindowLimits.__init__.__defaults__ or ())
    assert 1.0 in defaults and 4.0 in defaults
    patched = tuple(3600.0 if value in (1.0, 4.0) else value for value in defaults)
    monkeypatch.setattr(window.WindowLimits.__init__, "__defaults__", patched)


@pytest.mark.usefixtures("patient")
def test_a_service_that_is_back_gets_at_once_what_is_outstanding() -> None:
    first = StandIn()
    first.listen()
    with ada(first) as robot:
        robot.level("n", 0)
        robot.flush()
        journal, session = list(first.journal), first.session
        first.close()
        for value in range(1, 200):
            robot.level("n", value)
        assert eventually(lambda: robot._run.window.sent == 200)
        second = StandIn(first.port)
        second.journal, second.session = journal, session
        second.listen()
        try:
            robot.flush(30.0)
            assert levels(second.journal) == list(range(200))
        finally:
            robot.close()
            second.close()


@pytest.mark.usefixtures("patient")
def test_a_service_that_starts_late_gets_at_once_what_was_sent_before() -> None:
    service = StandIn()
    try:
        with ada(service, match_timeout_s=0.1) as robot:
            robot.level("n", 1)
            assert eventually(lambda: robot._run.window.sent == 1)
            service.listen()
            robot.flush(30.0)
        assert levels(service.journal) == [1]
    finally:
        service.close()


def test_an_estimate_of_a_sample_is_waited_for(service: StandIn) -> None:
    with ada(service, batch_delay_s=0.2) as robot:
        seqs = [robot.level("n", value) for value in range(3)]
        assert robot.estimate(seq=seqs[0]).seq >= 0
        last = robot.level("n", 3)
        assert robot.estimate().seq < last
        assert robot.estimate(seq=last).seq == last
        for beyond in (last + 1, -1):
            with pytest.raises(cogmap.InvalidValue, match="^seq: expected 0 to 3, not "):
                robot.estimate(seq=beyond)


def test_an_estimate_that_does_not_come_says_which(service: StandIn) -> None:
    service.loses = lambda number: True
    with pytest.raises(cogmap.Timeout):
        with ada(service) as robot:
            with pytest.raises(cogmap.InvalidValue, match="there is none"):
                robot.estimate(seq=0)
            robot.marker("x")
            with pytest.raises(
                cogmap.Timeout, match="^no estimate of sample 0 of agent ada within"
            ):
                robot.estimate(0.1, seq=0)
            robot.close(0.1)


def test_a_robot_shows_where_it_is_connected(service: StandIn) -> None:
    with ada(service, session_id=7) as robot:
        shown = f"<Robot ada of lab at {service.endpoint}, session 7, "
        assert repr(robot) == f"{shown}0 samples pending>"
    assert repr(robot) == f"{shown}closed>"
