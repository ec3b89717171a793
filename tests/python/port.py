"""Free loopback ports that stay free."""

from __future__ import annotations

import fcntl
import random
import socket
import tempfile
from pathlib import Path

#: Below the range from which systems take the ports of outgoing connections: such a connection
#: could otherwise sit on a server's port while the server is down.
_RANGE = range(18_000, 32_000)


class Port:
    """A port of the loopback interface, kept from other tests by a locked file as long as this
    lives, also while no server listens on it. The end-to-end tests in Rust use the same files."""

    def __init__(self) -> None:
        locks = Path(tempfile.gettempdir(), "cogmap-test-ports")
        locks.mkdir(exist_ok=True)
        # Not the seed of a test: tests that run side by side must not ask for the same ports.
        chance = random.SystemRandom()
        for _ in range(1000):
            number = chance.choice(_RANGE)
            lock = (locks / str(number)).open("w")
            if _locked(lock.fileno()) and _unused(number):
                self.number = number
                self._lock = lock
                return
            lock.close()
        raise RuntimeError(f"no port of {_RANGE} is free")


def _locked(file: int) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _unused(number: int) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", number))
        except OSError:
            return False
    return True
