"""Samples: what a robot did (motion) and what it felt or saw (percepts).

SI units, angles in radians, stamps in nanoseconds of the sensor's clock, vectors in the body frame
unless said otherwise. `TAG` is the name of a variant on the wire: `{"velocity": {...}}`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Optional, Tuple, Union, get_args

from .errors import InvalidValue
from .key import check_name
from .limits import (
    BATCH_SAMPLES_MAX,
    DURATION_S_MAX,
    METRES_MAX,
    RADIANS_PER_SECOND_MAX,
    ROTATIONS_MAX,
    SPACING_M_MAX,
    SPACING_M_MIN,
    TOUCH_SD_MAX,
)
from .scalar import COUNT_RANGE, STAMP_RANGE, all_of, counted, label, number, one_of, whole, within
from .vector import (
    IDENTITY,
    Quaternion,
    Vec3,
    deviations,
    direction,
    quaternion,
    unit_vector,
    vec3,
)


def _set(instance: object, name: str, value: object) -> None:
    """Normalises a field of a frozen dataclass while it is being built."""
    object.__setattr__(instance, name, value)


@dataclass(frozen=True)
class MotionNoise:
    """Standard deviations along and about the body axes x, y, z."""

    #: Of the translation [m].
    translation_sd_m: Vec3
    #: Of the rotation vector [rad].
    rotation_sd_rad: Vec3

    def __post_init__(self) -> None:
        _set(self, "translation_sd_m", deviations("translation_sd_m", self.translation_sd_m))
        _set(self, "rotation_sd_rad", deviations("rotation_sd_rad", self.rotation_sd_rad))


@dataclass(frozen=True)
class Increment:
    """The body's displacement since the previous motion sample, in the body frame at its start."""

    TAG: ClassVar[str] = "increment"
    #: Displacement [m].
    translation_m: Vec3
    #: Rotation, unit quaternion `[x, y, z, w]`.
    rotation_xyzw: Quaternion = IDENTITY
    #: Noise of this increment; the space's odometry noise when absent.
    noise: Optional[MotionNoise] = None

    def __post_init__(self) -> None:
        _set(self, "translation_m", vec3("translation_m", self.translation_m))
        _set(self, "rotation_xyzw", quaternion("rotation_xyzw", self.rotation_xyzw))
        _check_noise(self.noise)


@dataclass(frozen=True)
class Velocity:
    """A body twist held over the `duration_s` that end at the sample's stamp."""

    TAG: ClassVar[str] = "velocity"
    #: Linear velocity [m/s].
    linear_m_s: Vec3
    #: Angular velocity [rad/s].
    angular_rad_s: Vec3
    #: How long the twist was held [s].
    duration_s: float
    #: Noise of the resulting increment; the space's odometry noise when absent.
    noise: Optional[MotionNoise] = None

    def __post_init__(self) -> None:
        _set(self, "linear_m_s", vec3("linear_m_s", self.linear_m_s))
        angular = vec3("angular_rad_s", self.angular_rad_s, RADIANS_PER_SECOND_MAX)
        _set(self, "angular_rad_s", angular)
        _set(self, "duration_s", within("duration_s", self.duration_s, 0.0, DURATION_S_MAX))
        _check_noise(self.noise)


@dataclass(frozen=True)
class Level:
    """A scalar on a channel: touch, texture, light, signal strength."""

    TAG: ClassVar[str] = "level"
    #: Name of the channel.
    channel: str
    #: The value, in the channel's own unit.
    value: float
    #: Where the sensor sits [m].
    offset_m: Vec3 = (0.0, 0.0, 0.0)
    #: Surface normal (unit vector), where a surface was touched.
    normal: Optional[Vec3] = None

    def __post_init__(self) -> None:
        check_name("channel", self.channel)
        _set(self, "value", number("value", self.value))
        _set(self, "offset_m", vec3("offset_m", self.offset_m))
        if self.normal is not None:
            _set(self, "normal", unit_vector("normal", self.normal))


