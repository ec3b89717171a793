"""What was felt near a point, and whether anybody was there to feel it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Optional, Tuple

from .scalar import COUNT_RANGE, STAMP_RANGE, all_of, number, whole
from .vector import Vec3, vec3


@dataclass(frozen=True)
class FeltQuery:
    """Asks what was felt near a point, and who was there."""

    #: The point in `map` [m].
    position_m: Vec3
    #: Places within this distance of it are near [m]; the radius of a place's field when absent.
    radius_m: Optional[float] = None
    #: Only what was felt, and who was there, at or after this stamp [ns].
    since_ns: Optional[int] = None
    #: Only percepts of these channels, at most 64; of all when absent.
    channels: Optional[Tuple[str, ...]] = None
    #: Most places in the answer, 1 to 1000; 10 when absent.
    limit: Optional[int] = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_m", vec3("position_m", self.position_m))
        if self.radius_m is not None:
            object.__setattr__(self, "radius_m", number("radius_m", self.radius_m))
        if self.since_ns is not None:
            object.__setattr__(self, "since_ns", whole("since_ns", self.since_ns, STAMP_RANGE))
        if self.channels is not None:
            object.__setattr__(self, "channels", all_of("channels", self.channels, (str,)))
        if self.limit is not None:
            object.__setattr__(self, "limit", whole("limit", self.limit, COUNT_RANGE))


class Looked(str, Enum):
    """Whether somebody looked, and what came of it."""

    #: Nobody is known to have been there since the stamp.
    NEVER = "never"
    #: Somebody was there, and no percept that is asked for is known from then.
    NOTHING_FELT = "nothing_felt"
    #: A percept that is asked for is known.
    FELT = "felt"


@dataclass(frozen=True)
class FeltPercept:
    """What a place learned of a channel since it was founded."""

    channel: str
    #: Latest stamp of a percept [ns].
    last_stamp_ns: int
    #: Number of percepts, also of those before `since_ns`.
    percepts: int
    #: The sum of the place's confidences when they were felt.
    strength: float
    #: Mean of all levels, in the channel's own unit; absent for descriptors, as is `sd`.
    mean: Optional[float]
    #: Standard deviation of single levels; 0 after the first one.
    sd: Optional[float]
    #: How many numbers the descriptors have; absent for levels.
    dimension: Optional[int]


@dataclass(frozen=True)
class FeltPlace:
    """What was felt at a place."""

    place: int
    #: Its distance from the point [m].
    distance_m: float
    looked: Looked
    #: Latest stamp at which somebody is known to have been there, also before `since_ns` [ns].
    last_seen_ns: int
    #: The percepts that are asked for, in the order of the channels.
    percepts: Tuple[FeltPercept, ...]


@dataclass(frozen=True)
class FeltAnswer:
    """What was felt near a point, and who was there."""

    space: str
    frame: str
    map_revision: int
    #: Of all places near together.
    looked: Looked
    #: Latest stamp at which somebody is known to have been near, also before `since_ns` [ns];
    #: absent where nobody is.
    last_seen_ns: Optional[int]
    #: Latest stamp of the percepts that are asked for [ns]; absent where there are none.
    last_felt_ns: Optional[int]
    #: Number of places near, also beyond the limit.
    near: int
    #: The nearest places, the nearest first.
    places: Tuple[FeltPlace, ...]
