"""Failures of the network, as errors that say which address failed."""

from __future__ import annotations

import http.client
import socket
import urllib.error
from contextlib import contextmanager
from typing import Iterator

from .errors import CogmapError, Timeout, Unreachable, WireError


@contextmanager
def translated(where: str) -> Iterator[None]:
    """Raises what goes wrong inside with `where`, a method and an address, in its message."""
    try:
        yield
    except WireError as error:
        raise WireError(f"{where}: {error}") from error
    except CogmapError:
        raise
    except (OSError, http.client.HTTPException) as error:
        raise _translation(where, error) from error


def _translation(where: str, error: Exception) -> CogmapError:
    reason = error.reason if isinstance(error, urllib.error.URLError) else error
    if isinstance(reason, (TimeoutError, socket.timeout)):  # One class from Python 3.10 on.
        return Timeout(f"{where}: no answer in time")
    if isinstance(reason, ConnectionRefusedError):
        return Unreachable(f"{where}: nothing listens there ({reason.strerror})")
    if isinstance(reason, (http.client.BadStatusLine, http.client.LineTooLong)) and not isinstance(
        reason, http.client.RemoteDisconnected
    ):
        return Unreachable(f"{where}: what answers there does not speak HTTP")
    detail = str(getattr(reason, "strerror", None) or reason) or type(reason).__name__
    return Unreachable(f"{where}: {detail}")
