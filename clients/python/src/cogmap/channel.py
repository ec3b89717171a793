"""Channels of percepts, and what a space has learned of them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Optional, Tuple


class ChannelKind(Enum):
    """What a channel carries."""

    #: Scalars.
    LEVEL = "level"
    #: Views: vectors of length 1.
    DESCRIPTOR = "descriptor"


@dataclass(frozen=True)
class LearnedChannel:
    """What was learned of a channel of views from them alone."""

    #: How many views it was learned from.
    views: int
    #: Within this distance views are alike [m].
    range_m: float
    #: What a pair of views says: mean log of the likelihood ratio of neighbours along the way to be
    #: within the range, against far ones [nats].
    information_nats: float
    #: Share of the evidence of a view that is its own, 0 to 1: neighbours say nearly the same.
    independence: float
    #: How alike views of one place are after the body has turned by 0, 45, 90, 135 and 180 degrees,
    #: as a part of how alike they are without a turn.
    turned: Tuple[float, ...]
    #: Whether they are alike so far that a pair of views says less than odometry does: agents are
    #: found among cells by such views, and no loops are closed.
    coarse: bool


@dataclass(frozen=True)
class Compass:
    """How levels tell the heading of an agent: ``rad_per_unit * level - offset_rad``, but for whole
    turns, counted to the left from the map's x axis."""

    #: Heading for each unit of the level [rad]; below zero where levels grow to the right.
    rad_per_unit: float
    #: The level, as an angle, at a heading of zero [rad].
    offset_rad: float
    #: Standard deviation of the part of the error that lasts [rad].
    lasting_sd_rad: float
    #: Standard deviation of the noise about that [rad].
    noise_sd_rad: float
    #: The agent that alone has taught it, and that alone it is true of; absent once several have.
    agent: Optional[str] = None


@dataclass(frozen=True)
class Channel:
    """A channel of percepts."""

    name: str
    kind: ChannelKind
    #: How many numbers a view has; of levels none.
    dimension: Optional[int] = None
    #: How many views are logged, to be matched with one another; of levels none.
    views: Optional[int] = None
    #: Absent for levels, for few views, and where views say nothing of where they were seen.
    learned: Optional[LearnedChannel] = None
    #: How levels tell a heading; absent while they are not known to, and for views.
    compass: Optional[Compass] = None


@dataclass(frozen=True)
class ChannelList:
    """The channels of a space."""

    channels: Tuple[Channel, ...]
