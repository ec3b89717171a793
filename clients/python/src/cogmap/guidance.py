"""Guidance: blockages, and routes that agents follow.

Positions are in the frame `map`, in metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar, Optional, Tuple, get_args

from .route import RouteAvoid, RouteCost, RouteEnd, RouteReverse, RouteStep
from .scalar import COUNT_RANGE, number, one_of, whole
from .vector import Vec3, vec3


@dataclass(frozen=True)
class BlockageRequest:
    """Says where nobody gets through: exactly one of a `place`, the way from `start` to `end`, and
    the ball of `radius_m` about `at_m`."""

    WIRE_NAMES: ClassVar = {"start": "from", "end": "to"}

    #: A place, with all ways to it.
    place: Optional[int] = None
    #: One end of a way, which is blocked in both directions.
    start: Optional[int] = None
    #: Its other end.
    end: Optional[int] = None
    #: The middle of a ball, which blocks all ways whose straight lines meet it.
    at_m: Optional[Vec3] = None
    #: The radius of the ball [m].
    radius_m: Optional[float] = None
    #: It ends with the first sample of any agent that has this stamp or a later one [ns].
    until_ns: Optional[int] = None

    def __post_init__(self) -> None:
        for name in ("place", "start", "end"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, whole(name, getattr(self, name), COUNT_RANGE))
        if self.at_m is not None:
            object.__setattr__(self, "at_m", vec3("at_m", self.at_m))
        if self.radius_m is not None:
            object.__setattr__(self, "radius_m", number("radius_m", self.radius_m))


@dataclass(frozen=True)
class Blockage:
    """A blockage: of a place, of a way, or of a ball."""

    WIRE_NAMES: ClassVar = {"start": "from", "end": "to"}

    #: Its number, which no other one has had.
    id: int
    place: Optional[int]
    start: Optional[int]
    end: Optional[int]
    at_m: Optional[Vec3]
    radius_m: Optional[float]
    #: The stamp with which it ends [ns].
    until_ns: Optional[int]


@dataclass(frozen=True)
class BlockageList:
    """The blockages of a space, by number."""

    blockages: Tuple[Blockage, ...]


@dataclass(frozen=True)
class FollowRequest:
    """Lets an agent follow a route from where it is."""

    WIRE_NAMES: ClassVar = {"goal": "to"}

    #: Where it is to go. What moves is taken where it is now.
    goal: RouteEnd
    #: What is to be least.
    cost: RouteCost = RouteCost.LENGTH
    #: Whether ways may be taken backwards.
    reverse: RouteReverse = RouteReverse.ALLOWED
    #: What the route is to keep clear of.
    avoid: RouteAvoid = RouteAvoid()

    def __post_init__(self) -> None:
        one_of("goal", self.goal, get_args(RouteEnd))


@dataclass(frozen=True)
class FollowedRoute:
    """What is left of the route that an agent follows."""

    space: str
    agent: str
    frame: str
    map_revision: int
    #: Length that is left [m].
    length_m: float
    #: Duration to be expected of the steps that are left [s].
    duration_s: float
    #: Steps of the route that it has gone.
    steps_done: int
    #: The steps that are left; none where it has arrived.
    steps: Tuple[RouteStep, ...]


@dataclass(frozen=True)
class FollowedRouteSummary:
    """What is left of the route that an agent follows, without the steps."""

    agent: str
    #: Length that is left [m].
    length_m: float
    #: Duration to be expected of the steps that are left [s].
    duration_s: float
    #: Steps of the route that it has gone.
    steps_done: int
    #: Steps that are left; none where it has arrived.
    steps_left: int


@dataclass(frozen=True)
class FollowedRoutePage:
    """Agents that follow routes, by name."""

    map_revision: int
    routes: Tuple[FollowedRouteSummary, ...]
    #: Name to go on after; absent on the last page.
    next: Optional[str] = None


class RouteFailure(str, Enum):
    """Why an agent follows no route any more."""

    #: No way leads there any more.
    NO_WAY = "no_way"
    #: The goal has been forgotten.
    GOAL_FORGOTTEN = "goal_forgotten"
    #: No place is near the agent.
    NOTHING_NEAR = "nothing_near"
    #: It is not known where the agent is.
    AGENT_LOST = "agent_lost"
    #: The agent has begun another session.
    SESSION_ENDED = "session_ended"
    #: A reason that this version of the package does not know.
    UNKNOWN = "unknown"

    @classmethod
    def _missing_(cls, value: object) -> RouteFailure:
        return cls.UNKNOWN
