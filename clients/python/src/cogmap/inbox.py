"""Messages of one kind that wait for the robot's own thread."""

from __future__ import annotations

import logging
from collections import deque
from typing import Deque, Generic, Optional, Tuple, Type, TypeVar, Union

import zenoh

from .errors import WireError
from .wake import Wake
from .wire import decode

_log = logging.getLogger("cogmap")

T = TypeVar("T")


class Inbox(Generic[T]):
    """A bounded queue; when it is full the oldest message is dropped.

    Zenoh's callbacks only append here: they run on the thread that reads the network.
    """

    def __init__(self, kind: Type[T], size: int, wake: Wake) -> None:
        self._kind = kind
        self._waiting: Deque[Tuple[str, bytes]] = deque(maxlen=size)
        self._wake = wake

    def hear(self, message: Union[zenoh.Sample, zenoh.ReplyError]) -> None:
        """Takes in a message of a subscription, or an answer to a query."""
        self._waiting.append((str(message.encoding), message.payload.to_bytes()))
        self._wake.set()

    def __len__(self) -> int:
        return len(self._waiting)

    def drop(self) -> None:
        """Drops the oldest message unread."""
        self._waiting.popleft()

    def take(self) -> Optional[T]:
        """The oldest message; `None` if it cannot be read."""
        encoding, data = self._waiting.popleft()
        try:
            return decode(self._kind, data, encoding)
        except WireError as error:
            _log.warning("%s: %s", self._kind.__name__.lower(), error)
            return None
