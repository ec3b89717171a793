"""The relays do to connections what they say."""

from __future__ import annotations

import http.client
import http.server
import socket
import socketserver
import threading
from typing import Iterator, Tuple, Union

import pytest

from relay import Relay
from storage_relay import StorageRelay

#: Long enough for a message to come through on a busy machine [s].
_SOON_S = 10.0
#: Long enough to see that none comes [s].
_NEVER_S = 0.3


class Echo(socketserver.BaseRequestHandler):
    """Sends back what comes."""

    def handle(self) -> None:
        while True:
            data = self.request.recv(1 << 16)
            if not data:
                return
            self.request.sendall(data)


class Objects(http.server.BaseHTTPRequestHandler):
    """Takes objects and answers with their length, in chunks where it is asked for them."""

    protocol_version = "HTTP/1.1"

    def do_PUT(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self._answer(str(len(body)).encode())

    def do_GET(self) -> None:
        self._answer(b"here it is")

    def do_HEAD(self) -> None:
        self.send_response(200)
        self.send_header("Content-Length", "1000")
        self.end_headers()

    def _answer(self, body: bytes) -> None:
        self.send_response(200)
        if self.path == "/chunks":
            self.send_header("Transfer-Encoding", "chunked")
            body = b"%x\r\n%s\r\n0\r\n\r\n" % (len(body), body)
        else:
            self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        pass


Server = Union[socketserver.ThreadingTCPServer, http.server.ThreadingHTTPServer]


def serving(server: Server) -> Iterator[int]:
    """The port of a server that serves in a thread."""
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    yield server.server_address[1]
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture
def relay() -> Iterator[Relay]:
    for port in serving(socketserver.ThreadingTCPServer(("127.0.0.1", 0), Echo)):
        relay = Relay(port)
        yield relay
        relay.close()


@pytest.fixture
def objects() -> Iterator[StorageRelay]:
    for port in serving(http.server.ThreadingHTTPServer(("127.0.0.1", 0), Objects)):
        relay = StorageRelay(port)
        yield relay
        relay.close()


def connection(relay: Relay) -> socket.socket:
    return socket.create_connection(("127.0.0.1", relay.port), _SOON_S)


def asked(client: http.client.HTTPConnection, method: str, path: str) -> Tuple[int, bytes]:
    client.request(method, path, b"x" * 100_000 if method == "PUT" else None)
    answer = client.getresponse()
    return answer.status, answer.read()


def test_bytes_pass_until_the_relay_is_cut(relay: Relay) -> None:
    with connection(relay) as client:
        client.sendall(b"one")
        assert client.recv(10) == b"one"
        relay.cut()
        assert client.recv(10) == b""
    with pytest.raises(ConnectionRefusedError):
        connection(relay)
    relay.mend()
    with connection(relay) as client:
        client.sendall(b"two")
        assert client.recv(10) == b"two"


def test_what_a_frozen_relay_holds_back_comes_later(relay: Relay) -> None:
    with connection(relay) as client:
        client.sendall(b"one")
        assert client.recv(10) == b"one"
        relay.freeze()
        client.sendall(b"two")
        with connection(relay) as other:
            other.sendall(b"three")
            for each in (client, other):
                each.settimeout(_NEVER_S)
                with pytest.raises(socket.timeout):
                    each.recv(10)
                each.settimeout(_SOON_S)
            relay.mend()
            assert (client.recv(10), other.recv(10)) == (b"two", b"three")


def test_a_frozen_relay_can_be_cut(relay: Relay) -> None:
    with connection(relay) as client:
        client.sendall(b"one")
        assert client.recv(10) == b"one"
        relay.freeze()
        client.sendall(b"two")
        relay.cut()
        assert client.recv(10) == b""


def test_requests_pass_and_are_counted(objects: StorageRelay) -> None:
    client = http.client.HTTPConnection("127.0.0.1", objects.port, timeout=_SOON_S)
    for _ in range(3):
        assert asked(client, "PUT", "/") == (200, b"100000")
        assert asked(client, "HEAD", "/") == (200, b"")
        assert asked(client, "GET", "/chunks") == (200, b"here it is")
    client.close()
    assert objects.passed == {"PUT": 3, "HEAD": 3, "GET": 3}


def test_refused_requests_do_not_reach_the_storage(objects: StorageRelay) -> None:
    client = http.client.HTTPConnection("127.0.0.1", objects.port, timeout=_SOON_S)
    objects.refuse()
    for _ in range(2):
        status, body = asked(client, "PUT", "/")
        assert status == 503 and b"<Code>SlowDown</Code>" in body
    objects.mend()
    assert asked(client, "PUT", "/")[0] == 200
    client.close()
    assert (objects.refused, objects.passed) == (2, {"PUT": 1})


def test_a_lost_answer_is_of_a_request_that_was_done(objects: StorageRelay) -> None:
    client = http.client.HTTPConnection("127.0.0.1", objects.port, timeout=_SOON_S)
    objects.lose_answers(2)
    assert asked(client, "PUT", "/")[0] == 200
    assert asked(client, "GET", "/")[0] == 200
    with pytest.raises(http.client.RemoteDisconnected):
        asked(client, "PUT", "/")
    client.close()
    assert objects.passed == {"PUT": 2, "GET": 1}
    objects.mend()
    for _ in range(2):
        assert asked(client, "PUT", "/")[0] == 200
    client.close()
    assert objects.lost == 1
