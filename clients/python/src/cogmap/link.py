"""The Zenoh session of a robot: opened with everything explicit, closed within a bound."""

from __future__ import annotations

import json
import threading
from typing import Any, Callable, Iterable, Optional, Union

import zenoh

from .credentials import Credentials
from .errors import CogmapError, Timeout
from .wire import CBOR, encode

#: Where a Zenoh router listens unless told otherwise.
DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
#: How long a query may take [s].
_QUERY_TIMEOUT_S = 2.0


def open_session(
    connect: Union[str, Iterable[str]] = DEFAULT_ENDPOINT,
    *,
    credentials: Optional[Credentials] = None,
    timeout_s: float = 10.0,
) -> zenoh.Session:
    """Opens a Zenoh session in client mode to one of the endpoints, without multicast.

    Several robots of one process may share it. Raises `Timeout` when no endpoint answers in time, or none
    accepts the credentials, and `CogmapError` when the credentials' files cannot be used.
    """
    endpoints = [connect] if isinstance(connect, str) else list(connect)
    try:
        config = (credentials or Credentials()).config()
    except zenoh.ZError as error:
        raise CogmapError(f"credentials: {error}") from error
    config.insert_json5("mode", json.dumps("client"))
    config.insert_json5("connect/endpoints", json.dumps(endpoints))
    config.insert_json5("connect/timeout_ms", json.dumps(max(1, int(1000 * timeout_s))))
    config.insert_json5("connect/exit_on_failure", "true")
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("scouting/multicast/enabled", "false")
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        at = ", ".join(endpoints)
        raise Timeout(f"no Zenoh router at {at} let this robot in: {error}") from error


def has_subscriber(publisher: zenoh.Publisher) -> bool:
    """Whether anybody subscribes to what is published here."""
    status: object = publisher.matching_status
    # The type stubs of zenoh 1.10 say bool; what comes is an object, and that is always true.
    return bool(getattr(status, "matching", status))


def ask(
    session: zenoh.Session,
    key: str,
    body: Any,
    hear_reply: Callable[[zenoh.Reply], None],
    ended: Callable[[], None],
) -> None:
    """Asks without waiting: `hear_reply` gets each answer, and `ended` is called when no more come."""
    session.get(
        key,
        zenoh.handlers.Callback(hear_reply, ended),
        payload=encode(body),
        encoding=CBOR,
        timeout=_QUERY_TIMEOUT_S,
    )


def within(timeout_s: float, *actions: Callable[[], object]) -> bool:
    """Runs teardown steps in order on a thread of their own; says whether they ended in time.

    A step that hangs on a dead network must not hang the robot's program.
    """

    def run() -> None:
        for action in actions:
            try:
                action()
            except zenoh.ZError:
                # The session is gone already, which is what the step was for.
                continue

    thread = threading.Thread(target=run, name="cogmap-close", daemon=True)
    thread.start()
    thread.join(timeout_s)
    return not thread.is_alive()