@dataclass(frozen=True)
class Descriptor:
    """A unit vector on a channel, for example an image descriptor."""

    TAG: ClassVar[str] = "descriptor"
    #: Name of the channel.
    channel: str
    #: The vector, of 8 to 4096 numbers, in single precision; normalised by the service.
    vector: Tuple[float, ...]

    def __post_init__(self) -> None:
        check_name("channel", self.channel)
        _set(self, "vector", direction("vector", self.vector))


@dataclass(frozen=True)
class LandmarkTarget:
    """A landmark, by its label."""

    TAG: ClassVar[str] = "landmark"
    NEWTYPE: ClassVar[bool] = True
    label: str

    def __post_init__(self) -> None:
        label("label", self.label)


@dataclass(frozen=True)
class AgentTarget:
    """Another agent of the space, by its name."""

    TAG: ClassVar[str] = "agent"
    NEWTYPE: ClassVar[bool] = True
    name: str

    def __post_init__(self) -> None:
        check_name("name", self.name)


@dataclass(frozen=True)
class OwnSampleTarget:
    """Where this agent itself was at its sample of this number: a loop closure found outside."""

    TAG: ClassVar[str] = "own_sample"
    NEWTYPE: ClassVar[bool] = True
    seq: int

    def __post_init__(self) -> None:
        _set(self, "seq", whole("seq", self.seq, COUNT_RANGE))


Target = Union[LandmarkTarget, AgentTarget, OwnSampleTarget]


@dataclass(frozen=True)
class Position:
    """Position of the target in the body frame."""

    TAG: ClassVar[str] = "position"
    #: Position [m].
    translation_m: Vec3
    #: Standard deviation along each body axis [m].
    sd_m: Vec3

    def __post_init__(self) -> None:
        _set(self, "translation_m", vec3("translation_m", self.translation_m))
        _set(self, "sd_m", deviations("sd_m", self.sd_m))


@dataclass(frozen=True)
class RangeBearing:
    """Distance and direction of the target from the body."""

    TAG: ClassVar[str] = "range_bearing"
    #: Distance [m].
    range_m: float
    #: Direction in the x-y plane, left positive [rad].
    azimuth_rad: float
    #: Standard deviation of the distance [m].
    range_sd_m: float
    #: Standard deviation of either direction [rad].
    bearing_sd_rad: float
    #: Direction above the x-y plane [rad].
    elevation_rad: float = 0.0

    WIRE_ORDER: ClassVar[Tuple[str, ...]] = (
        "range_m",
        "azimuth_rad",
        "elevation_rad",
        "range_sd_m",
        "bearing_sd_rad",
    )

    def __post_init__(self) -> None:
        for name in self.WIRE_ORDER:
            low = -METRES_MAX if name in ("azimuth_rad", "elevation_rad") else 0.0
            _set(self, name, within(name, getattr(self, name), low, METRES_MAX))


@dataclass(frozen=True)
class RelativePose:
    """Full pose of the target in the body frame."""

    TAG: ClassVar[str] = "pose"
    #: Position [m].
    translation_m: Vec3
    #: Orientation, unit quaternion `[x, y, z, w]`.
    rotation_xyzw: Quaternion
    #: Noise of the relation, in the target's frame.
    noise: MotionNoise

    def __post_init__(self) -> None:
        _set(self, "translation_m", vec3("translation_m", self.translation_m))
        _set(self, "rotation_xyzw", quaternion("rotation_xyzw", self.rotation_xyzw))
        one_of("noise", self.noise, (MotionNoise,))


@dataclass(frozen=True)
class Range:
    """Distance of the target alone, as ultra-wideband radios measure it."""

    TAG: ClassVar[str] = "range"
    #: Distance [m].
    range_m: float
    #: Standard deviation of the distance [m].
    range_sd_m: float
    #: Position of the antenna in the body frame [m].
    offset_m: Vec3 = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("range_m", "range_sd_m"):
            _set(self, name, within(name, getattr(self, name), 0.0, METRES_MAX))
        _set(self, "offset_m", vec3("offset_m", self.offset_m))


