"""A signal that wakes one thread."""

from __future__ import annotations

import queue
from typing import Optional


class Wake:
    """Like `threading.Event` for one waiting thread, but `set` may be called anywhere: also while a
    garbage collection interrupts another `set`, as happens when a dropped robot is finalised."""

    def __init__(self) -> None:
        self._signals: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._is_set = False

    def set(self) -> None:
        """Wakes the thread, now or as soon as it waits. What it has to see must be in place
        before."""
        if not self._is_set:
            self._is_set = True
            self._signals.put(None)

    def wait(self, timeout_s: Optional[float]) -> None:
        """Waits until it is set, at most for `timeout_s`, and resets it."""
        try:
            self._signals.get(timeout=timeout_s)
        except queue.Empty:
            pass
        # Reset before the thread looks at what is there: what comes later sets it again.
        self._is_set = False
