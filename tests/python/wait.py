"""Waiting for what has to come."""

from __future__ import annotations

import time
from typing import Callable, Optional, TypeVar

#: Longest wait of any test for anything [s]: reached only where something is broken.
LONG_S = 90.0
#: How often is looked [s].
_PAUSE_S = 0.02

T = TypeVar("T")


def eventually(what: str, look: Callable[[], Optional[T]]) -> T:
    """Looks until `look` finds something that is neither `None` nor `False`, and returns that."""
    deadline = time.monotonic() + LONG_S
    while True:
        found = look()
        if found is not None and found is not False:
            return found
        assert time.monotonic() < deadline, f"{what}: not within {LONG_S} s"
        time.sleep(_PAUSE_S)
