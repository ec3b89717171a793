"""A robot: samples out, estimates and watermarks in."""

from __future__ import annotations

import logging
import threading
import time
from types import TracebackType
from typing import Callable, Dict, Iterable, List, Optional, Tuple, Type, Union

import zenoh

from .answer import Estimate, Rejection, Watermark
from .callback import call_each
from .errors import Closed, CogmapError, SessionSuperseded, Timeout, WindowFull
from .inbox import Inbox
from .key import check_name, durable_key, estimate_key, query_key, samples_key
from .link import DEFAULT_ENDPOINT, ask, has_subscriber, open_session, within
from .query import WatermarkQuery
from .sample import MotionNoise, Sample, SampleBody, SessionEnd
from .sampler import Sampler
from .window import Window, WindowLimits
from .wire import CBOR, encode_batch, encode_sample

_log = logging.getLogger("cogmap")

#: Estimates that wait for the callback; beyond it the oldest are dropped.
_ESTIMATES_WAITING_MAX = 4096
#: Watermarks that wait; a later one says all that an earlier one did.
_WATERMARKS_WAITING_MAX = 256
#: Rejections remembered, the latest ones.
_REJECTIONS_MAX = 1024
#: How often the arrival of the service is looked for [s].
_MATCH_POLL_S = 0.01
#: How long the first batch waits for the watermark that the service has of this agent [s].
_FIRST_ANSWER_S = 0.2


