"""What the service tells a run, until the run's own thread takes it."""

from __future__ import annotations

from typing import Callable, Iterator, Union

from . import bounds
from .answer import Watermark
from .estimate import Estimate
from .inbox import Inbox
from .problem import Problem
from .wake import Wake


def is_news(estimate: Estimate, known: Estimate) -> bool:
    """Whether one of a run is later than another one, or of the same sample and another map.
    Another owner of the space begins where the journal ends, which may be before."""
    age, known_age = (estimate.term, estimate.seq), (known.term, known.seq)
    return age > known_age or (
        age == known_age and estimate.map_revision != known.map_revision
    )


class Incoming:
    """The messages that wait for a run's thread, a queue for each kind."""

    def __init__(self, wake: Wake) -> None:
        self.estimates = Inbox(Estimate, bounds.ESTIMATES_WAITING_MAX, wake)
        self.watermarks = Inbox(Watermark, bounds.ANSWERS_WAITING_MAX, wake)
        self.problems = Inbox(Problem, bounds.ANSWERS_WAITING_MAX, wake)

    def drain(
        self, every_estimate: bool, is_wanted: Callable[[Estimate], bool]
    ) -> Iterator[Union[Estimate, Watermark, Problem]]:
        """What waits, one after the other; of estimates those that are wanted, and without
        `every_estimate` only the latest of them.

        Estimates come first, and of the watermarks only those that are here when it begins: when a
        flush returns, the estimate that was published before is in place. What comes meanwhile
        wakes the thread again.
        """
        watermarks = len(self.watermarks)
        while self.estimates:
            if every_estimate:
                estimate = self.estimates.take()
            else:
                # Nobody asked for each one, and only the latest is kept: spare the decoding.
                estimate = self.estimates.take_latest(is_wanted)
            if estimate is not None and is_wanted(estimate):
                yield estimate
        for _ in range(watermarks):
            watermark = self.watermarks.take()
            if watermark is not None:
                yield watermark
        while self.problems:
            problem = self.problems.take()
            if problem is not None:
                yield problem
