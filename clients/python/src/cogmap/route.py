"""Routes: how one gets from here to there.

Positions are in the frame `map`, in metres; rotations are unit quaternions `[x, y, z, w]`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar, Optional, Tuple, Union, get_args

from .key import check_name
from .query import PerceptCue
from .scalar import COUNT_RANGE, all_of, label, number, one_of, whole
from .vector import Quaternion, Vec3, vec3


@dataclass(frozen=True)
class AtPlace:
    """A place, by its number."""

    TAG: ClassVar[str] = "place"
    NEWTYPE: ClassVar[bool] = True
    place: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "place", whole("place", self.place, COUNT_RANGE))


@dataclass(frozen=True)
class AtPosition:
    """A position in `map` [m], within two field radii of a place."""

    TAG: ClassVar[str] = "position_m"
    NEWTYPE: ClassVar[bool] = True
    position_m: Vec3

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_m", vec3("position_m", self.position_m))


@dataclass(frozen=True)
class AtAgent:
    """Where an agent is, by its name."""

    TAG: ClassVar[str] = "agent"
    NEWTYPE: ClassVar[bool] = True
    name: str

    def __post_init__(self) -> None:
        check_name("name", self.name)


@dataclass(frozen=True)
class AtLandmark:
    """The place nearest to a landmark, by its label."""

    TAG: ClassVar[str] = "landmark"
    NEWTYPE: ClassVar[bool] = True
    label: str

    def __post_init__(self) -> None:
        label("label", self.label)


@dataclass(frozen=True)
class AtTrip:
    """Where a trip began, by its number."""

    TAG: ClassVar[str] = "trip"
    NEWTYPE: ClassVar[bool] = True
    trip: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "trip", whole("trip", self.trip, COUNT_RANGE))


@dataclass(frozen=True)
class AtHome:
    """Where an agent's session began, by the agent's name."""

    TAG: ClassVar[str] = "home"
    NEWTYPE: ClassVar[bool] = True
    name: str

    def __post_init__(self) -> None:
        check_name("name", self.name)


@dataclass(frozen=True)
class AtPercept:
    """The place that a percept recalls best."""

    TAG: ClassVar[str] = "percept"
    NEWTYPE: ClassVar[bool] = True
    percept: PerceptCue

    def __post_init__(self) -> None:
        one_of("percept", self.percept, get_args(PerceptCue))


@dataclass(frozen=True)
class AtBack:
    """Where an agent was in this session so long ago, `s` [s], or so far back along its path, `m`
    [m]: one of the two."""

    TAG: ClassVar[str] = "back"
    agent: str
    s: Optional[float] = None
    m: Optional[float] = None

    def __post_init__(self) -> None:
        check_name("agent", self.agent)
        for name in ("s", "m"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, number(name, getattr(self, name)))


class RetraceDirection(str, Enum):
    """In which direction a trip is travelled again."""

    #: To where it ended.
    FORWARD = "forward"
    #: To where it began.
    BACKWARD = "backward"


@dataclass(frozen=True)
class Retrace:
    """The end of a trip, by its own legs from the point on it that is nearest; only as a goal."""

    TAG: ClassVar[str] = "retrace"
    trip: int
    direction: RetraceDirection = RetraceDirection.FORWARD

    def __post_init__(self) -> None:
        object.__setattr__(self, "trip", whole("trip", self.trip, COUNT_RANGE))


#: Where a route begins or ends.
RouteEnd = Union[
    AtPlace, AtPosition, AtAgent, AtLandmark, AtTrip, AtHome, AtPercept, AtBack, Retrace
]


class RouteCost(str, Enum):
    """What is to be least on a route."""

    #: Length [m].
    LENGTH = "length"
    #: Mean duration [s].
    TIME = "time"
    #: Variance of the position at the end [m²], by what was measured along the ways.
    UNCERTAINTY = "uncertainty"
    #: Length [m], twice as much for each half-life of memories since a way was travelled.
    RECENCY = "recency"


class RouteReverse(str, Enum):
    """Whether ways may be taken in a direction in which nobody has travelled them."""

    ALLOWED = "allowed"
    NEVER = "never"


class RouteFormat(str, Enum):
    """The form of a route."""

    #: Steps from place to place.
    STEPS = "steps"
    #: Steps, and poses at equal distances along them.
    PATH = "path"


@dataclass(frozen=True)
class RouteBox:
    """A box along the axes of `map`."""

    #: The corner with the least coordinates [m].
    min_m: Vec3
    #: The corner opposite [m].
    max_m: Vec3

    def __post_init__(self) -> None:
        object.__setattr__(self, "min_m", vec3("min_m", self.min_m))
        object.__setattr__(self, "max_m", vec3("max_m", self.max_m))


@dataclass(frozen=True)
class RouteAvoid:
    """What a route is to keep clear of."""

    #: Places that it does not lead through.
    places: Tuple[int, ...] = ()
    #: Boxes that it does not lead into.
    boxes: Tuple[RouteBox, ...] = ()

    def __post_init__(self) -> None:
        places = tuple(whole("places", place, COUNT_RANGE) for place in self.places)
        object.__setattr__(self, "places", places)
        object.__setattr__(self, "boxes", all_of("boxes", self.boxes, (RouteBox,)))


@dataclass(frozen=True)
class RouteQuery:
    """Asks for a route over the ways that the team has gone."""

    WIRE_NAMES: ClassVar = {"start": "from", "goal": "to"}

    #: Where it begins.
    start: RouteEnd
    #: Where it ends.
    goal: RouteEnd
    #: What is to be least.
    cost: RouteCost = RouteCost.LENGTH
    #: Whether ways may be taken backwards.
    reverse: RouteReverse = RouteReverse.ALLOWED
    #: What the route is to keep clear of.
    avoid: RouteAvoid = RouteAvoid()
    #: Whether it may cut corners, within the corridor that bodies have swept along the ways.
    shortcuts: bool = False
    #: Half the width of that corridor [m]; 0.15 when absent.
    body_radius_m: Optional[float] = None
    #: Most other routes to answer, 0 to 4, which share at most half their length with others.
    alternatives: int = 0
    #: In which form.
    format: RouteFormat = RouteFormat.STEPS
    #: Distance of the poses of a path [m]; 0.25 when absent.
    spacing_m: Optional[float] = None

    def __post_init__(self) -> None:
        one_of("start", self.start, get_args(RouteEnd))
        one_of("goal", self.goal, get_args(RouteEnd))
        object.__setattr__(
            self, "alternatives", whole("alternatives", self.alternatives, COUNT_RANGE)
        )
        for name in ("body_radius_m", "spacing_m"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, number(name, getattr(self, name)))


class RouteWay(str, Enum):
    """How the way of a step is known."""

    #: Somebody travelled it.
    TRAVELLED = "travelled"
    #: Somebody travelled it, but only the other way.
    REVERSED = "reversed"
    #: A straight line between two places, within the corridor that bodies have swept.
    SHORTCUT = "shortcut"
    #: Beside the places, in a straight line.
    APPROACH = "approach"
    #: A way that this version of the package does not know.
    UNKNOWN = "unknown"

    @classmethod
    def _missing_(cls, value: object) -> RouteWay:
        return cls.UNKNOWN


@dataclass(frozen=True)
class RouteStep:
    """A step of a route: where it leads, and the way there."""

    #: The place, which may have been forgotten; absent beside the places.
    place: Optional[int]
    translation_m: Vec3
    #: Orientation along the way.
    rotation_xyzw: Quaternion
    #: How far off one may be and still be there [m].
    tolerance_m: float
    #: Standard deviation of the position there [m].
    sd_m: float
    #: How the way there is known.
    way: RouteWay
    #: Its length [m].
    length_m: float
    #: Its duration to be expected [s].
    duration_s: float
    #: Times that it was travelled in this direction.
    traversals: int
    #: Latest stamp at which somebody came to its end, in either direction [ns].
    last_stamp_ns: Optional[int]
    #: The trip that led along it last, in this direction if any did.
    trip: Optional[int]
    #: The number of the leg in that trip, counted from 0.
    leg: Optional[int]


@dataclass(frozen=True)
class RoutePose:
    """A pose on a path."""

    translation_m: Vec3
    #: Orientation along the way.
    rotation_xyzw: Quaternion


@dataclass(frozen=True)
class Route:
    """Another route."""

    #: What it costs, in units of what was to be least.
    cost: float
    length_m: float
    #: Duration to be expected [s].
    duration_s: float
    #: Standard deviation of the position at the end [m].
    sd_m: float
    steps: Tuple[RouteStep, ...]
    #: Poses along it at equal distances, if they were asked for.
    path: Optional[Tuple[RoutePose, ...]]


@dataclass(frozen=True)
class RouteAnswer:
    """The cheapest route, and others."""

    space: str
    frame: str
    map_revision: int
    #: What it costs, in units of what was to be least.
    cost: float
    length_m: float
    #: Duration to be expected [s].
    duration_s: float
    #: Standard deviation of the position at the end [m].
    sd_m: float
    #: Where it leads, one step after the other; none where start and goal are the same.
    steps: Tuple[RouteStep, ...]
    #: Poses along it at equal distances, if they were asked for.
    path: Optional[Tuple[RoutePose, ...]]
    #: Other routes, the cheaper ones first.
    alternatives: Tuple[Route, ...]