Relation = Union[Position, RangeBearing, RelativePose, Range]


@dataclass(frozen=True)
class Sighting:
    """A target seen from the body."""

    TAG: ClassVar[str] = "sighting"
    #: What was seen.
    target: Target
    #: Where it was seen.
    relation: Relation

    def __post_init__(self) -> None:
        one_of("target", self.target, get_args(Target))
        one_of("relation", self.relation, get_args(Relation))


@dataclass(frozen=True)
class StartPose:
    """Where the agent stands in the space's `map` frame, told from outside."""

    TAG: ClassVar[str] = "start_pose"
    #: Position in `map` [m].
    translation_m: Vec3
    #: Orientation in `map`, unit quaternion `[x, y, z, w]`.
    rotation_xyzw: Quaternion = IDENTITY
    #: How well it is known, along and about the body axes; exact when absent.
    noise: Optional[MotionNoise] = None

    def __post_init__(self) -> None:
        _set(self, "translation_m", vec3("translation_m", self.translation_m))
        _set(self, "rotation_xyzw", quaternion("rotation_xyzw", self.rotation_xyzw))
        _check_noise(self.noise)


@dataclass(frozen=True)
class Marker:
    """A named moment; may end the trip under way."""

    TAG: ClassVar[str] = "marker"
    #: Its label.
    label: str
    #: Whether the trip under way ends here.
    ends_trip: bool = False

    def __post_init__(self) -> None:
        label("label", self.label)
        _set(self, "ends_trip", bool(self.ends_trip))


@dataclass(frozen=True)
class NoTurn:
    """The frames of an episode and of an object are parallel."""

    TAG: ClassVar[str] = "known"


@dataclass(frozen=True)
class CubeTurns:
    """They are turned by one of the 24 turns that take a cube into itself."""

    TAG: ClassVar[str] = "cube"


@dataclass(frozen=True)
class FiniteTurns:
    """They are turned by one of these rotations, all equally likely."""

    TAG: ClassVar[str] = "finite"
    #: Unit quaternions `[x, y, z, w]`, from the episode's frame into the object's.
    rotations_xyzw: Tuple[Quaternion, ...]

    def __post_init__(self) -> None:
        turns = tuple(
            quaternion(f"rotations_xyzw[{index}]", turn)
            for index, turn in enumerate(self.rotations_xyzw)
        )
        if not 1 <= len(turns) <= ROTATIONS_MAX:
            expected = f"expected 1 to {ROTATIONS_MAX} rotations"
            raise InvalidValue("rotations_xyzw", turns, expected, f"{len(turns)} of them")
        _set(self, "rotations_xyzw", turns)


@dataclass(frozen=True)
class AnyTurn:
    """They are turned by any rotation. Contacts need normals then."""

    TAG: ClassVar[str] = "free"


@dataclass(frozen=True)
class YawTurn:
    """They are turned by any rotation about the vertical, the z axis of both, as things on a table
    are. Contacts need no normals."""

    TAG: ClassVar[str] = "yaw"


#: How the frame of an episode may be turned against an object's.
Orientation = Union[NoTurn, CubeTurns, FiniteTurns, AnyTurn, YawTurn]


@dataclass(frozen=True)
class TouchNoise:
    """Standard deviations of what is felt."""

    #: Of a contact's position per axis [m].
    position_sd_m: float = 0.002
    #: Of a normal's direction per axis [rad].
    normal_sd_rad: float = 0.035
    #: Of a level, in its channel's unit.
    level_sd: float = 0.1

    def __post_init__(self) -> None:
        for name in ("position_sd_m", "normal_sd_rad", "level_sd"):
            _set(self, name, within(name, getattr(self, name), 0.0, TOUCH_SD_MAX))


