"""Callbacks of the user's program."""

from __future__ import annotations

import logging
from typing import Any, Callable, List

_log = logging.getLogger("cogmap")


def call_each(callbacks: List[Callable[[Any], object]], argument: Any) -> None:
    """Calls all of them; an error of one is logged and ends neither the others nor the caller."""
    for callback in callbacks:
        try:
            callback(argument)
        except Exception:  # An error of the user's callback must not end the robot's thread.
            _log.exception("callback %r", callback)
