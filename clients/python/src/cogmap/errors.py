"""Errors that a caller may want to tell apart. Each is a `CogmapError`, and where the standard
library has an error for the same thing, that one too."""

from __future__ import annotations

from typing import Any, Dict, Mapping, Optional, Tuple, Type


class CogmapError(Exception):
    """Parent of every error of this package. Errors can be pickled, so that they come through from
    the processes of a pool."""

    def __reduce__(self) -> Tuple[Any, ...]:
        return _unpickled, (type(self), self.args, self.__dict__)


class InvalidValue(CogmapError, ValueError):
    """A value that was handed over makes no sense; nothing of the call was taken in.

    `field` names it, for example `translation_m[1]`, and `value` is what was given.
    """

    def __init__(
        self, field: str, value: object, expected: str, found: Optional[str] = None
    ) -> None:
        shown = _short(repr(value)) if found is None else found
        super().__init__(f"{field}: {expected}, not {shown}")
        self.field = field
        self.value = value


class WireError(CogmapError, ValueError):
    """A message that came is not what its type says."""


class Unreachable(CogmapError, ConnectionError):
    """Nothing answers at an address, or the connection broke."""


class Timeout(CogmapError, TimeoutError):
    """The service did not answer, or did not acknowledge, in time. Nothing is lost: samples without
    acknowledgement are still held and sent again."""


class ClockWarning(UserWarning):
    """The stamps of a robot's samples are of two clocks, or say that it is faster than any
    robot."""


class WindowFull(CogmapError):
    """The window of unacknowledged samples stayed full for the whole timeout.

    `accepted` samples of the call entered the window; the others did not.
    """

    def __init__(self, accepted: int, pending: int, why: str = "") -> None:
        super().__init__(
            f"the window is full with {pending} samples that were not acknowledged in time{why}; "
            f"{accepted} samples of this call were taken"
        )
        self.accepted = accepted


class SessionSuperseded(CogmapError):
    """Another run of the agent has taken over its name, or uses this run's session number; what
    this one sends is ignored."""

    def __init__(self, agent: str, own: int, other: int) -> None:
        super().__init__(
            f"session {own} of agent {agent} was taken over by session {other}"
            if other != own
            else f"session {own} of agent {agent} is in use by another run of the agent"
        )
        self.own = own
        self.other = other


class CalledFromCallback(CogmapError, RuntimeError):
    """A callback would wait for what its own thread has to bring."""


class Closed(CogmapError):
    """The robot has been closed."""


class ApiError(CogmapError):
    """The service refused a request, over HTTP or Zenoh (RFC 9457, `application/problem+json`)."""

    def __init__(
        self,
        status: int,
        kind: str,
        title: str,
        detail: str,
        extra: Optional[Mapping[str, Any]] = None,
        where: str = "",
        retry_after_s: Optional[float] = None,
    ) -> None:
        told = f"{status} {title}: {detail}" if detail else f"{status} {title}"
        super().__init__(f"{told} ({where})" if where else told)
        #: HTTP status.
        self.status = status
        #: Kind of the problem, stable, for programs: `/problems/{kind}`.
        self.kind = kind
        #: The same for people.
        self.title = title
        #: What was wrong this time.
        self.detail = detail
        #: What was asked: a method and an address, or a key and an address.
        self.where = where
        #: Further members of the problem, for example `expected_seq` after a gap in posted samples.
        self.extra: Mapping[str, Any] = dict(extra or {})
        #: When to ask again [s]; `None` if the service does not say.
        self.retry_after_s = retry_after_s


def _unpickled(
    kind: Type[CogmapError], args: Tuple[Any, ...], state: Dict[str, Any]
) -> CogmapError:
    """An error as it was; its `__init__` takes other arguments than its message."""
    error = kind.__new__(kind, *args)
    error.__dict__.update(state)
    return error


def _short(shown: str) -> str:
    """One line of at most some hundred characters: a value may be a whole image descriptor."""
    shown = " ".join(shown.split())
    return shown if len(shown) <= 120 else f"{shown[:100]}... ({len(shown)} characters)"
