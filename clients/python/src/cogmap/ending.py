"""The end of a program whose robots are not closed."""

from __future__ import annotations

import atexit
import os
import time
from typing import Protocol, Set, Tuple

#: How long the samples of all robots are flushed at the end of the program [s], and how long they
#: may take to leave Zenoh afterwards.
_FLUSH_S = 1.0
_LEAVE_S = 0.5


class Endable(Protocol):
    """What has a thread that may run until the program ends."""

    def stop(self, flush_s: float) -> None:
        """Asks the thread to end as soon as it can, at the latest after `flush_s`."""

    def join(self, timeout_s: float) -> bool:
        """Waits for its end; says whether it came."""

    def stay_behind(self) -> None:
        """This process was forked off, and its thread stayed in the other one."""


_running: Set[Endable] = set()


def begins(thread: Endable) -> None:
    """Something has to be ended with the program."""
    _running.add(thread)


def has_ended(thread: Endable) -> None:
    """It need not be any more."""
    _running.discard(thread)


def _end_all() -> None:
    # No thread can be started any more at this point, so each one that is there ends itself.
    threads: Tuple[Endable, ...] = tuple(_running)
    for thread in threads:
        thread.stop(_FLUSH_S)
    end = time.monotonic() + _FLUSH_S + _LEAVE_S
    for thread in threads:
        thread.join(max(0.0, end - time.monotonic()))


def _forked() -> None:
    threads = tuple(_running)
    _running.clear()
    for thread in threads:
        thread.stay_behind()


atexit.register(_end_all)
if hasattr(os, "register_at_fork"):  # Windows has no forks.
    os.register_at_fork(after_in_child=_forked)
