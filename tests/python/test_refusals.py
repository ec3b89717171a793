"""What the service refuses reaches the caller of the Python client as a typed error that says
why."""

from __future__ import annotations

import itertools
import logging
from typing import Any, Callable, List, Tuple

import pytest

import cogmap
from conftest import MakeServer
from feeder import drive
from server import Server
from wait import LONG_S, eventually

Ask = Callable[[cogmap.Client], Any]


def samples(session: int, first_seq: int, count: int = 10) -> cogmap.SampleBatch:
    """Samples of a drive."""
    return cogmap.SampleBatch(session, first_seq, tuple(itertools.islice(drive(1), count)))


#: What is asked of a service that has one agent, `ada`, in its session 7, and what it answers.
REFUSED: Tuple[Tuple[Ask, int, str], ...] = (
    (lambda c: c.space("nowhere"), 404, "unknown-space"),
    (lambda c: c.delete_space("nowhere"), 404, "unknown-space"),
    (lambda c: list(c.agents("nowhere")), 404, "unknown-space"),
    (lambda c: next(c.events("nowhere")), 404, "unknown-space"),
    (lambda c: c.post_samples("nowhere", "ada", samples(7, 0)), 404, "unknown-space"),
    (lambda c: c.agent("default", "nobody"), 404, "unknown-agent"),
    (lambda c: c.grid("default", "nobody"), 404, "unknown-agent"),
    (lambda c: c.trajectory("default", "nobody"), 404, "unknown-agent"),
    (lambda c: c.place("default", 4_000_000_000), 404, "unknown-memory"),
    (lambda c: c.trip("default", 4_000_000_000), 404, "unknown-memory"),
    (lambda c: c.landmark("default", "nothing/here?"), 404, "unknown-memory"),
    (lambda c: c.agent("default", "no such name"), 400, "invalid-path"),
    (lambda c: c.space("../spaces"), 400, "invalid-path"),
    (lambda c: c.place("default", -1), 400, "invalid-path"),
    (lambda c: list(c.places("default", limt=3)), 400, "invalid-parameter"),
    (lambda c: list(c.trips("default", limit=0)), 422, "invalid-query"),
    (lambda c: list(c.trips("default", agent="nobody")), 404, "unknown-agent"),
    (lambda c: c.recall("default", agent="nobody"), 404, "unknown-agent"),
    (lambda c: c.latest_events("default", agent="nobody"), 404, "unknown-agent"),
    (lambda c: c.latest_events("default", after="soon"), 400, "invalid-parameter"),
    (lambda c: c.export("default", "gpx"), 400, "invalid-parameter"),
    (lambda c: c.create_space("lab", grid_moduls=5), 400, "malformed-body"),
    (lambda c: c.create_space("lab", grid_modules=0), 422, "invalid-settings"),
    (lambda c: c.create_space("default", seed=1), 409, "other-settings"),
    (lambda c: c.recall("default", radius_m=1), 422, "invalid-query"),
    (lambda c: c.recall("default", code=[(0, 0, 0)]), 422, "invalid-query"),
    (lambda c: c.post_samples("default", "ada", samples(7, 99)), 409, "sequence-gap"),
    (lambda c: c.post_samples("default", "ada", samples(6, 0)), 409, "stale-session"),
)


def test_each_refusal_has_its_status_and_kind(service: Server) -> None:
    client = service.client()
    client.post_samples("default", "ada", samples(7, 0))
    before = client.spaces()
    for ask, status, kind in REFUSED:
        with pytest.raises(cogmap.ApiError) as refused:
            ask(client)
        told = refused.value
        assert (told.status, told.kind) == (status, f"/problems/{kind}"), repr(told)
        assert told.title and told.detail
    assert client.spaces() == before, "what was refused has changed nothing"


def test_a_gap_says_which_sample_is_next(service: Server) -> None:
    client = service.client()
    client.post_samples("default", "ada", samples(7, 0))
    with pytest.raises(cogmap.ApiError) as refused:
        client.post_samples("default", "ada", samples(7, 99))
    assert dict(refused.value.extra) == {"session": 7, "expected_seq": 10}
    answer = client.post_samples("default", "ada", samples(7, 5, 10))
    assert (answer.watermark.durable, answer.duplicates) == (15, 5)


