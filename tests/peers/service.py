"""A cogmap service on loopback ports, started for a comparison and gone after it.

It is the service of the end-to-end tests (`tests/python/server.py`), with the binary that the
caller names and without Zenoh: peers ask over HTTP alone.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import tempfile
from pathlib import Path
from typing import Iterator

sys.path.insert(0, str(Path(__file__).parents[1] / "python"))

from server import Server

#: What `make release` builds.
BINARY = Path("target", "release", "cogmap")


@contextlib.contextmanager
def service(binary: Path) -> Iterator[Server]:
    """A running service with an empty store and its default settings.

    Args:
        binary: The program `cogmap`.
    """
    # A comparison that is told to end takes what it has started with it.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    # Where the end-to-end tests look for it.
    os.environ["COGMAP_BIN"] = str(binary)
    with tempfile.TemporaryDirectory(prefix="cogmap-peers-") as home:
        server = Server(Path(home), ["zenoh.enabled=false"])
        try:
            server.start()
            yield server
        except BaseException:
            print(server.log_tail(), file=sys.stderr)
            raise
        finally:
            server.close()
