"""The Zenoh session of a robot: opened with everything explicit."""

from __future__ import annotations

import json
import logging
import re
import socket
import threading
from typing import Iterable, List, Optional, Union

import zenoh

from .credentials import Credentials
from .errors import CogmapError, InvalidValue, Timeout
from .fork import zenoh_begins
from .scalar import seconds

_log = logging.getLogger("cogmap")

#: Where a Zenoh router listens unless told otherwise.
DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
#: A protocol and an address.
_ENDPOINT = re.compile(r"[a-z][a-z0-9_-]*/[^/].*")
#: Protocols whose addresses need a port.
_WITH_PORT = re.compile(r"(?:tcp|udp|tls|quic|ws)/")
_PORT = re.compile(r".*:[0-9]{1,5}(?:[?#].*)?")
#: Where in its sources Zenoh found an error, which is nothing to its callers.
_SOURCE = re.compile(r"\s+at \S+\.rs:[0-9]+\.?")
#: How soon a lost connection is tried again, at first and at most [ms]. Zenoh's own 1 s to 4 s
#: would be most of the time that a restarted service is away.
_RETRY_MS = (100, 1000)
#: How long the look at an address that does not answer may take [s].
_PROBE_S = 0.5


def open_session(
    connect: Union[str, Iterable[str]] = DEFAULT_ENDPOINT,
    *,
    credentials: Optional[Credentials] = None,
    timeout_s: float = 10.0,
) -> zenoh.Session:
    """Opens a Zenoh session in client mode to one of the endpoints, without multicast.

    Several robots of one process may share it. Raises `InvalidValue` for what is no endpoint,
    `Timeout` when none answers in time or accepts the credentials, and `CogmapError` when the
    credentials' files cannot be used.
    """
    endpoints = endpoints_of(connect)
    timeout_s = seconds("connect_timeout_s", timeout_s)
    zenoh_begins()
    credentials = credentials or Credentials()
    credentials.check_files()
    try:
        config = credentials.config()
    except zenoh.ZError as error:
        raise CogmapError(f"credentials: {reason(error)}") from None
    config.insert_json5("mode", json.dumps("client"))
    try:
        config.insert_json5("connect/endpoints", json.dumps(endpoints))
    except zenoh.ZError as error:
        raise InvalidValue(
            "connect", connect, f"expected Zenoh endpoints ({reason(error)})"
        ) from None
    config.insert_json5("connect/timeout_ms", json.dumps(max(1, int(1000 * timeout_s))))
    config.insert_json5("connect/exit_on_failure", "true")
    first_ms, most_ms = _RETRY_MS
    retry = {"period_init_ms": first_ms, "period_max_ms": most_ms, "period_increase_factor": 2}
    config.insert_json5("connect/retry", json.dumps(retry))
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("scouting/multicast/enabled", "false")
    session = _opened(config)
    if session is None:
        found = "; ".join(f"{endpoint} {_probe(endpoint)}" for endpoint in endpoints)
        raise Timeout(f"no Zenoh router answers within {timeout_s:g} s: {found}")
    return session


def endpoints_of(connect: Union[str, Iterable[str]]) -> List[str]:
    """One endpoint or several, each checked."""
    if isinstance(connect, str):
        endpoints = [connect]
    else:
        endpoints = list(connect) if isinstance(connect, Iterable) else []
    if not endpoints:
        expected = f"expected a Zenoh endpoint such as {DEFAULT_ENDPOINT}"
        raise InvalidValue("connect", connect, expected)
    for endpoint in endpoints:
        _check_endpoint(endpoint)
    return endpoints


def _opened(config: zenoh.Config) -> Optional[zenoh.Session]:
    """A session, if one can be opened; on a thread of its own, so that Ctrl-C does not have to wait
    for it."""
    opened: List[zenoh.Session] = []

    def run() -> None:
        try:
            opened.append(zenoh.open(config))
        except zenoh.ZError as error:
            _log.debug("open a Zenoh session: %s", reason(error))

    thread = threading.Thread(target=run, name="cogmap-open", daemon=True)
    thread.start()
    thread.join()
    return opened[0] if opened else None


def reason(error: zenoh.ZError) -> str:
    """What an error of Zenoh says, without where in its sources it was found."""
    return _SOURCE.sub("", str(error)).strip().rstrip(".")


def _check_endpoint(endpoint: str) -> None:
    example = f"such as {DEFAULT_ENDPOINT}"
    if not isinstance(endpoint, str) or "://" in endpoint or not _ENDPOINT.fullmatch(endpoint):
        raise InvalidValue("connect", endpoint, f"expected a Zenoh endpoint {example}")
    if _WITH_PORT.match(endpoint) and not _PORT.fullmatch(endpoint):
        raise InvalidValue("connect", endpoint, f"expected an endpoint with a port {example}")


def _probe(endpoint: str) -> str:
    """What is found at an endpoint that does not answer."""
    protocol, _, address = endpoint.partition("/")
    host, _, port = re.split(r"[?#]", address)[0].rpartition(":")
    if protocol not in ("tcp", "tls"):
        return "does not answer"
    try:
        socket.create_connection((host.strip("[]"), int(port)), _PROBE_S).close()
    except (OSError, ValueError, OverflowError) as error:
        return f"does not answer ({getattr(error, 'strerror', None) or error})"
    causes = ["the credentials are wrong", "it is another port, such as HTTP's"]
    if protocol == "tls":
        causes.insert(0, "no authority that is known here has signed the router's certificate")
    else:
        causes.insert(1, "the router wants tls/")
    return f"is open, but no Zenoh router there lets a robot in: {', or '.join(causes)}"
