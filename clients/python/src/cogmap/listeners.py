"""The callbacks of a robot."""

from __future__ import annotations

import logging
import weakref
from typing import Callable, List, TypeVar

from .answer import Rejection
from .estimate import Estimate

_log = logging.getLogger("cogmap")

T = TypeVar("T")


class Listeners:
    """The callbacks of a robot. The robot alone keeps them: a callback often keeps its robot, which
    nobody could drop if the robot's thread kept the callback."""

    def __init__(self) -> None:
        self.estimates: List[Callable[[Estimate], object]] = []
        self.rejections: List[Callable[[Rejection], object]] = []


class WeakListeners:
    """The callbacks of a robot as its thread knows them, as long as there is the robot."""

    def __init__(self, listeners: Listeners) -> None:
        self._listeners = weakref.ref(listeners)

    def want_estimates(self) -> bool:
        """Whether anybody wants each estimate."""
        listeners = self._listeners()
        return listeners is not None and bool(listeners.estimates)

    def hear_estimate(self, estimate: Estimate) -> None:
        """Calls those who want each estimate."""
        listeners = self._listeners()
        if listeners is not None:
            _call(listeners.estimates, estimate)

    def hear_rejection(self, rejection: Rejection) -> None:
        """Calls those who want each refused range."""
        listeners = self._listeners()
        if listeners is not None:
            _call(listeners.rejections, rejection)


def _call(callbacks: List[Callable[[T], object]], argument: T) -> None:
    for callback in list(callbacks):
        try:
            callback(argument)
        except Exception:  # An error of the user's callback must not end the robot's thread.
            _log.exception("callback %r", callback)
