"""A robot that sends samples through a node, whatever happens to the others."""

from __future__ import annotations

import functools
import threading
import time
from dataclasses import dataclass
from types import TracebackType
from typing import List, Optional, Type

from asking import AGAIN, Answer, Line
from circle import AGENT, BATCH, batch
from cogmap.wire import encode
from wait import LONG_S, eventually

#: Time between messages [s]: a load of some hundred samples in a second, little enough for a drill
#: of minutes to be repeated without disturbance in seconds.
PACE_S = 0.02
#: How long a robot waits for an answer before it sends its message again [s].
PATIENCE_S = 2.0
#: Time until a message is sent again that was refused [s].
_RETRY_S = 0.02


@dataclass(frozen=True)
class Ack:
    """An acknowledged message."""

    #: When the request was sent that was answered, and when the answer came [s].
    sent_s: float
    told_s: float
    #: Every sample below this number is on disk.
    durable: int
    #: Term of the owner that says so.
    term: int


class Writer:
    """A thread that sends the samples of a space's only robot, message by message, each again until
    it is acknowledged. A context: it ends at the end of the block at the latest.

    Args:
        url: HTTP interface of the node.
        space: Name of the space.
        samples: Samples of a message.
        pace_s: Time between messages [s].
        patience_s: How long it waits for an answer before it sends a message again [s].
    """

    def __init__(
        self,
        url: str,
        space: str,
        *,
        samples: int = BATCH,
        pace_s: float = PACE_S,
        patience_s: float = PATIENCE_S,
    ) -> None:
        self.space = space
        #: What was acknowledged, in order.
        self.acks: List[Ack] = []
        self._samples = samples
        self._pace_s = pace_s
        self._url = url
        self._patience_s = patience_s
        self._wrong: Optional[str] = None
        # After the message under way, and without it.
        self._stop = threading.Event()
        self._abort = threading.Event()
        self._thread = threading.Thread(target=self._write, name=f"writer of {space}")

    def __enter__(self) -> Writer:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        self._abort.set()
        self._end()

    def through(self, url: str) -> None:
        """Sends the messages after the one under way through another node."""
        self._url = url

    @property
    def acknowledged(self) -> int:
        """Every sample below this number was acknowledged."""
        return self.acks[-1].durable if self.acks else 0

    def await_acks(self, count: int = 1) -> Ack:
        """Waits for so many acknowledgements of messages that are sent from now on, and returns the
        first one."""
        return self.await_acks_since(time.monotonic(), count)

    def await_acks_since(self, instant_s: float, count: int = 1) -> Ack:
        """The same of messages that were sent after an instant."""
        begin = len(self.acks)
        while begin > 0 and self.acks[begin - 1].sent_s >= instant_s:
            begin -= 1

        def look() -> Optional[Ack]:
            assert self._wrong is None, self._wrong
            later = [ack for ack in self.acks[begin:] if ack.sent_s >= instant_s]
            return later[0] if len(later) >= count else None

        return eventually(f"{count} acknowledgements in {self.space}", look)

    def finish(self) -> int:
        """Ends it after the message under way, and returns how many samples were acknowledged."""
        self._end()
        assert self._wrong is None, self._wrong
        return self.acknowledged

    def longest_pause_s(self) -> float:
        """Longest time between one acknowledgement and the next [s]."""
        pairs = zip(self.acks, self.acks[1:])
        return max((later.told_s - earlier.told_s for earlier, later in pairs), default=0.0)

    def _end(self) -> None:
        self._stop.set()
        self._thread.join()

    def _write(self) -> None:
        url, line = self._url, Line(self._url, self._patience_s)
        while not self._stop.is_set() and self._wrong is None:
            if url != self._url:
                line.close()
                url, line = self._url, Line(self._url, self._patience_s)
            self._send(line, message(self.acknowledged, self._samples))
            self._stop.wait(self._pace_s)
        line.close()

    def _send(self, line: Line, data: bytes) -> None:
        """Sends a message until it is acknowledged."""
        deadline_s = time.monotonic() + LONG_S
        last = "nothing"
        while time.monotonic() < deadline_s:
            sent_s = time.monotonic()
            try:
                answer = line.post_samples(self.space, AGENT, data)
            except OSError as error:
                last = repr(error)
            else:
                if answer.status not in AGAIN:
                    return self._take(answer, sent_s)
                last = str(answer)
            if self._abort.wait(_RETRY_S):
                return
        self._wrong = f"{self.space}: not acknowledged within {LONG_S} s; {last} came last"

    def _take(self, answer: Answer, sent_s: float) -> None:
        if not answer.is_good:
            self._wrong = f"samples of {self.space} from {self.acknowledged} on: {answer}"
            return
        mark = answer.body["watermark"]
        expected = self.acknowledged + self._samples
        if mark["durable"] != expected:
            self._wrong = f"{self.space}: {mark} acknowledges the samples below {expected}"
            return
        self.acks.append(Ack(sent_s, time.monotonic(), mark["durable"], mark.get("term", 0)))


@functools.lru_cache(maxsize=4096)
def message(first: int, samples: int) -> bytes:
    """A batch of the robot's samples from one number on, in CBOR: the same in every space."""
    return encode(batch(first, samples))
