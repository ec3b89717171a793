"""Requests that are sent again: while a space moves, and at another address."""

from __future__ import annotations

import json
import socket
import threading
import time
from typing import Dict, Iterator, List, Optional

import pytest

import cogmap
from cogmap.wire import JSON
from http_stand_in import Answer, Request, Server, golden
from stand_in import free_port

SPACES = "GET /v1/spaces"
SAMPLES = "POST /v1/spaces/lab/agents/ada/samples"
RECALL = "POST /v1/spaces/lab/recall"
DELETE = "DELETE /v1/spaces/lab"
EVENTS = "GET /v1/spaces/lab/events"
BATCH = cogmap.SampleBatch(5, 0, (cogmap.Sample(0, cogmap.Marker("x")),))
#: What each is answered by.
ANSWERS: Dict[str, Answer] = {
    SPACES: (200, JSON, json.dumps(golden("space_list")).encode()),
    SAMPLES: (200, JSON, json.dumps(golden("ingest_answer")).encode()),
    RECALL: (200, JSON, json.dumps(golden("recall_answer")).encode()),
    DELETE: (204, JSON, None),
    EVENTS: (200, "text/event-stream", [b'event: missed\ndata: {"events":1,"next":null}\n\n']),
}


def ask(client: cogmap.Client, line: str) -> None:
    """Sends the request of that line."""
    if line == SPACES:
        client.spaces()
    elif line == SAMPLES:
        client.post_samples("lab", "ada", BATCH)
    elif line == RECALL:
        client.recall("lab", position_m=[0, 0, 0])
    elif line == EVENTS:
        next(client.follow("lab"))
    else:
        client.delete_space("lab")


@pytest.fixture
def server() -> Iterator[Server]:
    server = Server()
    server.retry_after = "0"
    yield server
    server.close()


def refuse(server: Server, line: str, kind: str, status: int, times: int) -> None:
    """Answers a request by a problem so many times, and then by what it asked for."""
    problem = {"type": f"/problems/{kind}", "title": kind, "status": status, "detail": ""}
    left = [times]

    def answer(request: Request) -> Answer:
        left[0] -= 1
        if left[0] >= 0:
            return status, "application/problem+json", json.dumps(problem).encode()
        return ANSWERS[line]

    server.routes[line] = answer


def lines(server: Server) -> List[str]:
    return [seen.line for seen in server.seen]


@pytest.mark.parametrize("line", ANSWERS)
def test_every_request_is_sent_again_while_its_space_moves(server: Server, line: str) -> None:
    refuse(server, line, "moving", 503, times=2)
    ask(cogmap.Client(server.url), line)
    assert lines(server) == [line] * 3
    assert len({seen.body for seen in server.seen}) == 1


def test_another_address_is_asked_where_a_space_stays_away(server: Server) -> None:
    refuse(server, SPACES, "moving", 503, times=1000)
    other = Server()
    try:
        refuse(other, SPACES, "", 0, times=0)
        client = cogmap.Client([server.url, other.url])
        client.spaces()
        assert (lines(server), lines(other)) == ([SPACES], [SPACES])
        client.spaces()
        assert len(lines(server)) == 1, "it stays where it was answered"
    finally:
        other.close()


def test_an_address_that_does_not_answer_is_left(server: Server) -> None:
    for line in (SPACES, RECALL):
        refuse(server, line, "", 0, times=0)
    with socket.socket() as silent:  # takes connections, as a machine that stands still
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        address = f"http://127.0.0.1:{silent.getsockname()[1]}"
        client = cogmap.Client([address, server.url], timeout_s=0.2)
        client.spaces()
        # What may be done only once is not sent again, and the next request goes elsewhere.
        client = cogmap.Client([address, server.url], timeout_s=0.2)
        with pytest.raises(cogmap.Timeout):
            client.recall("lab", position_m=[0, 0, 0])
        client.recall("lab", position_m=[0, 0, 0])
    assert lines(server) == [SPACES, RECALL]


