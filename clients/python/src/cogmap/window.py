"""The window of unacknowledged samples: numbering, acknowledgement, and what to send again when.

Pure logic: bytes and times come in as arguments (seconds of any clock that never runs backwards),
so that every loss and delay can be tested without a network. The rules:

* A sample is held until a watermark covers it.
* A *gap* in a watermark is sent again at once, the same gap at most every `gap_interval_s`.
* A watermark whose `applied` has fallen back tells of a restarted service, and one of a larger
  *term* of another owner of the space: what the one before had only in memory is gone, and
  everything from the watermark on is sent again, as after a silence.
* What comes of a smaller term than the largest that was heard is outdated, and counts for nothing.
* When samples are outstanding and the watermark has not moved for `silence_s`, the watermark is
  asked for; if it does not move within `grace_s` either, everything from the watermark on is sent
  again. The wait doubles from time to time, up to `silence_max_s`, until the watermark moves.
* When the service is back after it was gone, the watermark is asked for at once, and what it does
  not cover is sent again as soon as it comes, or after `grace_s`.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Deque, List, Optional, Tuple

from .scalar import whole, within


@dataclass(frozen=True)
class WindowLimits:
    """Bounds and waits of a window."""

    #: Most samples held: at 1 kHz, a minute without acknowledgement.
    capacity_samples: int = 65_536
    #: Most bytes held: descriptors may be a hundred times larger than motion.
    capacity_bytes: int = 64 << 20
    #: A batch is sent when it has this many samples …
    batch_samples: int = 64
    #: … or this many bytes, far below what the service takes in one message …
    batch_bytes: int = 256 << 10
    #: … or its first sample has waited this long [s].
    batch_delay_s: float = 0.02
    #: A watermark that does not move for this long is asked for [s].
    silence_s: float = 1.0
    #: Longest such wait, while nothing helps [s].
    silence_max_s: float = 4.0
    #: How long the answer may take before everything is sent again [s].
    grace_s: float = 0.2
    #: Least time between two repetitions of the same gap [s].
    gap_interval_s: float = 0.2

    def __post_init__(self) -> None:
        bounds = (1, 1 << 62)
        whole("window_samples", self.capacity_samples, bounds)
        whole("window_bytes", self.capacity_bytes, bounds)
        whole("batch_samples", self.batch_samples, (1, 4096))
        within("batch_delay_s", self.batch_delay_s, 0.0, 3600.0)


@dataclass(frozen=True)
class Outgoing:
    """Consecutive samples to be sent as one batch."""

    first_seq: int
    samples: Tuple[bytes, ...]
    #: Whether all of them have been sent before.
    repeated: bool


class Window:
    """Samples from the watermark on, by sequence number.

    `durable <= sent <= next_seq`: below `durable` a sample is acknowledged and gone, below `sent`
    it was sent at least once, from `next_seq` on it does not exist yet.
    """

    #: Repetitions go in batches of at least this size, whatever the size of first batches.
    REPEAT_SAMPLES_MIN = 64

    def __init__(self, limits: WindowLimits = WindowLimits()) -> None:
        self._limits = limits
        self._samples: Deque[bytes] = deque()
        self._bytes = 0
        self._durable = 0
        self._sent = 0
        self._next_seq = 0
        self._unsent_bytes = 0
        self._unsent_since = 0.0
        self._hurry_below = 0
        # Disjoint ranges [start, stop) to send again, in order.
        self._repeat: List[Tuple[int, int]] = []
        self._applied = 0
        # The largest term that was heard of the agent, and that of the latest watermark.
        self._term = 0
        self._marked_term: Optional[int] = None
        self._restart_at = float("-inf")
        # The gap that was sent again last, and when; `_gap_again` when it was named too soon after.
        self._gap: Tuple[int, int] = (-1, -1)
        self._gap_at = float("-inf")
        self._gap_again = False
        self._quiet_since = 0.0
        self._silence_s = limits.silence_s
        self._asked_at: Optional[float] = None
        self._rejoining = False

    @property
    def durable(self) -> int:
        """Every sample below this number is on the service's disk."""
        return self._durable

    @property
    def sent(self) -> int:
        """Every sample below this number has been sent at least once."""
        return self._sent

    @property
    def next_seq(self) -> int:
        """Number of the next sample."""
        return self._next_seq

    @property
    def pending(self) -> int:
        """Samples that no watermark covers."""
        return self._next_seq - self._durable

    def has_room(self, size: int) -> bool:
        """Whether a sample of `size` bytes fits. An empty window takes any sample."""
        if not self._samples:
            return True
        return (
            len(self._samples) < self._limits.capacity_samples
            and self._bytes + size <= self._limits.capacity_bytes
        )

    def append(self, sample: bytes, now: float) -> int:
        """Takes a sample in and gives it its number. The caller has asked `has_room`."""
        if self._sent == self._next_seq:
            self._unsent_since = now
        self._samples.append(sample)
        self._bytes += len(sample)
        self._unsent_bytes += len(sample)
        seq = self._next_seq
        self._next_seq += 1
        return seq

    def hurry(self) -> None:
        """Lets all samples that are here now leave without waiting for a full batch."""
        self._hurry_below = self._next_seq

    def ready(self, now: float) -> bool:
        """Whether `take` has something to send."""
        return bool(self._repeat) or self._first_sending_due(now)

    def _first_sending_due(self, now: float) -> bool:
        unsent = self._next_seq - self._sent
        return unsent > 0 and (
            unsent >= self._limits.batch_samples
            or self._unsent_bytes >= self._limits.batch_bytes
            or self._sent < self._hurry_below
            or now >= self._unsent_since + self._limits.batch_delay_s
        )

    def take(self, now: float) -> Optional[Outgoing]:
        """The next batch to send, counted as sent; repetitions first, for later samples wait for
        them. `None` when nothing is due."""
        if self._repeat:
            start, stop = self._repeat.pop(0)
            most = max(self._limits.batch_samples, self.REPEAT_SAMPLES_MIN)
            samples = self._slice(start, min(stop, start + most))
            if start + len(samples) < stop:
                self._repeat.insert(0, (start + len(samples), stop))
            if not self._repeat:
                # The wait for an answer starts when the last repetition is out.
                self._quiet_since = now
            return Outgoing(start, samples, repeated=True)
        if not self._first_sending_due(now):
            return None
        samples = self._slice(
            self._sent, min(self._next_seq, self._sent + self._limits.batch_samples)
        )
        if self._sent == self._durable:
            self._quiet_since = now
        outgoing = Outgoing(self._sent, samples, repeated=False)
        self._sent += len(samples)
        self._unsent_bytes -= sum(map(len, samples))
        self._unsent_since = now
        return outgoing

    def _slice(self, start: int, stop: int) -> Tuple[bytes, ...]:
        """Samples from `start`, at least one, up to `stop` or the byte limit of a batch."""
        chosen: List[bytes] = []
        size = 0
        # A deque is slow in its middle, so walk it only once per batch.
        self._samples.rotate(self._durable - start)
        for index in range(stop - start):
            sample = self._samples[index]
            size += len(sample)
            if chosen and size > self._limits.batch_bytes:
                break
            chosen.append(sample)
        self._samples.rotate(start - self._durable)
        return tuple(chosen)

    def is_outdated(self, term: int) -> bool:
        """Notes the term of an estimate or a watermark of the agent; says whether it is outdated:
        written by an owner of the space that has lost it."""
        is_outdated = term < self._term
        self._term = max(self._term, term)
        return is_outdated

    def acknowledge(
        self,
        durable: int,
        applied: int,
        gap: Optional[Tuple[int, int]],
        now: float,
        term: int = 0,
    ) -> bool:
        """Takes in a watermark of this session; says whether it moved.

        Watermarks may come late, twice or out of order. What is on disk stays there, so one with a
        lower `durable` is an old message. The caller has made sure that `durable <= sent`.
        """
        if self.is_outdated(term) or not self._durable <= durable <= self._sent:
            return False
        moved = durable > self._durable
        if moved:
            for _ in range(durable - self._durable):
                self._bytes -= len(self._samples.popleft())
            self._durable = durable
            self._repeat = [
                (max(start, durable), stop) for start, stop in self._repeat if stop > durable
            ]
            self._quiet_since = now
            self._silence_s = self._limits.silence_s
            self._asked_at = None
        fell_back = applied < self._applied
        self._applied = applied
        is_other_owner = self._marked_term is not None and self._marked_term < term
        self._marked_term = term
        is_restart = fell_back and now >= self._restart_at + self._limits.gap_interval_s
        if self._rejoining:
            self._rejoining = False
            self._asked_at = None
            self._quiet_since = now
            self.resend()
        elif is_other_owner or is_restart:
            self._restart_at = now
            self.resend()
        if gap is None:
            self._gap_again = False
        elif gap[0] == self._gap[0] and now < self._gap_at + self._limits.gap_interval_s:
            self._gap, self._gap_again = gap, True
        else:
            self._repeat_gap(gap, now)
        return moved

    def _repeat_gap(self, gap: Tuple[int, int], now: float) -> None:
        self._gap, self._gap_at, self._gap_again = gap, now, False
        start, stop = max(gap[0], self._durable), min(gap[1], self._sent)
        if start < stop:
            self._schedule(start, stop)

    def _schedule(self, start: int, stop: int) -> None:
        """Adds a range to what is to be sent again, merged with the ranges that it touches."""
        apart = []
        for other_start, other_stop in self._repeat:
            if other_stop < start or stop < other_start:
                apart.append((other_start, other_stop))
            else:
                start, stop = min(start, other_start), max(stop, other_stop)
        self._repeat = sorted([*apart, (start, stop)])

    def resend(self) -> None:
        """Schedules everything that was sent and not acknowledged."""
        if self._durable < self._sent:
            self._repeat = [(self._durable, self._sent)]

    def rejoin(self, now: float) -> bool:
        """The service is there again. True: ask for the watermark now."""
        self._silence_s = self._limits.silence_s
        if self._durable == self._sent:
            return False
        # What was put since it went may be lost, and so may be what was on its way.
        self._rejoining = True
        self._repeat = []
        self._asked_at = now
        return True

    def watch(self, now: float) -> bool:
        """Looks for silence. True: ask for the watermark now. When asking has not helped,
        everything outstanding is scheduled."""
        if self._gap_again and now >= self._gap_at + self._limits.gap_interval_s:
            self._repeat_gap(self._gap, now)
        if self._durable == self._sent or self._repeat:
            return False
        if self._asked_at is not None:
            if now >= self._asked_at + self._limits.grace_s:
                self._asked_at = None
                self._rejoining = False
                self._silence_s = min(2 * self._silence_s, self._limits.silence_max_s)
                self.resend()
            return False
        if now >= self._quiet_since + self._silence_s:
            self._asked_at = now
            return True
        return False

    def wake_at(self) -> Optional[float]:
        """When `ready` or `watch` may next have something to do; `None` while all is
        acknowledged."""
        times = []
        if self._repeat or self._sent < self._hurry_below:
            return float("-inf")
        if self._sent < self._next_seq:
            times.append(self._unsent_since + self._limits.batch_delay_s)
        if self._gap_again:
            times.append(self._gap_at + self._limits.gap_interval_s)
        if self._durable < self._sent:
            if self._asked_at is not None:
                times.append(self._asked_at + self._limits.grace_s)
            else:
                times.append(self._quiet_since + self._silence_s)
        return min(times) if times else None