class Robot(Sampler):
    """One run of an agent in a space.

    Methods may be called from any thread. A sample method returns the sample's sequence number as
    soon as the sample is in the window; `flush` returns when the service has everything on disk.
    What no watermark covers is held and sent again after a loss, a reconnect or a restart of the
    service. When the window is full a sample method waits, up to `send_timeout_s`.

    Args:
        space: Name of the space.
        agent: Name of the agent.
        connect: Zenoh endpoint, or several of them to try; `tcp/127.0.0.1:7447` when absent.
        session: An open Zenoh session to use instead; it is left open by `close`.
        session_id: Number of this run; it must be larger than those of earlier runs. The time of the
            start [ns] when absent.
        batch_samples: Most samples of one message, 1 to 4096.
        batch_delay_s: Longest time that a sample waits for others [s].
        window_samples: Most samples without acknowledgement.
        window_bytes: The same in bytes.
        motion_noise: Noise of motion samples that carry none; the space's own when absent.
        send_timeout_s: How long a sample method waits for room before `WindowFull` [s].
        connect_timeout_s: How long to wait for the router [s].
        match_timeout_s: How long samples wait for the service before they are sent anyway [s].
        ends_session: Whether `close` ends the session, and the trip under way, by a last sample.

    Raises:
        ValueError: A name is not valid, or both `connect` and `session` are given.
        Timeout: No router answers.
    """

    def __init__(
        self,
        space: str,
        agent: str,
        *,
        connect: Union[None, str, Iterable[str]] = None,
        session: Optional[zenoh.Session] = None,
        session_id: Optional[int] = None,
        batch_samples: int = 64,
        batch_delay_s: float = 0.02,
        window_samples: int = 65_536,
        window_bytes: int = 64 << 20,
        motion_noise: Optional[MotionNoise] = None,
        send_timeout_s: float = 10.0,
        connect_timeout_s: float = 10.0,
        match_timeout_s: float = 5.0,
        ends_session: bool = True,
    ) -> None:
        if connect is not None and session is not None:
            raise ValueError("give either connect or session")
        self.space = check_name("space", space)
        self.agent = check_name("agent", agent)
        self.session_id = time.time_ns() if session_id is None else session_id
        if not 0 <= self.session_id < 1 << 64:
            raise ValueError("session_id: an unsigned 64-bit number")
        super().__init__(motion_noise)
        self._send_timeout_s = send_timeout_s
        self._ends_session = ends_session
        self._window = Window(
            WindowLimits(
                capacity_samples=window_samples,
                capacity_bytes=window_bytes,
                batch_samples=batch_samples,
                batch_delay_s=batch_delay_s,
            )
        )
        # Guards everything below; notified on each change that somebody may wait for.
        self._changed = threading.Condition()
        self._last_stamp_ns = 0
        self._watermark: Optional[Watermark] = None
        self._superseded_by: Optional[int] = None
        self._superseded_told = False
        self._rejections: Dict[Rejection, None] = {}
        self._estimate: Optional[Estimate] = None
        self._on_estimate: List[Callable[[Estimate], object]] = []
        self._on_rejection: List[Callable[[Rejection], object]] = []
        self._closing = False
        self._stopped = False
        # Held while a batch is taken and put, so that batches leave in order.
        self._publishing = threading.Lock()
        self._wake = threading.Event()
        self._estimates_in = Inbox(Estimate, _ESTIMATES_WAITING_MAX, self._wake)
        self._watermarks_in = Inbox(Watermark, _WATERMARKS_WAITING_MAX, self._wake)

        self._own_session = session is None
        self._zenoh = (
            open_session(
                DEFAULT_ENDPOINT if connect is None else connect, timeout_s=connect_timeout_s
            )
            if session is None
            else session
        )
        self._subscribers: List[zenoh.Subscriber[None]] = [
            self._zenoh.declare_subscriber(estimate_key(space, agent), self._estimates_in.hear),
            self._zenoh.declare_subscriber(durable_key(space, agent), self._watermarks_in.hear),
        ]
        self._publisher = self._zenoh.declare_publisher(
            samples_key(space, agent),
            encoding=CBOR,
            congestion_control=zenoh.CongestionControl.BLOCK,
            express=False,
        )
        self._may_send = False
        self._match_deadline = time.monotonic() + match_timeout_s
        self._worker = threading.Thread(
            target=self._work, name=f"cogmap-{space}-{agent}", daemon=True
        )
        self._worker.start()

    # Samples beyond the methods of `Sampler`

    def send(self, samples: Iterable[Sample]) -> range:
        """Samples made beforehand, in order. Returns their sequence numbers.

        Raises `WindowFull` like every sample method; its `accepted` says how many were taken.
        """
        first: Optional[int] = None
        accepted = 0
        deadline = time.monotonic() + self._send_timeout_s
        for sample in samples:
            seq = self._append(sample.body, sample.stamp_ns, deadline, accepted)
            first = seq if first is None else first
            accepted += 1
        if first is None:
            with self._changed:
                return range(self._window.next_seq, self._window.next_seq)
        return range(first, first + accepted)

    def _send(self, body: SampleBody, stamp_ns: Optional[int]) -> int:
        return self._append(body, stamp_ns, time.monotonic() + self._send_timeout_s, 0)

    def _append(
        self, body: SampleBody, stamp_ns: Optional[int], deadline: float, accepted: int
    ) -> int:
        by_clock = stamp_ns is None
        data = b"" if stamp_ns is None else encode_sample(Sample(stamp_ns, body))
        with self._changed:
            while True:
                self._check_open()
                if by_clock:
                    # Stamped under the lock that numbers it, and again after each wait: a sample of
                    # another thread that gets in between would else have the later stamp and the
                    # earlier number. The system's clock may be set back; stamps of a session may not.
                    stamp_ns = max(time.time_ns(), self._last_stamp_ns)
                    data = encode_sample(Sample(stamp_ns, body))
                if self._window.has_room(len(data)):
                    break
                self._window.hurry()
                self._wake.set()
                remaining = deadline - time.monotonic()
                if remaining <= 0:
                    raise WindowFull(accepted, self._window.pending)
                self._changed.wait(remaining)
            now = time.monotonic()
            starts_batch = self._window.sent == self._window.next_seq
            seq = self._window.append(data, now)
            if stamp_ns is not None:
                self._last_stamp_ns = max(self._last_stamp_ns, stamp_ns)
            due = self._window.ready(now)
        if due and self._may_send:
            # A full batch leaves on the caller's thread: a congested network slows the caller down.
            self._pump()
        elif starts_batch:
            self._wake.set()
        return seq

    # Acknowledgement

    def flush(self, timeout_s: float = 10.0) -> None:
        """Blocks until every sample sent so far is on the service's disk.

        Raises `Timeout` when it takes longer; the samples stay in the window and are sent again.
        """
        with self._changed:
            self._check_open()
            missing = self._wait_durable(timeout_s)
        if missing:
            raise Timeout(f"{missing} samples are not durable after {timeout_s} s")

    def _wait_durable(self, timeout_s: float) -> int:
        """Waits, with the condition held; returns the number of samples that are still missing."""
        if threading.current_thread() is self._worker:
            raise RuntimeError("a callback cannot wait for acknowledgements: they come after it")
        target = self._window.next_seq
        self._window.hurry()
        self._wake.set()
        self._changed.wait_for(
            lambda: self._window.durable >= target or self._superseded_by is not None, timeout_s
        )
        self._check_session()
        return max(0, target - self._window.durable)

    @property
    def watermark(self) -> Optional[Watermark]:
        """The latest watermark of this session; `None` before the first one."""
        with self._changed:
            return self._watermark

    @property
    def pending(self) -> int:
        """Samples without acknowledgement."""
        with self._changed:
            return self._window.pending

    @property
    def rejections(self) -> Tuple[Rejection, ...]:
        """Ranges of this session's samples that the service refused for good, oldest first."""
        with self._changed:
            return tuple(self._rejections)

    def on_rejection(self, callback: Callable[[Rejection], object]) -> None:
        """Calls `callback` once for each refused range, on the robot's own thread."""
        with self._changed:
            self._on_rejection.append(callback)

    # Estimates

    def estimate(self, timeout_s: float = 10.0) -> Estimate:
        """The latest estimate of this session; waits for the first one, then raises `Timeout`."""
        with self._changed:
            self._check_open()
            self._changed.wait_for(
                lambda: self._estimate is not None or self._superseded_by is not None, timeout_s
            )
            self._check_session()
            if self._estimate is None:
                raise Timeout(f"no estimate within {timeout_s} s")
            return self._estimate

    def on_estimate(self, callback: Callable[[Estimate], object]) -> None:
        """Calls `callback` with every estimate, on the robot's own thread; it should return soon."""
        with self._changed:
            self._on_estimate.append(callback)

    # Life

    def wait_for_service(self, timeout_s: float = 10.0) -> bool:
        """Waits until the service listens to this robot's samples; says whether it does."""
        deadline = time.monotonic() + timeout_s
        while not has_subscriber(self._publisher):
            if time.monotonic() >= deadline:
                return False
            time.sleep(_MATCH_POLL_S)
        if threading.current_thread() is self._worker:
            # Only the worker itself ends the wait below.
            return True
        with self._changed:
            # Full batches leave on the caller's thread only from then on.
            return self._changed.wait_for(
                lambda: self._may_send or self._stopped, max(0.0, deadline - time.monotonic())
            )

    def close(self, timeout_s: float = 5.0) -> None:
        """Ends the session and the trip under way, flushes for at most `timeout_s`, then closes, also
        when that fails; a second call does nothing.

        Raises `Timeout` when samples are left without acknowledgement: they are lost with this
        process unless they arrived all the same.
        """
        with self._changed:
            if self._closing:
                return
            self._end_session()
            self._closing = True
            self._changed.notify_all()
        missing = 0
        try:
            if threading.current_thread() is not self._worker:
                with self._changed:
                    if not self._superseded_told:
                        missing = self._wait_durable(timeout_s)
        finally:
            self._tear_down()
        if missing:
            raise Timeout(f"closed with {missing} samples that are not durable")

    def _end_session(self) -> None:
        """Appends the last sample, with the condition held: at the stamp of the one before, for the
        robot's clock may be another. A full window is left as it is."""
        if not self._ends_session or self._superseded_by is not None or not self._window.next_seq:
            return
        data = encode_sample(Sample(self._last_stamp_ns, SessionEnd()))
        if self._window.has_room(len(data)):
            self._window.append(data, time.monotonic())

    def _tear_down(self) -> None:
        with self._changed:
            self._stopped = True
            self._changed.notify_all()
        self._wake.set()
        if threading.current_thread() is not self._worker:
            # A put may block for 5 s on a dead link; the thread is a daemon, so give up after that.
            self._worker.join(6.0)
        steps: List[Callable[[], object]] = [entity.undeclare for entity in self._subscribers]
        steps.append(self._publisher.undeclare)
        if self._own_session:
            steps.append(self._zenoh.close)
        if not within(5.0, *steps):
            _log.warning("the Zenoh session of %s did not close in time", self.agent)

    def __enter__(self) -> Robot:
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        if error is None:
            self.close()
            return
        try:
            self.close(timeout_s=1.0)
        except CogmapError as second:
            # The first error is the one that the caller has to see.
            _log.warning("closing after an error: %s", second)

    def _check_open(self) -> None:
        if self._closing:
            raise Closed(f"robot {self.agent} is closed")
        self._check_session()

    def _check_session(self) -> None:
        if self._superseded_by is not None:
            self._superseded_told = True
            raise SessionSuperseded(self.session_id, self._superseded_by)

    # The robot's own thread

    def _work(self) -> None:
        while True:
            self._wake.wait(self._idle_s())
            self._wake.clear()
            if self._stopped:
                return
            self._receive()
            if not self._may_send:
                if not self._finds_service():
                    continue
                self._ask_first()
            self._pump()
            with self._changed:
                ask = self._superseded_by is None and self._window.watch(time.monotonic())
            if ask:
                _log.debug("no progress of %s: asking for the watermark", self.agent)
                self._ask_watermark(threading.Event())
            self._pump()

    def _idle_s(self) -> Optional[float]:
        with self._changed:
            if self._superseded_by is not None:
                return None
            if not self._may_send:
                return _MATCH_POLL_S
            at = self._window.wake_at()
        return None if at is None else max(0.0, at - time.monotonic())

    def _finds_service(self) -> bool:
        """A put before the subscriber is known is dropped on the way: so wait for it, but not for
        ever, since what is dropped is sent again."""
        try:
            found = has_subscriber(self._publisher)
        except zenoh.ZError:
            found = False
        return found or time.monotonic() >= self._match_deadline

    def _ask_first(self) -> None:
        """Asks for the watermark before anything is sent, and waits for the answer, though not for
        long: a robot may start before its service. If the service has samples of this session already,
        another run uses its number, and after the first put nobody could tell whose they are."""
        answered = threading.Event()
        self._ask_watermark(answered)
        answered.wait(_FIRST_ANSWER_S)
        self._receive()
        with self._changed:
            self._may_send = True
            self._changed.notify_all()

    def _pump(self) -> None:
        """Sends what is due."""
        with self._publishing:
            while True:
                with self._changed:
                    if self._superseded_by is not None or self._stopped:
                        return
                    outgoing = self._window.take(time.monotonic())
                if outgoing is None:
                    return
                try:
                    self._publisher.put(
                        encode_batch(self.session_id, outgoing.first_seq, outgoing.samples)
                    )
                except zenoh.ZError as error:
                    # The samples stay in the window; silence brings them back.
                    _log.warning("put of %s: %s", self.agent, error)
                    return

    def _ask_watermark(self, ended: threading.Event) -> None:
        """Asks for the watermark; `ended` is set when no further answer comes."""
        try:
            key, hear = query_key(self.space, "watermark"), self._watermarks_in.hear_reply
            ask(self._zenoh, key, WatermarkQuery(self.agent), hear, ended.set)
        except zenoh.ZError as error:
            _log.warning("watermark query of %s: %s", self.agent, error)

    def _receive(self) -> None:
        # Estimates first, and of the watermarks only those that are here by now: when a flush returns, the estimate
        # published before is in place. What comes meanwhile wakes this thread again.
        watermarks = len(self._watermarks_in)
        with self._changed:
            callbacks = list(self._on_estimate)
        while self._estimates_in:
            if len(self._estimates_in) > 1 and not callbacks:
                # Nobody asked for each one, and only the latest is kept: spare the decoding.
                self._estimates_in.drop()
                continue
            estimate = self._estimates_in.take()
            if estimate is not None and estimate.session == self.session_id:
                with self._changed:
                    self._estimate = estimate
                    self._changed.notify_all()
                call_each(callbacks, estimate)
        for _ in range(min(watermarks, len(self._watermarks_in))):
            watermark = self._watermarks_in.take()
            if watermark is not None:
                self._take_watermark(watermark)

    def _take_watermark(self, watermark: Watermark) -> None:
        if watermark.session < self.session_id:
            # An earlier run of this agent; ours has not arrived yet.
            return
        with self._changed:
            # The service cannot have applied what this run never sent: that is of another run with our
            # number. `applied` moves before `durable`, so it tells first.
            foreign = max(watermark.applied, watermark.durable) > self._window.sent
            if watermark.session > self.session_id or foreign:
                self._superseded_by = max(watermark.session, self._superseded_by or 0)
                self._changed.notify_all()
            if self._superseded_by is not None:
                # Two runs may share the number, so nobody knows which of them this is about.
                return
            gap = None if watermark.gap is None else (watermark.gap.start, watermark.gap.stop)
            self._window.acknowledge(watermark.durable, watermark.applied, gap, time.monotonic())
            if self._watermark is None or watermark.durable >= self._watermark.durable:
                self._watermark = watermark
            fresh = [entry for entry in watermark.rejected if entry not in self._rejections]
            for entry in fresh:
                self._rejections[entry] = None
            while len(self._rejections) > _REJECTIONS_MAX:
                del self._rejections[next(iter(self._rejections))]
            callbacks = list(self._on_rejection)
            self._changed.notify_all()
        for entry in fresh:
            _log.warning(
                "%s: samples %d to %d refused: %s",
                self.agent,
                entry.range.start,
                entry.range.stop - 1,
                entry.reason.value,
            )
            call_each(callbacks, entry)
