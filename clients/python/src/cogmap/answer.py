"""Answers of the service: watermarks, agents, memories.

Positions are in the frame `map`, in metres; rotations are unit quaternions `[x, y, z, w]`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar, Dict, Optional, Tuple, Union

from .estimate import Estimate
from .evidence import Evidence
from .pose import PoseReadings
from .settings import SpaceSettings
from .trajectory import StampedPose
from .vector import Quaternion, Vec3


class SkipReason(str, Enum):
    """Why a sample was refused for good."""

    #: A number is NaN, infinite or beyond its limit.
    NUMBER_OUT_OF_RANGE = "number_out_of_range"
    #: A quaternion is not a unit quaternion.
    NON_UNIT_QUATERNION = "non_unit_quaternion"
    #: A standard deviation is negative.
    NEGATIVE_NOISE = "negative_noise"
    #: The stamp runs backwards within the session.
    TIME_BACKWARDS = "time_backwards"
    #: A descriptor has a wrong length or no direction.
    INVALID_DESCRIPTOR = "invalid_descriptor"
    #: The sample's number is more than 2**32 ahead of the next one in order.
    SEQUENCE_LEAP = "sequence_leap"
    #: A channel, landmark, agent or marker label is empty, too long or has forbidden characters.
    INVALID_LABEL = "invalid_label"
    #: A surface normal is not a unit vector.
    INVALID_NORMAL = "invalid_normal"
    #: The sample never came, and the wait for it is over.
    LOST = "lost"
    #: A reason that this version of the package does not know.
    UNKNOWN = "unknown"

    @classmethod
    def _missing_(cls, value: object) -> SkipReason:
        return cls.UNKNOWN


class TripEnd(str, Enum):
    """Why a trip ended."""

    #: The agent stood still.
    STILLNESS = "stillness"
    #: Samples were lost, or none came for a long time on the sensor's clock.
    GAP = "gap"
    #: The session ended.
    SESSION_END = "session_end"
    #: A marker said so.
    MARKER = "marker"
    #: The trip was full; the next one continues it.
    FULL = "full"
    #: The agent was told where it stands.
    START_POSE = "start_pose"
    #: An end that this version of the package does not know.
    UNKNOWN = "unknown"

    @classmethod
    def _missing_(cls, value: object) -> TripEnd:
        return cls.UNKNOWN


@dataclass(frozen=True)
class SeqRange:
    """The sequence numbers from `start` up to but without `stop`."""

    start: int
    stop: int

    #: Names on the wire, where `from` is free to be a field.
    WIRE_NAMES: ClassVar[Dict[str, str]] = {"start": "from", "stop": "to"}


@dataclass(frozen=True)
class Rejection:
    """A range of samples refused for good, and why."""

    range: SeqRange
    reason: SkipReason


@dataclass(frozen=True)
class Watermark:
    """How far an agent's samples have come: the acknowledgement."""

    #: The agent's current session.
    session: int
    #: Every sample below this sequence number is on disk.
    durable: int
    #: Every sample below this sequence number has been applied, or rejected for good.
    applied: int
    #: The samples that are missing now, while later ones wait for them.
    gap: Optional[SeqRange] = None
    #: Samples refused for good, the latest few.
    rejected: Tuple[Rejection, ...] = ()
    #: Number of the owner of the space's journal that wrote it: each later owner has a larger one;
    #: 0 on one machine. From one term to the next `applied` may go back, and `durable` never does.
    term: int = 0


@dataclass(frozen=True)
class IngestAnswer:
    """Answer to samples sent over HTTP: they are on disk, but for those that are refused."""

    watermark: Watermark
    #: Samples of the request that had been there before.
    duplicates: int
    #: Why samples of the request make no sense by themselves, the first 16 of them: field, value
    #: and rule. Stamps that run backwards are in the watermark alone.
    refused: Tuple[str, ...] = ()


@dataclass(frozen=True)
class SpaceInfo:
    """A space."""

    name: str
    #: Settings, as fixed on creation.
    settings: SpaceSettings
    #: Number of records that the map includes.
    map_revision: int
    #: Digest of the map's state: equal digests, equal maps.
    digest: str
    agents: int
    places: int
    trips: int
    landmarks: int


@dataclass(frozen=True)
class SpaceList:
    """The spaces of the service."""

    spaces: Tuple[SpaceInfo, ...]


