"""Errors that a caller may want to tell apart. Each is a `CogmapError`, and where the standard library has an
error for the same thing, that one too."""

from __future__ import annotations

from typing import Any, Mapping, Optional


class CogmapError(Exception):
    """Parent of every error of this package."""


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


class WindowFull(CogmapError):
    """The window of unacknowledged samples stayed full for the whole timeout.

    `accepted` samples of the call entered the window; the others did not.
    """

    def __init__(self, accepted: int, capacity_samples: int) -> None:
        super().__init__(
            f"no acknowledgement in time, and the window of {capacity_samples} samples is full; "
            f"{accepted} samples of this call were taken"
        )
        self.accepted = accepted


class SessionSuperseded(CogmapError):
    """Another run of the agent has taken over its name, or uses this run's session number; what this one
    sends is ignored."""

    def __init__(self, own: int, other: int) -> None:
        super().__init__(
            f"session {own} was taken over by session {other}"
            if other != own
            else f"session {own} is in use by another run of the agent"
        )
        self.own = own
        self.other = other


class Closed(CogmapError):
    """The robot has been closed."""


class ApiError(CogmapError):
    """The HTTP interface refused a request (RFC 9457, `application/problem+json`)."""

    def __init__(
        self,
        status: int,
        kind: str,
        title: str,
        detail: str,
        extra: Optional[Mapping[str, Any]] = None,
    ) -> None:
        super().__init__(f"{status} {title}: {detail}" if detail else f"{status} {title}")
        #: HTTP status.
        self.status = status
        #: Kind of the problem, stable, for programs: `/problems/{kind}`.
        self.kind = kind
        #: The same for people.
        self.title = title
        #: What was wrong this time.
        self.detail = detail
        #: Further members of the problem, for example `expected_seq` after a gap in posted samples.
        self.extra: Mapping[str, Any] = dict(extra or {})


def _short(shown: str) -> str:
    """At most some hundred characters: a value may be a whole image descriptor."""
    return shown if len(shown) <= 120 else f"{shown[:100]}... ({len(shown)} characters)"
