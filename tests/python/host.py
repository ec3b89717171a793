"""Where a service runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple


@dataclass(frozen=True)
class Host:
    """Where a service runs, and by which addresses it is reached: on this machine's loopback, if
    nothing else is said."""

    #: What its command begins with.
    enter: Tuple[str, ...] = ()
    #: Where it listens to HTTP.
    listens: str = "127.0.0.1"
    #: Where tests reach its HTTP.
    reached: str = "127.0.0.1"
    #: Where it listens to Zenoh, and where other services reach it.
    inner: str = "127.0.0.1"
