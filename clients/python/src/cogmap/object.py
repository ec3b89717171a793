"""Objects: what is touched, learned and known again."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar, Optional, Tuple, Union, get_args

from .key import check_name
from .limits import (
    IDENTIFY_CONTACTS_MAX,
    LESSON_CONTACTS_MAX,
    METRES_MAX,
    SPACING_M_MAX,
    SPACING_M_MIN,
)
from .sample import Orientation, TouchNoise
from .scalar import all_of, counted, number, one_of, within
from .vector import Quaternion, Vec3, direction, unit_vector, vec3


class Reached(Enum):
    """How a contact was come by, which says what its place tells about the object."""

    #: It was come upon, within a step of the contact before.
    FOUND = "found"
    #: It was asked for: where it lies is the asker's choice.
    AIMED = "aimed"
    #: It was drawn evenly from the whole surface.
    DRAWN = "drawn"


@dataclass(frozen=True)
class ContactLevel:
    """A level that was felt at a contact."""

    #: Name of the channel.
    channel: str
    #: The value, in the channel's own unit.
    value: float

    def __post_init__(self) -> None:
        check_name("channel", self.channel)
        object.__setattr__(self, "value", number("value", self.value))


@dataclass(frozen=True)
class ContactDescriptor:
    """A descriptor that was seen at a contact."""

    #: Name of the channel.
    channel: str
    #: The vector, of 8 to 4096 numbers, in single precision; normalised by the service.
    vector: Tuple[float, ...]

    def __post_init__(self) -> None:
        check_name("channel", self.channel)
        object.__setattr__(self, "vector", direction("vector", self.vector))


@dataclass(frozen=True)
class Contact:
    """A contact."""

    #: Position [m].
    position_m: Vec3
    #: The surface's outward normal there, a unit vector.
    normal: Optional[Vec3] = None
    #: What was felt, at most one level of each channel.
    levels: Tuple[ContactLevel, ...] = ()
    #: What was seen, at most one descriptor of each channel.
    descriptors: Tuple[ContactDescriptor, ...] = ()
    #: What path integration has drifted since the first contact, per axis [m].
    drift_sd_m: float = 0.0
    #: How it was come by.
    reached: Reached = Reached.FOUND

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_m", vec3("position_m", self.position_m))
        if self.normal is not None:
            object.__setattr__(self, "normal", unit_vector("normal", self.normal))
        levels = all_of("levels", self.levels, (ContactLevel,))
        object.__setattr__(self, "levels", levels)
        descriptors = all_of("descriptors", self.descriptors, (ContactDescriptor,))
        object.__setattr__(self, "descriptors", descriptors)
        drift = within("drift_sd_m", self.drift_sd_m, 0.0, METRES_MAX)
        object.__setattr__(self, "drift_sd_m", drift)


@dataclass(frozen=True)
class ObjectLesson:
    """Teaches an object at once, in place of what was known of it."""

    #: Contacts within this distance [m] are of one place.
    spacing_m: float
    #: How exactly was felt.
    noise: TouchNoise
    #: The contacts, in the object's own frame; 1 to 4096.
    contacts: Tuple[Contact, ...]

    def __post_init__(self) -> None:
        spacing = within("spacing_m", self.spacing_m, SPACING_M_MIN, SPACING_M_MAX)
        object.__setattr__(self, "spacing_m", spacing)
        one_of("noise", self.noise, (TouchNoise,))
        contacts = all_of("contacts", self.contacts, (Contact,))
        object.__setattr__(self, "contacts", counted("contacts", contacts, LESSON_CONTACTS_MAX))


@dataclass(frozen=True)
class IdentifyQuery:
    """Asks which object a sequence of contacts is of."""

    #: How the frame of the contacts may be turned against an object's.
    orientation: Orientation
    #: How exactly was felt.
    noise: TouchNoise
    #: The contacts, in the order in which they were felt, in a frame of their own; 1 to 256.
    contacts: Tuple[Contact, ...]

    def __post_init__(self) -> None:
        one_of("orientation", self.orientation, get_args(Orientation))
        one_of("noise", self.noise, (TouchNoise,))
        contacts = all_of("contacts", self.contacts, (Contact,))
        object.__setattr__(self, "contacts", counted("contacts", contacts, IDENTIFY_CONTACTS_MAX))


@dataclass(frozen=True)
class ObjectSummary:
    """What is known of an object."""

    name: str
    #: How many places it has.
    places: int
    #: Distance within which contacts are of one place [m].
    spacing_m: float
    #: Corners of the box around its places [m], in its own frame.
    min_m: Vec3
    max_m: Vec3
    #: How many contacts taught it.
    contacts: int
    #: In how many episodes and lessons.
    visits: int
    #: Typical distance between neighbouring places [m]; None of a single place.
    gap_m: Optional[float] = None
    #: Distance between places at which the surface between them would be known as exactly as it is
    #: felt [m]: what is above it should be felt more densely.
    advised_gap_m: Optional[float] = None
    #: In the answer to a lesson that asks for it, another object for which this one would be taken.
    alike: Optional[ObjectProbability] = None


@dataclass(frozen=True)
class ObjectPage:
    """One page of objects."""

    #: The objects, by name.
    objects: Tuple[ObjectSummary, ...]
    next: Optional[str] = None


@dataclass(frozen=True)
class ObjectLevel:
    """What was felt at a place of an object."""

    channel: str
    mean: float
    #: Standard deviation of what will be felt there, beside the sensor's noise.
    sd: float


@dataclass(frozen=True)
class ObjectPlace:
    """A place of an object."""

    #: Mean position of its contacts [m], in the object's frame.
    position_m: Vec3
    #: Mean outward normal, if one was felt.
    normal: Optional[Vec3]
    #: How many contacts there were.
    contacts: float
    #: What was felt, by channel.
    levels: Tuple[ObjectLevel, ...]


@dataclass(frozen=True)
class ObjectDetail:
    """An object with its places."""

    summary: ObjectSummary
    #: Its places, in the order in which they were first touched.
    places: Tuple[ObjectPlace, ...]


@dataclass(frozen=True)
class Undecided:
    """More contacts are needed."""

    TAG: ClassVar[str] = "undecided"


@dataclass(frozen=True)
class KnownObject:
    """It is this one."""

    TAG: ClassVar[str] = "object"
    name: str


@dataclass(frozen=True)
class UnknownObject:
    """It is none that was learned."""

    TAG: ClassVar[str] = "unknown"


ObjectVerdict = Union[Undecided, KnownObject, UnknownObject]


@dataclass(frozen=True)
class ObjectProbability:
    """Probability of an object."""

    name: str
    probability: float


@dataclass(frozen=True)
class OtherPose:
    """Another pose that explains the contacts."""

    translation_m: Vec3
    rotation_xyzw: Quaternion
    #: Its share of the evidence.
    share: float


@dataclass(frozen=True)
class ObjectPose:
    """Where the frame of the contacts lies in an object's."""

    object: str
    #: Origin of the contacts' frame in the object's [m].
    translation_m: Vec3
    #: Its orientation there, unit quaternion `[x, y, z, w]`.
    rotation_xyzw: Quaternion
    #: Covariance of its error along and about its own axes: upper triangle, row by row.
    covariance: Tuple[float, ...]
    #: Share of the object's evidence that this pose holds.
    share: float
    #: Other poses with a share: of something symmetric, the symmetric ones.
    others: Tuple[OtherPose, ...]


