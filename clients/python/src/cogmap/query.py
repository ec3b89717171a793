"""Bodies of queries, the same over HTTP and Zenoh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple, Union, get_args

from .sample import Descriptor, Increment, Level, Velocity
from .scalar import COUNT_RANGE, STAMP_RANGE, number, one_of, whole
from .vector import Vec3, vec3

#: A percept to recall places by; a level's `offset_m` and `normal` say nothing there.
PerceptCue = Union[Level, Descriptor]
#: A motion that is asked about.
MotionBody = Union[Increment, Velocity]


#: Fields of `RecallQuery` that are integers.
_WHOLE = (("since_ns", STAMP_RANGE), ("until_ns", STAMP_RANGE), ("limit", COUNT_RANGE))


@dataclass(frozen=True)
class WatermarkQuery:
    """Asks for the watermark of an agent."""

    agent: str


@dataclass(frozen=True)
class RecallQuery:
    """Asks for places. `position_m`, `code` and `percept` are the cues that rank them, the other
    fields filter; without a cue the latest places come first."""

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
    #: Cue: a percept. Only places that remember something of its channel answer.
    percept: Optional[PerceptCue] = None

    def __post_init__(self) -> None:
        if self.position_m is not None:
            object.__setattr__(self, "position_m", vec3("position_m", self.position_m))
        if self.code is not None:
            code = tuple(None if phase is None else vec3("code", phase) for phase in self.code)
            object.__setattr__(self, "code", code)
        if self.radius_m is not None:
            object.__setattr__(self, "radius_m", number("radius_m", self.radius_m))
        for name, bounds in _WHOLE:
            if getattr(self, name) is not None:
                object.__setattr__(self, name, whole(name, getattr(self, name), bounds))
        if self.percept is not None:
            one_of("percept", self.percept, get_args(PerceptCue))


@dataclass(frozen=True)
class PredictQuery:
    """Asks what an agent would feel if it moved so."""

    #: The agent. Over HTTP it is in the path, and absent here or the same.
    agent: Optional[str]
    #: The motion, from where the agent is now.
    motion: MotionBody
    #: Where the sensor of levels sits in the body frame [m]; descriptors are seen at the body.
    offset_m: Vec3 = (0.0, 0.0, 0.0)
    #: Only what is felt on this channel.
    channel: Optional[str] = None

    def __post_init__(self) -> None:
        one_of("motion", self.motion, get_args(MotionBody))
        object.__setattr__(self, "offset_m", vec3("offset_m", self.offset_m))
