"""Requests to a node as any program could make them, which shows what the Python client hides: it
asks again by itself."""

from __future__ import annotations

import http.client
import json
import urllib.parse
from dataclasses import dataclass
from typing import Any, Optional

from cogmap.wire import CBOR, JSON
from wait import eventually

#: Answers after which a question is asked again: the owner is lost or changes, the node is loading,
#: closing or has too much to do, or an answer took too long.
AGAIN = frozenset((502, 503, 504))
#: Longest wait for one answer of a node that may be gone [s].
_ANSWER_S = 5.0


@dataclass(frozen=True)
class Answer:
    """What a node answers."""

    status: int
    #: JSON, or the text where it is none.
    body: Any

    @property
    def is_good(self) -> bool:
        """Whether what was asked for was done."""
        return 200 <= self.status < 300


class Line:
    """A connection to a node, made anew when it was lost.

    Args:
        url: Base of the node's HTTP interface.
        timeout_s: Longest wait for an answer [s].
    """

    def __init__(self, url: str, timeout_s: float = _ANSWER_S) -> None:
        parts = urllib.parse.urlsplit(url)
        assert parts.hostname is not None
        self._http = http.client.HTTPConnection(parts.hostname, parts.port, timeout=timeout_s)

    def ask(self, method: str, path: str, body: Optional[bytes] = None, kind: str = JSON) -> Answer:
        """Asks once.

        Raises `OSError` when no answer comes.
        """
        headers = {"Accept": JSON}
        if body is not None:
            headers["Content-Type"] = kind
        try:
            self._http.request(method, path, body, headers)
            answer = self._http.getresponse()
            data = answer.read()
        except http.client.HTTPException as error:
            self._http.close()
            raise ConnectionError(f"{method} {path}: {error!r}") from error
        except OSError:
            self._http.close()
            raise
        try:
            return Answer(answer.status, json.loads(data))
        except ValueError:
            return Answer(answer.status, data.decode("utf-8", "replace"))

    def post_samples(self, space: str, agent: str, message: bytes) -> Answer:
        """Sends a batch of samples, in CBOR; raises as `ask`."""
        return self.ask("POST", samples_path(space, agent), message, CBOR)

    def close(self) -> None:
        """Closes the connection."""
        self._http.close()


def samples_path(space: str, agent: str) -> str:
    """Where samples are sent."""
    return f"/v1/spaces/{space}/agents/{agent}/samples"


def ask(url: str, method: str, path: str) -> Answer:
    """Asks a node once; raises `OSError` when no answer comes."""
    line = Line(url)
    try:
        return line.ask(method, path)
    finally:
        line.close()


def insist(
    url: str, method: str, path: str, body: Optional[bytes] = None, kind: str = JSON
) -> Any:
    """Asks a node until it has done what was asked, and returns what it says."""
    line = Line(url)
    last = "nothing"

    def look() -> Optional[Answer]:
        nonlocal last
        try:
            answer = line.ask(method, path, body, kind)
        except OSError as error:
            last = repr(error)
            return None
        if answer.status in AGAIN:
            last = str(answer)
            return None
        assert answer.is_good, f"{method} {url}{path}: {answer}"
        return answer

    try:
        return eventually(f"an answer to {method} {url}{path}", look).body
    except AssertionError as error:
        raise AssertionError(f"{error}; {last} came last") from error
    finally:
        line.close()