@dataclass(frozen=True)
class NextTouch:
    """A touch that would tell much."""

    #: Where to touch [m], in the frame of the contacts.
    position_m: Vec3
    #: The way to move on the approach, in the same frame.
    approach: Optional[Vec3]
    #: Information expected from it [nats].
    gain_nats: float


@dataclass(frozen=True)
class RivalObject:
    """The second most probable object, and what the contacts say against it."""

    name: str
    #: How much each contact, in the order in which they were felt, speaks for the most probable
    #: object against this one [nats]; below zero for this one.
    contacts_nats: Tuple[float, ...]


@dataclass(frozen=True)
class Identification:
    """What a sequence of contacts says."""

    space: str
    map_revision: int
    #: The answer, once one is as probable as the space's settings ask for, 99.5 % by default.
    verdict: ObjectVerdict
    #: Probability of each object that has a noticeable one, most probable first.
    objects: Tuple[ObjectProbability, ...]
    #: Probability that it is none of them.
    unknown: float
    #: How many objects have a probability above one hundredth.
    live_objects: int
    #: How many hypotheses, each an object in a pose, hold 99 % of all evidence.
    live_hypotheses: int
    #: Entropy over objects and unknown [nats].
    entropy_nats: float
    #: Contacts that were taken in.
    contacts: int
    #: How well the best explanation fits, in standard deviations of what a right one does.
    fit: float
    #: Pose in the most probable object.
    pose: Optional[ObjectPose]
    #: Where the next touch would tell most.
    next_touch: Optional[NextTouch]
    #: Share of the most probable object's places that a contact has come near, where its pose is
    #: known: what is left of it may differ.
    explored: Optional[float] = None
    #: What speaks for the most probable object against the second.
    rival: Optional[RivalObject] = None


class EpisodeKind(Enum):
    """What an episode with an object is for."""

    #: It teaches an object.
    LEARN = "learn"
    #: It is to recognise one.
    IDENTIFY = "identify"


@dataclass(frozen=True)
class EndedEpisode:
    """An episode with an object that has ended."""

    #: What it was for.
    episode: EpisodeKind
    #: Session of the agent that it was part of.
    session: int
    #: Stamp of the sample that ended it [ns].
    stamp_ns: int
    #: What its contacts said in the end, before anything was learned from it; absent when it taught
    #: an object by its name.
    identification: Optional[Identification]


@dataclass(frozen=True)
class AgentObject:
    """The episode of an agent with an object, and the latest one that has ended."""

    space: str
    agent: str
    #: What the episode under way is for; absent when there is none.
    episode: Optional[EpisodeKind]
    #: What its contacts say; in the frame of the body when the episode began.
    identification: Optional[Identification]
    #: The latest episode that has ended; absent when there was none in which something was felt.
    #: Also kept when the robot is closed.
    last: Optional[EndedEpisode] = None
    #: The contacts of the episode under way, oldest first, in the frame of the body when it began:
    #: at most the first 128, by which it recognises. Without descriptors, which may be long.
    contacts: Tuple[Contact, ...] = ()
