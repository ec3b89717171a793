"""What an owner of a space says that has lost it is not taken."""

from __future__ import annotations

import time
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, Callable, List, Optional, Tuple

import pytest

import cogmap
from cogmap.incoming import Incoming
from cogmap.wake import Wake
from cogmap.wire import CBOR, encode
from stand_in import StandIn

ESTIMATE = cogmap.Estimate(
    space="lab",
    agent="ada",
    session=5,
    seq=0,
    stamp_ns=0,
    frame="map",
    map_revision=1,
    status=cogmap.Status.LOCALIZED,
    translation_m=(0.0, 0.0, 0.0),
    rotation_xyzw=(0.0, 0.0, 0.0, 1.0),
    covariance=(0.0,) * 21,
)


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def of_term(robot: cogmap.Robot, term: int) -> bool:
    return robot.watermark is not None and robot.watermark.term == term


def test_a_robot_takes_what_the_latest_owner_says() -> None:
    heard: List[Tuple[int, int]] = []
    with StandIn() as service, cogmap.Robot("lab", "ada", connect=service.endpoint) as robot:
        for _ in range(5):
            robot.marker("x")
        robot.flush()
        known = robot.estimate(seq=4)
        robot.on_estimate(lambda estimate: heard.append((estimate.term, estimate.seq)))
        for term, seq in [(4, 2), (3, 4), (5, 0), (0, 4), (5, 1)]:
            service.publish_estimate(replace(known, term=term, seq=seq))
        wait_for(lambda: (5, 1) in heard)
        assert heard == [(4, 2), (5, 0), (5, 1)]

        service.publish(cogmap.Watermark(robot.session_id, 5, 5, term=4))
        service.publish(cogmap.Watermark(robot.session_id + 1, 0, 0, term=4))
        service.publish(cogmap.Watermark(robot.session_id, 5, 5, term=5))
        wait_for(lambda: of_term(robot, 5))
        service.term = 5
        robot.marker("y")
        robot.flush()


def test_an_estimate_is_heard_once_and_none_after_a_later_one() -> None:
    heard: List[Tuple[int, int]] = []
    with StandIn() as service, cogmap.Robot("lab", "ada", connect=service.endpoint) as robot:
        for _ in range(5):
            robot.marker("x")
        robot.flush()
        known = robot.estimate(seq=4)
        robot.on_estimate(lambda estimate: heard.append((estimate.seq, estimate.map_revision)))
        revision = known.map_revision
        for seq, more in [(4, 0), (6, 2), (5, 1), (6, 2), (6, 3), (7, 4)]:
            service.publish_estimate(replace(known, seq=seq, map_revision=revision + more))
        wait_for(lambda: (7, revision + 4) in heard)
        assert heard == [(6, revision + 2), (6, revision + 3), (7, revision + 4)]


def test_another_owner_gets_what_the_one_before_had_not_made_durable() -> None:
    with StandIn() as service, cogmap.Robot("lab", "ada", connect=service.endpoint) as robot:
        service.term = 3
        service.publishes_watermarks = False
        for _ in range(4):
            robot.marker("x")
        robot.estimate(seq=3)
        session = robot.session_id
        service.publish(cogmap.Watermark(session, 1, 4, term=3))
        wait_for(lambda: of_term(robot, 3))
        assert robot.watermark is not None and robot.watermark.applied == 4
        # It was lost with three samples that it had applied.
        del service.journal[1:]
        service.term, service.publishes_watermarks = 4, True
        began_at = time.monotonic()
        service.publish(service.watermark())
        robot.flush()
        assert time.monotonic() - began_at < 0.9, "not only after a silence"
        assert [sample.body for sample in service.journal] == [cogmap.Marker("x")] * 4
        assert robot.estimate(seq=3).term == 4


@pytest.mark.parametrize("every, expected", [(True, [(3, 1), (3, 2), (4, 0)]), (False, [(4, 0)])])
def test_a_late_message_of_an_owner_before_hides_no_estimate(
    every: bool, expected: List[Tuple[int, int]]
) -> None:
    incoming = Incoming(Wake())
    for term, seq in [(3, 1), (3, 2), (4, 0), (3, 3)]:
        data = encode(replace(ESTIMATE, term=term, seq=seq))
        payload = SimpleNamespace(to_bytes=lambda data=data: data)
        message: Any = SimpleNamespace(encoding=CBOR, payload=payload)
        incoming.estimates.hear(message)
    latest: Optional[int] = None if every else 4

    def is_wanted(estimate: cogmap.Estimate) -> bool:
        nonlocal latest
        if latest is not None and estimate.term < latest:
            return False
        latest = estimate.term
        return True

    taken = [told for told in incoming.drain(every, is_wanted)]
    assert [(one.term, one.seq) for one in taken if isinstance(one, cogmap.Estimate)] == expected
