"""Why the service refuses a request, as it says it over HTTP and Zenoh (RFC 9457)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Dict, Mapping, Optional

from .errors import ApiError


@dataclass(frozen=True)
class Problem:
    """A problem."""

    #: Kind, stable, for programs: `/problems/{kind}`.
    kind: str
    #: The same for people.
    title: str
    #: HTTP status.
    status: int
    #: What was wrong this time.
    detail: str

    WIRE_NAMES: ClassVar[Dict[str, str]] = {"kind": "type"}

    @property
    def says_unknown_agent(self) -> bool:
        """Whether the space is there and has not met the agent yet."""
        return self.kind.endswith("/unknown-agent")

    @property
    def blames_the_request(self) -> bool:
        """Whether asking again would not help."""
        return 400 <= self.status < 500

    def error(self, where: str, extra: Optional[Mapping[str, Any]] = None) -> ApiError:
        """The error to raise; `where` is the key or address that was asked."""
        return ApiError(self.status, self.kind, self.title, self.detail, extra, where=where)
