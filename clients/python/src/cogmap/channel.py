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


@dataclass(frozen=True)
class ChannelList:
    """The channels of a space."""

    channels: Tuple[Channel, ...]
