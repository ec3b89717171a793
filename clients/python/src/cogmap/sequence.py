"""Sequences: which trips the last places look like, and what comes next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple, Union

from .query import PerceptCue
from .route import AtPercept, AtPlace
from .sample import Descriptor, Level
from .scalar import COUNT_RANGE, all_of, number, whole

#: One element of a sequence: a place, or what was sensed at one.
SequenceElement = Union[AtPlace, AtPercept]
#: The same, where a number is a place, and a percept was sensed at one.
AnyElement = Union[int, PerceptCue, SequenceElement]


def element(element: AnyElement) -> SequenceElement:
    """An element as it is sent."""
    if isinstance(element, (AtPlace, AtPercept)):
        return element
    if isinstance(element, (Level, Descriptor)):
        return AtPercept(element)
    return AtPlace(element)


@dataclass(frozen=True)
class SequenceQuery:
    """Asks what comes next after the last places of somebody, by the trips that they look like."""

    #: The last places, or what was sensed at each, oldest first; 1 to 64.
    cue: Tuple[SequenceElement, ...]
    #: How many of them are wrong, 0.001 to 0.5; 0.1 when absent.
    error_rate: Optional[float] = None
    #: How likely nobody has travelled such a sequence, before it is compared with anything, 0.001
    #: to 0.999; 0.05 when absent.
    none_prior: Optional[float] = None
    #: Most places and most trips in the answer, 1 to 1000; 10 when absent.
    limit: Optional[int] = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "cue", all_of("cue", self.cue, (AtPlace, AtPercept)))
        for name in ("error_rate", "none_prior"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, number(name, getattr(self, name)))
        if self.limit is not None:
            object.__setattr__(self, "limit", whole("limit", self.limit, COUNT_RANGE))


@dataclass(frozen=True)
class NextPlace:
    """A place that may come next."""

    #: The place, which may have been forgotten.
    place: int
    #: Its probability.
    probability: float


@dataclass(frozen=True)
class SequenceTrip:
    """A trip that a sequence looks like."""

    trip: int
    #: The agent that travelled it.
    agent: str
    #: Probability that the sequence is on this trip.
    probability: float
    #: The number of the leg that most likely comes next, counted from 0; as many as the trip has
    #: legs where it ended there.
    leg: int


@dataclass(frozen=True)
class SequenceAnswer:
    """What comes next. The probabilities of the places, `others` and `none` add up to 1."""

    space: str
    map_revision: int
    #: What comes next, the likeliest first.
    next: Tuple[NextPlace, ...]
    #: Probability of further places, beyond the limit.
    others: float
    #: Probability that nothing of what was travelled comes next.
    none: float
    #: The trips that it looks like, the likeliest first.
    trips: Tuple[SequenceTrip, ...]
