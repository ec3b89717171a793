"""Processes that are forked off from one in which Zenoh runs.

Zenoh's threads stay behind in the parent. In the child whatever needs them would wait for ever, so
it is refused there.
"""

from __future__ import annotations

import os
from typing import Optional

from .errors import CogmapError

_process: Optional[int] = None


def zenoh_begins() -> None:
    """Zenoh is about to be used in this process.

    Raises `CogmapError` where it cannot be.
    """
    global _process
    if _process is None:
        _process = os.getpid()
    if _process != os.getpid():
        raise CogmapError(
            "this process was forked off from one that uses Zenoh, whose threads are not here: "
            "open robots in the child alone, or let multiprocessing start processes by "
            "get_context('spawn')"
        )
