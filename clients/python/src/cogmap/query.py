"""Bodies of queries, the same over HTTP and Zenoh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from .vector import Vec3, vec3


@dataclass(frozen=True)
class WatermarkQuery:
    """Asks for the watermark of an agent."""

    agent: str


@dataclass(frozen=True)
class RecallQuery:
    """Asks for places. `position_m` and `code` are the cues that rank them, the other fields filter;
    without a cue the latest places come first."""

    #: Cue: a position in `map` [m].
    position_m: Optional[Vec3] = None
    #: Cue: a grid code, one entry per module: phase `[0, 1)³`, or `None` for an erased module.
    code: Optional[Tuple[Optional[Vec3], ...]] = None
    #: Only places within this distance of `position_m` [m].
    radius_m: Optional[float] = None
    #: Only places that this agent founded.
    agent: Optional[str] = None
    #: Only places visited at or after this stamp [ns].
    since_ns: Optional[int] = None
    #: Only places founded before this stamp [ns].
    until_ns: Optional[int] = None
    #: Most places in the answer, 1 to 1000; 10 when absent.
    limit: Optional[int] = None

    def __post_init__(self) -> None:
        if self.position_m is not None:
            object.__setattr__(self, "position_m", vec3("position_m", self.position_m))
        if self.code is not None:
            code = tuple(None if phase is None else vec3("code", phase) for phase in self.code)
            object.__setattr__(self, "code", code)
        if self.radius_m is not None:
            object.__setattr__(self, "radius_m", float(self.radius_m))
