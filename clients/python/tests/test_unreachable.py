"""What fails on the way to the service is told as an error of this package, with the address in
it."""

from __future__ import annotations

import socket
import threading
from typing import Callable, Iterator

import pytest

import cogmap
from stand_in import StandIn, free_port

Speak = Callable[[socket.socket], None]


@pytest.fixture
def serve() -> Iterator[Callable[[Speak], int]]:
    """Makes servers on loopback ports that speak once to whoever connects."""
    listeners = []

    def make(speak: Speak) -> int:
        listener = socket.create_server(("127.0.0.1", 0))
        listeners.append(listener)

        def accept() -> None:
            while True:
                try:
                    connection, _ = listener.accept()
                except OSError:
                    return
                with connection:
                    speak(connection)

        threading.Thread(target=accept, daemon=True).start()
        port: int = listener.getsockname()[1]
        return port

    yield make
    for listener in listeners:
        listener.close()


def answers(data: bytes) -> Speak:
    def speak(connection: socket.socket) -> None:
        connection.recv(4096)
        connection.sendall(data)

    return speak


def hang(connection: socket.socket) -> None:
    connection.recv(4096)
    threading.Event().wait(3)


def asked(port: int, timeout_s: float = 5.0) -> BaseException:
    """What becomes of a question."""
    client = cogmap.Client(f"http://127.0.0.1:{port}/", timeout_s=timeout_s)
    with pytest.raises(cogmap.CogmapError) as raised:
        client.agent("lab", "ada")
    assert f"GET http://127.0.0.1:{port}/v1/spaces/lab/agents/ada" in str(raised.value)
    return raised.value


def test_nothing_that_listens_is_told_with_the_address() -> None:
    error = asked(free_port())
    assert isinstance(error, cogmap.Unreachable) and isinstance(error, OSError)
    assert "nothing listens there" in str(error)


def test_a_silent_service_is_a_timeout(serve: Callable[[Speak], int]) -> None:
    error = asked(serve(hang), timeout_s=0.2)
    assert isinstance(error, cogmap.Timeout) and isinstance(error, TimeoutError)


def test_another_protocol_is_told(serve: Callable[[Speak], int]) -> None:
    error = asked(serve(answers(b"\x1b\x00zenoh\r\n")))
    assert isinstance(error, cogmap.Unreachable) and "does not speak HTTP" in str(error)


@pytest.mark.parametrize(
    "answer",
    [
        b"",
        b"HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\n{",
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
    ],
)
def test_an_answer_that_is_cut_off_is_told(serve: Callable[[Speak], int], answer: bytes) -> None:
    assert isinstance(asked(serve(answers(answer))), cogmap.Unreachable)


def test_a_stream_of_events_that_is_cut_off_is_told(serve: Callable[[Speak], int]) -> None:
    cut = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n5\r\n:hi\n\n\r\n9\r\n"
    client = cogmap.Client(f"http://127.0.0.1:{serve(answers(cut))}")
    with pytest.raises(cogmap.Unreachable, match="/v1/spaces/lab/events: "):
        next(client.events("lab"))


def test_an_event_that_is_none_is_told_with_the_address(serve: Callable[[Speak], int]) -> None:
    stream = b"HTTP/1.1 200 OK\r\nConnection: close\r\n\r\ndata: nothing\n\n"
    client = cogmap.Client(f"http://127.0.0.1:{serve(answers(stream))}")
    with pytest.raises(cogmap.WireError, match="/v1/spaces/lab/events: malformed"):
        next(client.events("lab"))


def test_an_answer_of_another_kind_is_told_with_the_address(serve: Callable[[Speak], int]) -> None:
    page = b"<html></html>"
    head = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(page)
    port = serve(answers(head + page))
    with pytest.raises(cogmap.WireError, match=f"http://127.0.0.1:{port}/v1/spaces: malformed"):
        cogmap.Client(f"http://127.0.0.1:{port}").spaces()


@pytest.mark.parametrize(
    "url", ["127.0.0.1:8080", "tcp/127.0.0.1:7447", "http://", "http://h:port", ""]
)
def test_an_address_that_is_none_is_refused(url: str) -> None:
    with pytest.raises(cogmap.InvalidValue, match="^url: expected an address such as http://"):
        cogmap.Client(url)


@pytest.mark.parametrize(
    "endpoint",
    ["127.0.0.1:7447", "http://127.0.0.1:7447", "tcp/127.0.0.1", "tcp//", "", "localhost"],
)
def test_an_endpoint_that_is_none_is_refused_at_once(endpoint: str) -> None:
    with pytest.raises(cogmap.InvalidValue, match="^connect: expected .* such as tcp/") as raised:
        cogmap.Robot("lab", "ada", connect=endpoint)
    assert raised.value.value == endpoint


def connected(port: int) -> str:
    """What becomes of an attempt to connect."""
    endpoint = f"tcp/127.0.0.1:{port}"
    with pytest.raises(cogmap.Timeout) as raised:
        cogmap.Robot("lab", "ada", connect=endpoint, connect_timeout_s=0.3)
    told = str(raised.value)
    assert told.startswith(f"no Zenoh router answers within 0.3 s: {endpoint} "), told
    assert ".rs" not in told and raised.value.__cause__ is None
    return told


def test_no_router_is_told_with_the_endpoint_and_without_sources() -> None:
    assert "Connection refused" in connected(free_port())


def test_a_port_of_another_protocol_is_told(serve: Callable[[Speak], int]) -> None:
    told = connected(serve(answers(b"HTTP/1.1 400 Bad Request\r\n\r\n")))
    assert "is open, but no Zenoh router there" in told


def test_a_closed_session_is_told_with_the_key() -> None:
    with StandIn() as service:
        link = cogmap.open_session(service.endpoint)
        link.close()  # type: ignore[no-untyped-call]
        with pytest.raises(
            cogmap.Unreachable, match="^cogmap/lab/ada/samples at .*: session closed$"
        ):
            cogmap.Robot("lab", "ada", session=link)


def test_a_session_that_is_closed_under_a_robot_is_told_at_once() -> None:
    with StandIn() as service:
        link = cogmap.open_session(service.endpoint)
        robot = cogmap.Robot("lab", "ada", session=link)
        robot.marker("x")
        robot.flush()
        link.close()  # type: ignore[no-untyped-call]
        with pytest.raises(cogmap.Unreachable, match="^cogmap/lab/.*: session closed$"):
            robot.marker("y")
            robot.flush(30.0)
        with pytest.raises(cogmap.Unreachable):
            robot.marker("z")
        with pytest.raises(cogmap.Unreachable):
            robot.close()


def test_a_robot_that_nobody_acknowledges_is_told_of_access_rules() -> None:
    with StandIn() as service:
        service.publishes_watermarks = service.answers_queries = False
        robot = cogmap.Robot("lab", "ada", connect=service.endpoint)
        robot.marker("x")
        with pytest.raises(cogmap.Timeout, match="access rules"):
            robot.flush(1)
        service.publish(cogmap.Watermark(robot.session_id, 0, 0))
        robot.marker("y")
        # Once the service has said something of this run, the rules let it.
        with pytest.raises(cogmap.Timeout) as caught:
            robot.flush(1)
        assert "access rules" not in str(caught.value)
        with pytest.raises(cogmap.Timeout):
            robot.close(0)