@dataclass(frozen=True)
class AgentSummary:
    """An agent in a list."""

    name: str
    #: Its latest estimate; absent before its first motion, sighting or start pose.
    estimate: Optional[Estimate] = None
    #: Whether the latest sample of its session ended it.
    session_ended: bool = False
    #: How long ago the service received a message of it [s]; `None` before the first one since the
    #: service started, and from a node that follows the space.
    heard_ago_s: Optional[float] = None


@dataclass(frozen=True)
class AgentPage:
    """One page of agents."""

    agents: Tuple[AgentSummary, ...]
    #: Where the next page begins; absent on the last one.
    next: Optional[str] = None


@dataclass(frozen=True)
class AgentDetail:
    """An agent: where it is, how sure that is, and how far its samples have come."""

    name: str
    estimate: Optional[Estimate]
    #: Its pose in `odom`, i.e. by motion alone since the session began.
    odometry: Optional[StampedPose]
    #: What became of its sightings.
    evidence: Evidence
    watermark: Watermark
    #: Samples received but not yet durable.
    lag_samples: int
    #: Path travelled in this session [m].
    travelled_m: float
    #: Sightings of its own earlier samples that were dropped, because those were not remembered, or
    #: no longer; over all sessions.
    forgotten_matches: int
    #: Whether the latest sample of its session ended it.
    session_ended: bool = False
    #: How long ago the service received a message of it [s]; `None` before the first one since the
    #: service started, and from a node that follows the space.
    heard_ago_s: Optional[float] = None


@dataclass(frozen=True)
class GridModuleState:
    """State of a grid module."""

    spacing_m: float
    #: Lattice index of the reference grid point.
    reference: Tuple[int, int, int]
    #: Position of the reference grid point [m].
    reference_m: Vec3
    #: Phase, `[0, 1)³` along the lattice axes.
    phase: Vec3
    #: Activation of the module's cells, in [0, 1].
    activation: Tuple[float, ...]
    #: Activation by the octant model at the agent's position (seed Algorithm 1), in [0, 1].
    octant_activation: float


@dataclass(frozen=True)
class GridState:
    """Grid-cell state of an agent."""

    agent: str
    stamp_ns: int
    #: The modules, finest first.
    modules: Tuple[GridModuleState, ...]
    #: Position decoded from the modules' phases around the reference grid point [m].
    decoded_m: Vec3
    #: Interference pattern of the cells, normalised [m].
    interference_m: Vec3
    #: Octant of the latest movement, 1 to 8; absent before the first one.
    octant: Optional[int]
    #: Length of the latest movement [m].
    displacement_m: float
    #: Angle between the latest two movements [rad].
    turning_rad: float
    #: Heading in the x-y plane [rad].
    heading_rad: float


@dataclass(frozen=True)
class Place(PoseReadings):
    """A place cell."""

    id: int
    #: Where its founder stood [m], by what is known of the founder's way by now.
    translation_m: Vec3
    #: Orientation of the founder at the founding, likewise.
    rotation_xyzw: Quaternion
    #: Standard deviation of the position at the founding, along the axes of `map` [m].
    position_sd_m: Vec3
    #: Grid code: phase of each module.
    code: Tuple[Vec3, ...]
    #: Times an agent came here, the founding included.
    visits: int
    #: Agent that founded it.
    founder: str
    first_stamp_ns: int
    last_stamp_ns: int
    #: The founding and each visit count one when they happen, and half as much after every
    #: half-life.
    strength: float

    def __str__(self) -> str:
        times = "once" if self.visits == 1 else f"{self.visits} times"
        return f"place {self.id} of {self.founder}: {self._pose_text()}, visited {times}"


@dataclass(frozen=True)
class PlacePage:
    """One page of places."""

    frame: str
    map_revision: int
    places: Tuple[Place, ...]
    next: Optional[int] = None


@dataclass(frozen=True)
class RecalledPlace:
    """A place and how well it answers the cue."""

    place: Place
    #: Cosine of the cue's and the place's activation; absent without a cue.
    cosine: Optional[float] = None
    #: Confidence, in [0, 1]; absent without a cue.
    confidence: Optional[float] = None
    #: Distance from the cue's position [m]; absent without one.
    distance_m: Optional[float] = None
    #: How well the percept fits what the place remembers; absent without one. For a descriptor the
    #: cosine; for a level its likelihood, as a part of the highest that there could be.
    percept_match: Optional[float] = None


