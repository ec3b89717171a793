"""Live streams and point clouds, read from a service that answers as told."""

from __future__ import annotations

import json
import struct
from typing import Iterator

import pytest

import cogmap
from http_stand_in import Server

TICK = {
    "map_revision": 7,
    "agents": [
        {
            "name": "ada",
            "session": 3,
            "seq": 41,
            "stamp_ns": 1795264924668453163,
            "status": "localized",
            "frame": "map",
            "translation_m": [1, 2, 3],
            "rotation_xyzw": [0, 0, 0, 1],
            "position_covariance_m2": [1, 0, 0, 2, 0, 3],
            "rotation_sd_rad": [0.1, 0.2, 0.3],
            "place": None,
            "confidence": 0,
            "lag_samples": 5,
            "contacts": None,
        }
    ],
    "removed": ["bea"],
    "events": [
        {
            "id": "7-0",
            "event": {
                "space": "lab",
                "agent": "ada",
                "map_revision": 7,
                "stamp_ns": 0,
                "kind": {"agent_enrolled": {}},
            },
        }
    ],
    "missed": {"events": 2, "next": "5-0"},
    "sightings": [
        {
            "agent": "ada",
            "stamp_ns": 1,
            "from_m": [0, 0, 0],
            "to_m": [1, 0, 0],
            "target": {"landmark": "post"},
        }
    ],
    "counts": {"agents": 1, "places": 2, "trips": 3, "landmarks": 4, "objects": 5},
    "health": {
        "samples_per_s": None,
        "waiting_samples": 0,
        "not_durable_samples": 5,
        "dropped_messages": 0,
        "skipped_samples": 0,
        "duplicate_samples": 0,
        "resident_bytes": 1000,
        "something_new": 1,
    },
}


@pytest.fixture
def server() -> Iterator[Server]:
    server = Server()
    yield server
    server.close()


@pytest.fixture
def client(server: Server) -> cogmap.Client:
    return cogmap.Client(server.url)


def test_ticks_are_read_as_they_come(server: Server, client: cogmap.Client) -> None:
    stream = [
        b"event: tick\ndata: " + json.dumps(TICK).encode() + b"\n\n",
        b": keep-alive\n\n",
        b'event: lagged\ndata: {"ticks":4}\n\n',
        b"event: tick\ndata: " + json.dumps(dict(TICK, agents=[])).encode() + b"\n\n",
    ]
    server.routes["GET /v1/spaces/lab/live"] = lambda _: (200, "text/event-stream", stream)
    first, lagged, second = client.live("lab", rate_hz=20, timeout_s=5.0)
    assert server.seen[0].query == {"rate_hz": "20"}
    assert isinstance(first, cogmap.LiveTick) and isinstance(second, cogmap.LiveTick)
    assert lagged == cogmap.LaggedTicks(4)
    (ada,) = first.agents
    assert ada.frame == "map"
    assert (ada.name, ada.stamp_ns, ada.status) == (
        "ada",
        1795264924668453163,
        cogmap.Status.LOCALIZED,
    )
    assert (first.removed, first.missed) == (("bea",), cogmap.MissedEvents(2, "5-0"))
    assert first.events[0].event.kind == cogmap.AgentEnrolled()
    assert first.sightings[0].target == cogmap.LandmarkTarget("post")
    assert (first.counts.objects, first.health.samples_per_s) == (5, None)
    assert second.agents == ()


def ply(
    since: int, revision: int, places: "dict[int, int]", forgotten: "tuple[int, ...]" = ()
) -> bytes:
    """A cloud: places by number with their visits."""
    gone = f"element forgotten {len(forgotten)}\nproperty uint id\n" if since else ""
    head = (
        "ply\nformat binary_little_endian 1.0\ncomment places of the cogmap space lab\n"
        f"comment revision {revision}\ncomment since_revision {since}\n"
        f"element vertex {len(places)}\n"
        "property uint id\nproperty float x\nproperty float y\nproperty float z\n"
        "property float strength\nproperty uint visits\n"
        f"property double first_s\nproperty double last_s\n{gone}end_header\n"
    )
    vertices = [
        struct.pack("<I4fI2d", number, 0.5, -1, 2, 1, visits, 10.25, 11.5)
        for number, visits in places.items()
    ]
    numbers = [struct.pack("<I", number) for number in forgotten]
    return head.encode() + b"".join(vertices + numbers)


def test_a_cloud_is_brought_up_to_date(server: Server, client: cogmap.Client) -> None:
    clouds = iter([ply(0, 8, {0: 1, 3: 2}), ply(8, 9, {3: 3, 4: 1}, (0, 1)), ply(0, 2, {0: 1})])
    server.routes["GET /v1/spaces/lab/export"] = lambda _: (
        200,
        "application/octet-stream",
        next(clouds),
    )
    cloud = client.point_cloud("lab")
    assert cloud.places[3] == cogmap.CloudPlace((0.5, -1.0, 2.0), 1.0, 2, 10.25, 11.5)
    changed = client.point_cloud("lab", since_revision=cloud.revision)
    queries = [seen.query for seen in server.seen]
    assert queries[0] == {"format": "ply", "encoding": "binary"}
    assert queries[1] == dict(queries[0], since_revision="8")
    cloud = cloud.update(changed)
    assert {number: place.visits for number, place in cloud.places.items()} == {3: 3, 4: 1}
    assert (cloud.revision, cloud.since_revision) == (9, 0)
    anew = client.point_cloud("lab", since_revision=9)
    assert cloud.update(anew) == anew, "the service has sent all of it"
    with pytest.raises(cogmap.WireError, match="cannot update"):
        anew.update(changed)


@pytest.mark.parametrize(
    "wrong",
    [
        b"",
        b"ply\nformat ascii 1.0\nend_header\n",
        ply(0, 8, {0: 1})[:-1],
        ply(0, 8, {0: 1}) + b"x",
        ply(0, 8, {0: 1}).replace(b"comment revision 8\n", b""),
        ply(0, 8, {0: 1}).replace(b"revision 8", b"revision eight"),
    ],
)
def test_what_is_no_cloud_is_refused(server: Server, client: cogmap.Client, wrong: bytes) -> None:
    answer = (200, "application/octet-stream", wrong)
    server.routes["GET /v1/spaces/lab/export"] = lambda _: answer
    with pytest.raises(cogmap.WireError):
        client.point_cloud("lab")
