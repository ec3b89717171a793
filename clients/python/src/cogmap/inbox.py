"""Messages of one kind that wait for the robot's own thread."""

from __future__ import annotations

import logging
from collections import deque
from typing import Callable, Deque, Generic, Optional, Tuple, Type, TypeVar, Union

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

    def take(self) -> Optional[T]:
        """The oldest message; `None` if it cannot be read."""
        return self._read(*self._waiting.popleft())

    def take_latest(self, is_wanted: Callable[[T], bool]) -> Optional[T]:
        """The latest message that is wanted; those before it are dropped unread. What comes
        meanwhile waits."""
        waiting = [self._waiting.popleft() for _ in range(len(self._waiting))]
        for encoding, data in reversed(waiting):
            message = self._read(encoding, data)
            if message is not None and is_wanted(message):
                return message
        return None

    def _read(self, encoding: str, data: bytes) -> Optional[T]:
        try:
            return decode(self._kind, data, encoding)
        except WireError as error:
            _log.warning("%s: %s", self._kind.__name__.lower(), error)
            return None
