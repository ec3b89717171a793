"""Events: what happened in a space, for whoever follows it."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any, ClassVar, Dict, Optional, Tuple, Union

from .answer import SkipReason, TripEnd
from .guidance import RouteFailure
from .route import RouteStep
from .vector import Vec3


@dataclass(frozen=True)
class AgentEnrolled:
    """The space met a new agent."""

    TAG: ClassVar[str] = "agent_enrolled"


@dataclass(frozen=True)
class AgentRemoved:
    """The agent was removed, by whoever runs the service or to make room. What it did in the map
    stays; a message under its name enrols another agent."""

    TAG: ClassVar[str] = "agent_removed"


@dataclass(frozen=True)
class SessionStarted:
    """The agent began a session."""

    TAG: ClassVar[str] = "session_started"
    session: int


@dataclass(frozen=True)
class PlaceRecruited:
    """A place cell was recruited."""

    TAG: ClassVar[str] = "place_recruited"
    place: int
    #: Its position in `map` [m].
    translation_m: Vec3


@dataclass(frozen=True)
class PlaceEntered:
    """The agent came to a place that the space knew."""

    TAG: ClassVar[str] = "place_entered"
    place: int
    #: Confidence of the recall, in [0, 1].
    confidence: float


@dataclass(frozen=True)
class TripStarted:
    """A trip began."""

    TAG: ClassVar[str] = "trip_started"
    trip: int


@dataclass(frozen=True)
class TripEnded:
    """A trip ended."""

    TAG: ClassVar[str] = "trip_ended"
    trip: int
    #: Its number of legs.
    legs: int
    reason: TripEnd


@dataclass(frozen=True)
class LandmarkLearned:
    """A landmark was seen for the first time."""

    TAG: ClassVar[str] = "landmark_learned"
    landmark: str
    #: Its position in `map` [m].
    translation_m: Vec3


@dataclass(frozen=True)
class SamplesSkipped:
    """Samples from `start` up to but without `stop` were refused for good."""

    TAG: ClassVar[str] = "samples_skipped"
    start: int
    stop: int
    reason: SkipReason

    WIRE_NAMES: ClassVar[Dict[str, str]] = {"start": "from", "stop": "to"}


@dataclass(frozen=True)
class MarkerPassed:
    """The agent passed a marker."""

    TAG: ClassVar[str] = "marker_passed"
    label: str


class PerceptKind(str, Enum):
    """What kind of percept a channel carries."""

    #: Scalars.
    LEVEL = "level"
    #: Unit vectors.
    DESCRIPTOR = "descriptor"
    #: A kind that this version of the package does not know.
    UNKNOWN = "unknown"

    @classmethod
    def _missing_(cls, value: object) -> PerceptKind:
        return cls.UNKNOWN


@dataclass(frozen=True)
class PerceptSurprising:
    """A percept was far from what its place remembers of the channel."""

    TAG: ClassVar[str] = "percept_surprising"
    place: int
    #: Name of the channel.
    channel: str
    #: What kind of percept it was.
    percept: PerceptKind
    #: Number of percepts that taught what to expect, 3 at least.
    percepts: int
    #: How far it was from that: for a level in standard deviations, above 4; for a descriptor one
    #: minus the cosine, above 0.5.
    surprise: float


@dataclass(frozen=True)
class PlaceForgotten:
    """A place was forgotten: there was no room for the one recruited next."""

    TAG: ClassVar[str] = "place_forgotten"
    place: int
    #: Its position in `map` [m].
    translation_m: Vec3


@dataclass(frozen=True)
class TripForgotten:
    """A trip was forgotten: there was no room for the leg recorded next."""

    TAG: ClassVar[str] = "trip_forgotten"
    trip: int
    #: Its number of legs.
    legs: int


@dataclass(frozen=True)
class AgentPlaced:
    """It became known where an agent stands in the map, by what it and others saw."""

    TAG: ClassVar[str] = "agent_placed"
    #: Its position in `map` [m].
    translation_m: Vec3


@dataclass(frozen=True)
class ObjectsNarrowed:
    """Fewer objects come into question for what the agent touches."""

    TAG: ClassVar[str] = "objects_narrowed"
    live: int


@dataclass(frozen=True)
class ObjectRecognised:
    """What the agent touches is known."""

    TAG: ClassVar[str] = "object_recognised"
    #: Name of the object.
    object: str
    #: How probable it is: at least what the space's settings ask for, 0.995 by default.
    probability: float


@dataclass(frozen=True)
class ObjectUnknown:
    """What the agent touches is none of the objects that were learned."""

    TAG: ClassVar[str] = "object_unknown"


@dataclass(frozen=True)
class ObjectLearned:
    """An object was learned, or more of it."""

    TAG: ClassVar[str] = "object_learned"
    #: Its name.
    object: str
    #: Contacts of the episode that taught it.
    contacts: int


@dataclass(frozen=True)
class ObjectNotLearned:
    """An episode was to teach an object and has not: it did not become clear how its frame lies in
    it."""

    TAG: ClassVar[str] = "object_not_learned"
    #: Contacts of the episode.
    contacts: int


@dataclass(frozen=True)
class ObjectsMerged:
    """Two objects turned out to be one."""

    TAG: ClassVar[str] = "objects_merged"
    #: Name of the one that they are.
    object: str
    #: Name that the other one had; nothing is called so any more.
    absorbed: str


@dataclass(frozen=True)
class ObjectSplit:
    """What had been joined to an object turned out to be another one."""

    TAG: ClassVar[str] = "object_split"
    #: Name of the object, which is again what it was before.
    object: str
    #: Name of the other one.
    part: str


@dataclass(frozen=True)
class RouteProgress:
    """The agent came to a step of the route that it follows."""

    TAG: ClassVar[str] = "route_progress"
    #: The place there; none beside the places.
    place: Optional[int]
    #: Number of steps that are left.
    steps_left: int
    #: Length that is left [m].
    left_m: float


@dataclass(frozen=True)
class RouteLeft:
    """The agent was off its route, or a blockage came onto it: it follows another one from here."""

    TAG: ClassVar[str] = "route_left"
    #: How far off it was [m]; none where it was on the route.
    off_m: Optional[float]
    #: The blockage that came onto the route, if one did.
    blockage: Optional[int]
    #: Length of the new route [m].
    length_m: float
    #: Number of its steps.
    steps_left: int
    #: The first 64 of them.
    steps: Tuple[RouteStep, ...]


@dataclass(frozen=True)
class RouteDone:
    """The agent has arrived where its route leads."""

    TAG: ClassVar[str] = "route_done"


@dataclass(frozen=True)
class RouteFailed:
    """The agent follows no route any more, without having arrived."""

    TAG: ClassVar[str] = "route_failed"
    reason: RouteFailure
    #: The blockages on the way that there would be.
    blockages: Tuple[int, ...]


@dataclass(frozen=True)
class LoopsClosed:
    """Loops have closed: the agent's pose is corrected by the past relaxed.

    It comes for each agent of the map, whoever closed them, with each relaxation.
    """

    TAG: ClassVar[str] = "loops_closed"
    #: Number of loop closures by which the past is relaxed.
    closures: int
    #: Number of matches of views by which it is.
    view_matches: int
    #: How far the agent's position has moved [m]. Its pose in `odom` goes on smoothly.
    moved_m: float
    #: How far the agent has turned [rad], 0 to pi.
    turned_rad: float
    #: Its position in `map` since [m].
    translation_m: Vec3


@dataclass(frozen=True)
class UnknownKind:
    """Something that this version of the package has no word for."""

    #: Its name on the wire.
    name: str
    #: Its fields as they came.
    fields: Dict[str, Any] = field(default_factory=dict)


EventKind = Union[
    AgentEnrolled,
    AgentRemoved,
    SessionStarted,
    PlaceRecruited,
    PlaceEntered,
    TripStarted,
    TripEnded,
    LandmarkLearned,
    SamplesSkipped,
    MarkerPassed,
    PerceptSurprising,
    PlaceForgotten,
    TripForgotten,
    AgentPlaced,
    ObjectsNarrowed,
    ObjectRecognised,
    ObjectUnknown,
    ObjectLearned,
    ObjectNotLearned,
    ObjectsMerged,
    ObjectSplit,
    RouteProgress,
    RouteLeft,
    RouteDone,
    RouteFailed,
    LoopsClosed,
    UnknownKind,
]


@dataclass(frozen=True)
class Event:
    """One event."""

    space: str
    #: Agent that caused it, or whose pose closed loops have corrected.
    agent: str
    #: Number of records that the map includes.
    map_revision: int
    #: Stamp of the sample that caused it [ns].
    stamp_ns: int
    kind: EventKind


@dataclass(frozen=True)
class EventRecord:
    """An event with its id."""

    #: Map revision and index, such as `4711-0`: the same after a restart, and larger for later
    #: events.
    id: str
    event: Event


@dataclass(frozen=True)
class MissedEvents:
    """Events that will not come: there were more than the service keeps."""

    #: How many; `None` where nobody counted them.
    events: Optional[int] = None
    #: Id of the oldest event that is kept; `None` where none is.
    next: Optional[str] = None


@dataclass(frozen=True)
class EventPage:
    """One page of the latest events."""

    #: Oldest first.
    events: Tuple[EventRecord, ...]
    #: What happened before them and is not kept any more.
    missed: Optional[MissedEvents] = None
    #: Pass as `after` for the events that come after these.
    next: Optional[str] = None
