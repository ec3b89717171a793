"""Streams of events that one node passes on from another end when either of them does.

Not a part of the gate: `make drills-cluster`.
"""

from __future__ import annotations

import time
import urllib.request
from http.client import HTTPResponse
from typing import cast

from cluster import Cluster, Node
from wait import LONG_S

#: Longest time from a node's SIGTERM to its end [s]: far below `http.shutdown_timeout_s`, the five
#: seconds that it waits for what is under way.
STOPPED_S_MAX = 3.0
#: Longest time from when an owner freezes to the end of its streams elsewhere [s]: the lease, and
#: what another node needs to take over.
ENDED_S_MAX = 10.0


def _open_stream(node: Node) -> HTTPResponse:
    """The events of a space, through a node; the stream has begun."""
    url = f"{node.url}/v1/spaces/hall/events"
    stream = cast(HTTPResponse, urllib.request.urlopen(url, timeout=LONG_S))
    assert stream.headers["content-type"].startswith("text/event-stream")
    return stream


def _await_end(stream: HTTPResponse) -> None:
    while stream.read1(4096):
        pass


def test_a_node_that_stops_ends_the_streams_that_it_passes_on(cluster: Cluster) -> None:
    owner = cluster.owner(cluster.create("hall"))
    between = cluster.others(owner)[0]
    with _open_stream(between) as stream:
        begin_s = time.monotonic()
        between.terminate()
        assert time.monotonic() - begin_s <= STOPPED_S_MAX
        _await_end(stream)


def test_streams_of_a_frozen_owner_end(cluster: Cluster) -> None:
    owner = cluster.owner(cluster.create("hall"))
    with _open_stream(cluster.others(owner)[0]) as stream:
        begin_s = time.monotonic()
        owner.pause()
        _await_end(stream)
        ended_s = time.monotonic() - begin_s
    owner.resume()
    assert ended_s <= ENDED_S_MAX