def test_samples_that_make_no_sense_are_refused_one_by_one(service: Server) -> None:
    good = cogmap.Sample(10, cogmap.StartPose((0, 0, 0)))
    backwards = cogmap.Sample(9, cogmap.Marker("earlier"))
    batch = cogmap.SampleBatch(7, 0, (good, backwards, good, backwards, backwards, good))
    mark = service.client().post_samples("default", "ada", batch).watermark
    assert (mark.durable, mark.applied) == (6, 6)
    backwards_of = cogmap.SkipReason.TIME_BACKWARDS
    assert [(one.range.start, one.range.stop, one.reason) for one in mark.rejected] == [
        (1, 2, backwards_of),
        (3, 5, backwards_of),
    ]


def test_a_robot_of_a_space_that_is_not_there_is_told_at_once(service: Server) -> None:
    where = f"cogmap/defualt/query/watermark at {service.endpoint}"
    said = f'"defualt"; PUT /v1/spaces/defualt creates it .{where}.$'
    with pytest.raises(cogmap.ApiError, match=said) as refused:
        cogmap.Robot("defualt", "ada", connect=service.endpoint)
    assert refused.value.status == 404
    with service.robot("ada") as robot:
        robot.start_pose([0, 0, 0])
        robot.flush(LONG_S)
        service.client().delete_space("default")
        robot.marker("nowhere")
        with pytest.raises(cogmap.ApiError, match='"default"'):
            robot.flush(LONG_S)
        service.client().create_space("default")
        eventually("the sample in the new space", lambda: robot.pending == 0)


def test_refused_samples_are_told_as_one_range(
    service: Server, caplog: pytest.LogCaptureFixture
) -> None:
    heard: List[cogmap.Rejection] = []
    count = 200
    with caplog.at_level(logging.WARNING, "cogmap"), service.robot("ada") as robot:
        robot.on_rejection(heard.append)
        robot.start_pose([0, 0, 0], stamp_ns=5000)
        for step in range(count):
            robot.increment([0.01, 0, 0], stamp_ns=4000 + step)
        assert robot.estimate(LONG_S, seq=count).seq == count
        robot.flush(LONG_S)
        one = cogmap.Rejection(cogmap.SeqRange(1, 1 + count), cogmap.SkipReason.TIME_BACKWARDS)
        assert robot.rejections == (one,)
    assert sum(part.range.stop - part.range.start for part in heard) == count
    told = [record.getMessage() for record in caplog.records]
    assert len(told) <= 3, "a line for a range, not for a sample"
    assert told[0].startswith("ada: samples 1 to ")
    assert told[0].endswith(" refused: time_backwards (stamp 4000 before 5000 [ns])")


def test_a_robot_hears_which_of_its_samples_are_refused(service: Server) -> None:
    heard: List[cogmap.Rejection] = []
    with service.robot("ada") as robot:
        robot.on_rejection(heard.append)
        robot.start_pose([0, 0, 0], stamp_ns=10)
        robot.marker("earlier", stamp_ns=9)
        robot.marker("later", stamp_ns=11)
        robot.flush(LONG_S)
    expected = cogmap.Rejection(cogmap.SeqRange(1, 2), cogmap.SkipReason.TIME_BACKWARDS)
    assert heard == [expected] == list(robot.rejections)


def test_without_the_token_nothing_is_told_but_health(make_service: MakeServer) -> None:
    service = make_service(["http.token=s3cret"], token="s3cret")
    service.client().post_samples("default", "ada", samples(7, 0))
    for token in (None, "", "s3cre", "S3cret"):
        stranger = cogmap.Client(service.url, token=token)
        asks: Tuple[Ask, ...] = (
            lambda c: c.spaces(),
            lambda c: c.agent("default", "ada"),
            lambda c: c.post_samples("default", "ada", samples(7, 10)),
            lambda c: c.delete_space("default"),
            lambda c: next(c.events("default")),
        )
        for ask in asks:
            with pytest.raises(cogmap.ApiError) as refused:
                ask(stranger)
            assert (refused.value.status, refused.value.kind) == (401, "/problems/unauthorized")
            given = "without a token" if token is None else "with the given token"
            assert str(refused.value).endswith(f" {given})")
        assert stranger.health() and stranger.ready()
    assert service.client().agent("default", "ada").watermark.durable == 10


def test_a_service_that_is_not_there_is_told_with_its_address(service: Server) -> None:
    service.terminate()
    with pytest.raises(cogmap.Unreachable, match=service.url) as refused:
        service.client().spaces()
    assert isinstance(refused.value, OSError)
    with pytest.raises(cogmap.Timeout, match=service.endpoint):
        service.robot("ada", connect_timeout_s=0.2)
    service.start()
    assert [space.name for space in service.client().spaces()] == ["default"]