@dataclass(frozen=True)
class Rivals:
    """Places that answer a code nearly as well as the best one: more than a field radius from it,
    with a cosine at most 0.05 lower."""

    count: int
    #: Identifier of the best of them.
    place: int
    #: Its cosine.
    cosine: float
    #: Its distance from the first place [m].
    distance_m: float


@dataclass(frozen=True)
class RecallAnswer:
    """Places that answer a cue."""

    space: str
    frame: str
    map_revision: int
    #: The places, best first.
    places: Tuple[RecalledPlace, ...]
    #: Other places that answer the code nearly as well; absent when there are none.
    rivals: Optional[Rivals] = None


@dataclass(frozen=True)
class ExpectedLevel:
    """A level that is expected."""

    TAG: ClassVar[str] = "level"
    #: Mean, in the channel's own unit.
    mean: float
    #: Standard deviation of single values; 0 after the first one.
    sd: float


@dataclass(frozen=True)
class ExpectedDescriptor:
    """A descriptor that is expected."""

    TAG: ClassVar[str] = "descriptor"
    #: Mean direction, a unit vector; all zeros if what was seen cancels out.
    vector: Tuple[float, ...]


@dataclass(frozen=True)
class RememberedPercept:
    """What a place remembers of a channel."""

    #: Name of the channel.
    channel: str
    #: What is expected there.
    expected: Union[ExpectedLevel, ExpectedDescriptor]
    #: Number of percepts that it has learned from.
    percepts: int
    #: Strength of the association: the sum of the place's confidences when they were felt.
    strength: float


@dataclass(frozen=True)
class PlacePercepts:
    """What a place remembers of what was felt and seen there."""

    space: str
    place: int
    map_revision: int
    #: What it remembers, in the order of the channels; empty where nothing was felt.
    percepts: Tuple[RememberedPercept, ...]


@dataclass(frozen=True)
class PredictedPercept:
    """A percept that is expected."""

    #: Name of the channel.
    channel: str
    expected: Union[ExpectedLevel, ExpectedDescriptor]
    #: The place that remembers it: the one that answers where the sensor will be.
    place: int
    #: That place's confidence, in [0, 1].
    confidence: float
    #: Number of percepts that it has learned from.
    percepts: int
    #: Strength of the association: the sum of the place's confidences when they were felt.
    strength: float


@dataclass(frozen=True)
class PredictAnswer:
    """Where a motion would lead, and what is expected there."""

    space: str
    agent: str
    frame: str
    map_revision: int
    translation_m: Vec3
    rotation_xyzw: Quaternion
    #: The place that answers there, if one does.
    place: Optional[int]
    #: Its confidence, in [0, 1], over the positions to which the motion may lead; 0 without a
    #: place.
    confidence: float
    #: What is expected there, in the order of the channels; empty where no place answers.
    percepts: Tuple[PredictedPercept, ...]


@dataclass(frozen=True)
class Trip:
    """A trip in a list."""

    id: int
    agent: str
    session: int
    start_stamp_ns: int
    #: Stamp of the latest leg's end [ns].
    end_stamp_ns: int
    #: Why it ended; absent while it goes on.
    ended: Optional[TripEnd]
    leg_count: int
    #: Length of its path [m].
    length_m: float
    #: The recording and travelling it again count one when they happen, and half as much after
    #: every half-life.
    strength: float
    #: Whether it is pinned: never forgotten.
    pinned: bool


@dataclass(frozen=True)
class Leg:
    """The way from one place to the next, as motion measured it."""

    #: Place at its start; it may have been forgotten since.
    start: int
    #: Place at its end; it may have been forgotten since.
    end: int
    #: Displacement, in the body frame at the start [m].
    translation_m: Vec3
    rotation_xyzw: Quaternion
    #: Upper triangle, row by row, of the 6 × 6 covariance of (translation, rotation) in the body
    #: frame at the end: 21 numbers.
    covariance: Tuple[float, ...]
    #: Phase displacement of each grid module, turns along the lattice axes.
    phase_displacement: Tuple[Vec3, ...]
    #: Octant of the displacement in `map`, 1 to 8.
    octant: int
    duration_s: float
    #: Length of the path [m].
    length_m: float

    WIRE_NAMES: ClassVar[Dict[str, str]] = {"start": "from", "end": "to"}


@dataclass(frozen=True)
class TripDetail:
    """A trip with its legs, in order."""

    trip: Trip
    legs: Tuple[Leg, ...]


@dataclass(frozen=True)
class TripPage:
    """One page of trips."""

    trips: Tuple[Trip, ...]
    next: Optional[int] = None
