"""When a request is sent again: while its space moves to another owner, or to another address."""

from __future__ import annotations

import errno
import socket
import time
import urllib.error
from typing import Iterable, Optional, Tuple, Union

from .errors import ApiError, Timeout, Unreachable
from .url import checked_urls

#: How long a request is sent again unless told otherwise [s]: longer than another node needs to
#: take over from one that is gone.
RETRY_TIMEOUT_S = 30.0
#: Pause before a request is sent again where the service names none [s].
_PAUSE_S = 0.5
#: Shortest pause, whatever the service says [s].
_PAUSE_MIN_S = 0.01

#: No such machine is in reach.
_AWAY = (errno.EHOSTUNREACH, errno.ENETUNREACH)

#: The space has no owner at the moment; nothing was done.
_MOVING = "/problems/moving"
#: The owner of the space did not answer; what was asked may have been done.
_OWNER_LOST = "/problems/owner-lost"


class Retries:
    """The repetitions of one request, for `timeout_s` from now on.

    Args:
        repeatable: Whether sending it twice does no more than sending it once.
    """

    def __init__(self, timeout_s: float, repeatable: bool) -> None:
        self._until = time.monotonic() + timeout_s
        self._repeatable = repeatable

    def pause_after(self, error: ApiError) -> Optional[float]:
        """How long to wait before the request is sent again [s]; `None` where the error stands."""
        is_passing = error.kind == _MOVING or (self._repeatable and error.kind == _OWNER_LOST)
        left_s = self._until - time.monotonic()
        if not is_passing or left_s <= 0:
            return None
        told_s = _PAUSE_S if error.retry_after_s is None else error.retry_after_s
        return min(max(told_s, _PAUSE_MIN_S), left_s)

    def may_go_elsewhere(self, error: Union[Timeout, Unreachable]) -> bool:
        """Whether another address may be asked at once: nothing answers at this one, or the
        connection broke and the request may be sent twice."""
        cause = error.__cause__
        reason = cause.reason if isinstance(cause, urllib.error.URLError) else cause
        if isinstance(reason, (ConnectionRefusedError, socket.gaierror)):
            return True
        if isinstance(reason, OSError) and reason.errno in _AWAY:
            return True
        broke = isinstance(reason, (ConnectionError, TimeoutError, socket.timeout))
        return self._repeatable and broke


class Addresses:
    """Addresses at which the same spaces can be asked, as those of the nodes of a cluster."""

    def __init__(self, url: Union[str, Iterable[str]]) -> None:
        self._all: Tuple[str, ...] = checked_urls(url)
        self._index = 0

    def __len__(self) -> int:
        return len(self._all)

    @property
    def in_use(self) -> str:
        """The address that is asked."""
        return self._all[self._index]

    def leave(self, url: str) -> None:
        """Uses the address after this one, unless another thread has gone on already."""
        if self.in_use == url:
            self._index = (self._all.index(url) + 1) % len(self._all)


def seconds_of(retry_after: Optional[str]) -> Optional[float]:
    """A header `Retry-After` in seconds; its other form, a date, is not read."""
    told = "" if retry_after is None else retry_after.strip()
    return float(told) if told.isascii() and told.isdigit() else None