@dataclass(frozen=True)
class LearnObject:
    """What is felt from here on teaches an object."""

    TAG: ClassVar[str] = "learn"
    #: Its name. One that is known is extended if the episode shows how its frame lies in the
    #: object's. Without a name it is the object that is recognised, or a new one. Nothing can be
    #: called `identify`.
    name: Optional[str] = None
    #: Contacts within this distance [m] are of one place of a new object.
    spacing_m: float = 0.004
    #: How the frame may be turned against that of an object known before.
    orientation: Orientation = NoTurn()
    #: How exactly is felt.
    noise: TouchNoise = TouchNoise()

    def __post_init__(self) -> None:
        if self.name is not None and label("name", self.name) == "identify":
            raise InvalidValue("name", self.name, "expected a name that is not reserved")
        _set(self, "spacing_m", within("spacing_m", self.spacing_m, SPACING_M_MIN, SPACING_M_MAX))
        one_of("orientation", self.orientation, get_args(Orientation))
        one_of("noise", self.noise, (TouchNoise,))


@dataclass(frozen=True)
class IdentifyObject:
    """What is felt from here on is to be recognised; if it is unknown, it is learned at the end."""

    TAG: ClassVar[str] = "identify"
    #: How the frame may be turned against an object's.
    orientation: Orientation = NoTurn()
    #: How exactly is felt.
    noise: TouchNoise = TouchNoise()

    def __post_init__(self) -> None:
        one_of("orientation", self.orientation, get_args(Orientation))
        one_of("noise", self.noise, (TouchNoise,))


@dataclass(frozen=True)
class RecogniseObject:
    """What is felt from here on is to be recognised, and nothing is learned from it."""

    TAG: ClassVar[str] = "recognise"
    #: How the frame may be turned against an object's.
    orientation: Orientation = NoTurn()
    #: How exactly is felt.
    noise: TouchNoise = TouchNoise()

    def __post_init__(self) -> None:
        one_of("orientation", self.orientation, get_args(Orientation))
        one_of("noise", self.noise, (TouchNoise,))


@dataclass(frozen=True)
class EndObject:
    """The episode with an object ends."""

    TAG: ClassVar[str] = "end"


@dataclass(frozen=True)
class ObjectMark:
    """An episode with an object begins or ends."""

    TAG: ClassVar[str] = "object"
    NEWTYPE: ClassVar[bool] = True
    mark: Union[LearnObject, IdentifyObject, EndObject, RecogniseObject]

    def __post_init__(self) -> None:
        one_of("mark", self.mark, (LearnObject, IdentifyObject, EndObject, RecogniseObject))


@dataclass(frozen=True)
class SessionEnd:
    """The session ends, and the trip under way with it: a robot's last word."""

    TAG: ClassVar[str] = "session_end"


SampleBody = Union[
    Increment,
    Velocity,
    Level,
    Descriptor,
    Sighting,
    StartPose,
    Marker,
    ObjectMark,
    SessionEnd,
]


@dataclass(frozen=True)
class Sample:
    """One sample."""

    #: Time on the sensor's clock [ns]; never runs backwards within a session.
    stamp_ns: int
    #: What was sampled.
    body: SampleBody

    def __post_init__(self) -> None:
        _set(self, "stamp_ns", whole("stamp_ns", self.stamp_ns, STAMP_RANGE))
        one_of("body", self.body, get_args(SampleBody))


@dataclass(frozen=True)
class SampleBatch:
    """Consecutive samples of one agent: sample `i` has the number `first_seq + i`."""

    #: The run of the agent; a larger number takes over from a smaller one.
    session: int
    #: Sequence number of the first sample.
    first_seq: int
    #: The samples, in order; 1 to 4096.
    samples: Tuple[Sample, ...]

    def __post_init__(self) -> None:
        _set(self, "session", whole("session", self.session, COUNT_RANGE))
        _set(self, "first_seq", whole("first_seq", self.first_seq, COUNT_RANGE))
        samples = all_of("samples", self.samples, (Sample,))
        _set(self, "samples", counted("samples", samples, BATCH_SAMPLES_MAX))


def _check_noise(noise: Optional[MotionNoise]) -> None:
    if noise is not None:
        one_of("noise", noise, (MotionNoise,))
