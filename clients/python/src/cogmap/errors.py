"""Errors that a caller may want to tell apart. Failures of the network itself stay `OSError`."""

from __future__ import annotations

from typing import Any, Mapping, Optional


class CogmapError(Exception):
    """Parent of every error of this package."""


class WireError(CogmapError, ValueError):
    """A message is not what its type says, or a sample cannot be written."""


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
