"""A robot: samples out, estimates and watermarks in."""

from __future__ import annotations

import logging
import time
import warnings
import weakref
from types import TracebackType
from typing import Callable, Iterable, Optional, Tuple, Type, Union

import zenoh

from .answer import Rejection, Watermark
from .credentials import Credentials
from .errors import ClockWarning, CogmapError, InvalidValue, Timeout
from .estimate import Estimate
from .key import check_name
from .link import DEFAULT_ENDPOINT, endpoints_of, open_session
from .listeners import Listeners
from .run import DROPPED_FLUSH_S, Run
from .sample import MotionNoise, Sample, SampleBody
from .sampler import Sampler
from .scalar import COUNT_RANGE, STAMP_RANGE, one_of, seconds, whole
from .window import WindowLimits

_log = logging.getLogger("cogmap")

#: How long `close` waits for the robot's thread to leave Zenoh [s].
_LEAVE_S = 1.0
#: How long an error in a `with` block waits for the acknowledgement of what was sent, and for the
#: thread [s].
_ERROR_FLUSH_S = 1.0
_ERROR_LEAVE_S = 0.5


class Robot(Sampler):
    """One run of an agent in a space.

    Methods may be called from any thread. A sample method returns the sample's sequence number as
    soon as the sample is in the window; `flush` returns when the service has everything on disk.
    What no watermark covers is held and sent again after a loss, a reconnect or a restart of the
    service. When the window is full a sample method waits, up to `send_timeout_s`.

    A robot that is not closed does not keep its program from ending: what was sent is flushed for
    at most a second then. One that is dropped flushes in the background.

    Args:
        space: Name of the space.
        agent: Name of the agent.
        connect: Zenoh endpoint, or several of them to try; `tcp/127.0.0.1:7447` when absent.
        session: An open Zenoh session to use instead; it is left open by `close`.
        credentials: User, password and certificates for the router; none when absent.
        session_id: Number of this run; it must be larger than those of earlier runs. The time of
            the start [ns] when absent.
        batch_samples: Most samples of one message, 1 to 4096.
        batch_delay_s: Longest time that a sample waits for others [s].
        window_samples: Most samples without acknowledgement.
        window_bytes: The same in bytes.
        motion_noise: Noise of motion samples that carry none; the space's own when absent.
        send_timeout_s: How long a sample method waits for room before `WindowFull` [s].
        connect_timeout_s: How long to wait for the router [s].
        match_timeout_s: How long samples wait for the service before they are sent anyway [s].
        ends_session: Whether the robot's end also ends the session, and the trip under way, by a
            last sample. Without it they end when the agent's next session begins.

    Raises:
        InvalidValue: A name or another argument makes no sense, or `connect` or `credentials` are
            given with `session`.
        Timeout: No Zenoh router answers within `connect_timeout_s`, or none accepts the
            credentials.
        ApiError: The service has no such space.
        Unreachable: The given Zenoh session is closed.
    """

    def __init__(
        self,
        space: str,
        agent: str,
        *,
        connect: Union[None, str, Iterable[str]] = None,
        session: Optional[zenoh.Session] = None,
        credentials: Optional[Credentials] = None,
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
        if session is not None and connect is not None:
            raise InvalidValue("connect", connect, "expected either connect or session", "both")
        if session is not None and credentials is not None:
            expected = "expected none with a session, which has its own"
            raise InvalidValue("credentials", credentials, expected)
        if session is not None:
            one_of("session", session, (zenoh.Session,))
        if motion_noise is not None:
            one_of("motion_noise", motion_noise, (MotionNoise,))
        check_name("space", space)
        check_name("agent", agent)
        number = (
            time.time_ns() if session_id is None else whole("session_id", session_id, COUNT_RANGE)
        )
        limits = WindowLimits(
            capacity_samples=window_samples,
            capacity_bytes=window_bytes,
            batch_samples=batch_samples,
            batch_delay_s=batch_delay_s,
        )
        super().__init__(motion_noise)
        self._send_timeout_s = seconds("send_timeout_s", send_timeout_s)
        match_timeout_s = seconds("match_timeout_s", match_timeout_s)
        if session is None:
            endpoints = endpoints_of(DEFAULT_ENDPOINT if connect is None else connect)
            link = open_session(
                endpoints, credentials=credentials, timeout_s=connect_timeout_s
            )
            address = ", ".join(endpoints)
        else:
            link, address = session, "the given Zenoh session"
        self._listeners = Listeners()
        self._run = Run(
            space,
            agent,
            number,
            limits,
            link,
            owns_session=session is None,
            address=address,
            match_timeout_s=match_timeout_s,
            ends_session=ends_session,
            listeners=self._listeners,
        )
        self._run.start()
        # The run at the end of the program is ended elsewhere, within a bound.
        weakref.finalize(self, self._run.stop, DROPPED_FLUSH_S).atexit = False

    def __repr__(self) -> str:
        run = self._run
        state = "closed" if run.closing else f"{self.pending} samples pending"
        return (
            f"<Robot {run.agent} of {run.space} at {run.connection.address}, "
            f"session {run.session_id}, {state}>"
        )

    @property
    def space(self) -> str:
        """Name of the space."""
        return self._run.space

    @property
    def agent(self) -> str:
        """Name of the agent."""
        return self._run.agent

    @property
    def session_id(self) -> int:
        """Number of this run."""
        return self._run.session_id

    # Samples beyond the methods of `Sampler`

    def send(self, samples: Iterable[Sample]) -> range:
        """Samples made beforehand, in order. Returns their sequence numbers.

        Raises `WindowFull` like every sample method; its `accepted` says how many were taken.
        """
        first: Optional[int] = None
        accepted = 0
        deadline = time.monotonic() + self._send_timeout_s
        if not isinstance(samples, Iterable):
            raise InvalidValue("samples", samples, "expected several Sample")
        for index, sample in enumerate(samples):
            one_of(f"samples[{index}]", sample, (Sample,))
            self._warn_of_clocks(sample.body, sample.stamp_ns, stacklevel=3)
            seq = self._run.append(sample.body, sample.stamp_ns, deadline, accepted)
            first = seq if first is None else first
            accepted += 1
        if first is None:
            with self._run.changed:
                return range(self._run.window.next_seq, self._run.window.next_seq)
        return range(first, first + accepted)

    def _send(self, body: SampleBody, stamp_ns: Optional[int]) -> int:
        if stamp_ns is not None:
            stamp_ns = whole("stamp_ns", stamp_ns, STAMP_RANGE)
        self._warn_of_clocks(body, stamp_ns, stacklevel=4)
        return self._run.append(body, stamp_ns, time.monotonic() + self._send_timeout_s, 0)

    def _warn_of_clocks(self, body: SampleBody, stamp_ns: Optional[int], stacklevel: int) -> None:
        oddity = self._run.clock.oddity(body, stamp_ns, time.time_ns())
        if oddity is not None:
            warnings.warn(f"robot {self.agent}: {oddity}", ClockWarning, stacklevel=stacklevel)

    # Acknowledgement

    def flush(self, timeout_s: float = 10.0) -> None:
        """Blocks until every sample sent so far is on the service's disk.

        Raises `Timeout` when it takes longer; the samples stay in the window and are sent again.
        """
        timeout_s = seconds("timeout_s", timeout_s)
        with self._run.changed:
            self._run.check_open()
        missing = self._run.wait_durable(timeout_s)
        if missing:
            raise Timeout(
                f"{missing} samples of agent {self.agent} are not durable after {timeout_s:g} s"
                f"{self._run.silence()}"
            )

    @property
    def watermark(self) -> Optional[Watermark]:
        """The latest watermark of this session; `None` before the first one."""
        with self._run.changed:
            return self._run.watermark

    @property
    def pending(self) -> int:
        """Samples without acknowledgement."""
        with self._run.changed:
            return self._run.window.pending

    @property
    def rejections(self) -> Tuple[Rejection, ...]:
        """Ranges of this session's samples that the service refused for good, by number; neighbours
        that were refused for the same reason are one range."""
        with self._run.changed:
            return self._run.rejections.ranges

    def on_rejection(self, callback: Callable[[Rejection], object]) -> None:
        """Calls `callback` for refused ranges, on the robot's own thread: once for each sample,
        together with its neighbours, when no more has been refused for a quarter of a second, or
        after a second."""
        self._listeners.rejections.append(callback)

    # Estimates

    def estimate(self, timeout_s: float = 10.0, *, seq: Optional[int] = None) -> Estimate:
        """The latest estimate of this session; waits for the first one, then raises `Timeout`.

        The first one comes of the first sample: before that the wait is for another thread to send
        it.

        Args:
            timeout_s: Longest wait [s].
            seq: Waits for an estimate that includes this sample: the number that the sample's
                method returned. The estimate may include later samples too, as its own `seq` says.
        """
        timeout_s = seconds("timeout_s", timeout_s)
        if seq is not None:
            with self._run.changed:
                latest = self._run.window.next_seq - 1
            if latest < 0:
                raise InvalidValue("seq", seq, "expected a sample that was sent, and there is none")
            whole("seq", seq, (0, latest))
        with self._run.changed:
            self._run.check_open()
        return self._run.wait_estimate(seq, timeout_s)

    def on_estimate(self, callback: Callable[[Estimate], object]) -> None:
        """Calls `callback` with every estimate, on the robot's own thread; it should return
        soon."""
        self._listeners.estimates.append(callback)

    # Life

    def wait_for_service(self, timeout_s: float = 10.0) -> bool:
        """Waits until the service listens to this robot's samples; says whether it does."""
        return self._run.wait_heard(seconds("timeout_s", timeout_s))

    def close(self, timeout_s: float = 5.0) -> None:
        """Ends the session and the trip under way, flushes for at most `timeout_s`, then closes,
        also when that fails; a second call does nothing.

        Raises `Timeout` when samples are left without acknowledgement: they are lost with this
        process unless they arrived all the same.
        """
        self._close(seconds("timeout_s", timeout_s), _LEAVE_S)

    def _close(self, timeout_s: float, leave_s: float) -> None:
        run = self._run
        with run.changed:
            if run.closing:
                return
            run.end_session()
            run.closing = True
            run.changed.notify_all()
        missing, silence = 0, ""
        try:
            if not run.is_own_thread() and not run.superseded_told:
                missing = run.wait_durable(timeout_s)
                silence = run.silence()
        finally:
            run.stop(0.0)
            if not run.join(leave_s):
                _log.debug("%s: Zenoh is still closing in the background", self.agent)
        if missing:
            raise Timeout(
                f"closed with {missing} samples of agent {self.agent} that are not durable"
                f"{silence}"
            )

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
            self._close(_ERROR_FLUSH_S, _ERROR_LEAVE_S)
        except CogmapError as second:
            # The first error is the one that the caller has to see.
            _log.warning("closing after an error: %s", second)