def test_the_pause_is_the_one_that_the_service_names(server: Server) -> None:
    server.retry_after = "1"
    refuse(server, SPACES, "moving", 503, times=1)
    asked_at = time.monotonic()
    cogmap.Client(server.url).spaces()
    assert 1 <= time.monotonic() - asked_at < 20


@pytest.mark.parametrize("retry_after", [None, "Fri, 31 Dec 1999 23:59:59 GMT", "soon", "-1"])
def test_a_service_that_names_no_pause_is_asked_again_soon(
    server: Server, retry_after: Optional[str]
) -> None:
    server.retry_after = retry_after
    refuse(server, SPACES, "moving", 503, times=1)
    asked_at = time.monotonic()
    cogmap.Client(server.url).spaces()
    assert 0.4 <= time.monotonic() - asked_at < 20


def test_a_space_that_moves_for_too_long_is_told(server: Server) -> None:
    server.retry_after = "3600"
    refuse(server, SPACES, "moving", 503, times=10)
    with pytest.raises(cogmap.ApiError) as caught:
        cogmap.Client(server.url, retry_timeout_s=0.05).spaces()
    assert (caught.value.kind, caught.value.retry_after_s) == ("/problems/moving", 3600)
    # A last time when the time is over.
    assert lines(server) == [SPACES] * 2
    with pytest.raises(cogmap.ApiError):
        cogmap.Client(server.url, retry_timeout_s=0).spaces()
    assert lines(server) == [SPACES] * 3


@pytest.mark.parametrize("line", ANSWERS)
def test_what_a_lost_owner_may_have_done_is_asked_again_only_where_that_is_harmless(
    server: Server, line: str
) -> None:
    refuse(server, line, "owner-lost", 502, times=1)
    client = cogmap.Client(server.url)
    if line in (SPACES, SAMPLES, EVENTS):
        ask(client, line)
        assert lines(server) == [line] * 2
    else:
        with pytest.raises(cogmap.ApiError, match="owner-lost"):
            ask(client, line)
        assert lines(server) == [line]


def test_other_problems_are_told_at_once(server: Server) -> None:
    refuse(server, SPACES, "busy", 503, times=1)
    with pytest.raises(cogmap.ApiError, match="busy"):
        cogmap.Client(server.url).spaces()
    assert lines(server) == [SPACES]


@pytest.mark.parametrize("line", ANSWERS)
def test_another_address_is_asked_when_nothing_listens_at_the_one_before(
    server: Server, line: str
) -> None:
    server.routes[line] = lambda _: ANSWERS[line]
    dead = f"http://127.0.0.1:{free_port()}"
    client = cogmap.Client([dead, server.url])
    ask(client, line)
    ask(client, line)
    assert lines(server) == [line] * 2
    assert server.url in repr(client), "the address that answers stays in use"


def test_when_nothing_listens_anywhere_the_last_address_is_told() -> None:
    urls = [f"http://127.0.0.1:{free_port()}" for _ in range(2)]
    with pytest.raises(cogmap.Unreachable, match=f"{urls[1]}/v1/spaces: nothing listens there"):
        cogmap.Client(urls).spaces()


@pytest.fixture
def broken() -> Iterator[str]:
    """The address of a server that closes each connection without an answer."""
    listener = socket.create_server(("127.0.0.1", 0))

    def accept() -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return
            with connection:
                connection.recv(65536)

    threading.Thread(target=accept, daemon=True).start()
    yield f"http://127.0.0.1:{listener.getsockname()[1]}"
    listener.close()


@pytest.mark.parametrize("line", ANSWERS)
def test_a_connection_that_breaks_lets_another_address_answer_where_that_is_harmless(
    server: Server, broken: str, line: str
) -> None:
    server.routes[line] = lambda _: ANSWERS[line]
    client = cogmap.Client([broken, server.url])
    if line in (SPACES, SAMPLES, EVENTS):
        ask(client, line)
        assert lines(server) == [line]
    else:
        with pytest.raises(cogmap.Unreachable, match=broken):
            ask(client, line)
        assert lines(server) == []
