"""One run of an agent: its samples on their way out, what comes back, and the thread that does
both.

A `Robot` owns its run, and not the other way round: the thread knows the robot's callbacks by a
weak reference only. So a robot that a program drops is finalised, and its run ends after what was
sent is flushed. At the end of the program all runs are ended in the same way, within a bound.
"""

from __future__ import annotations

import logging
import threading
import time
from typing import Callable, Optional

import zenoh

from . import bounds
from .answer import SeqRange, Watermark
from .clock import SessionClock
from .connection import Connection
from .ending import begins, has_ended
from .errors import (
    CalledFromCallback,
    Closed,
    SessionSuperseded,
    Timeout,
    Unreachable,
    WindowFull,
)
from .estimate import Estimate
from .fork import zenoh_begins
from .incoming import Incoming, is_news
from .listeners import Listeners, WeakListeners
from .problem import Problem
from .rejection import Rejections, sentences
from .sample import Sample, SampleBody, SessionEnd
from .wake import Wake
from .window import Window, WindowLimits
from .wire import encode_batch, encode_sample

_log = logging.getLogger("cogmap")

#: How long a dropped robot's samples are flushed in the background [s].
DROPPED_FLUSH_S = 10.0


class Run:
    """One run of an agent, with a thread of its own from `start` on.

    Args:
        owns_session: Whether the Zenoh session is closed with the run.
        address: Where the Zenoh session leads, for messages.
        match_timeout_s: How long samples wait for the service before they are sent anyway [s].
        ends_session: Whether the run ends its session by a last sample.
    """

    def __init__(
        self,
        space: str,
        agent: str,
        session_id: int,
        limits: WindowLimits,
        zenoh_session: zenoh.Session,
        *,
        owns_session: bool,
        address: str,
        match_timeout_s: float,
        ends_session: bool,
        listeners: Listeners,
    ) -> None:
        zenoh_begins()
        self.space = space
        self.agent = agent
        self.session_id = session_id
        # Guards everything below; notified on each change that somebody may wait for.
        self.changed = threading.Condition()
        self.window = Window(limits)
        self.clock = SessionClock()
        self.rejections = Rejections()
        self.watermark: Optional[Watermark] = None
        self.estimate: Optional[Estimate] = None
        self.closing = False
        # Whether it is the copy of a run in a process that was forked off.
        self._is_behind = False
        self.superseded_told = False
        self._superseded_by: Optional[int] = None
        # What the service lacks, by its latest watermark.
        self._gap: Optional[SeqRange] = None
        self._problem: Optional[Problem] = None
        self._ask_again_at = 0.0
        # What Zenoh says of its session once that is closed.
        self._broken: Optional[str] = None
        self._listeners = WeakListeners(listeners)
        # When the thread ends at the latest, once it has been asked to.
        self._stop_at: Optional[float] = None
        self._is_known = False
        # Whether the service was away since the last put, and whether it has come back.
        self._was_away = False
        self._is_back = False
        self._may_send = False
        self._ends_session = ends_session
        self._match_deadline = time.monotonic() + match_timeout_s
        # Held while a batch is taken and put, so that batches leave in order.
        self._publishing = threading.Lock()
        self._wake = Wake()
        self._incoming = Incoming(self._wake)
        self.connection = Connection(
            zenoh_session,
            owns_session,
            address,
            space,
            agent,
            session_id,
            hear_estimate=self._incoming.estimates.hear,
            hear_watermark=self._incoming.watermarks.hear,
            hear_problem=self._incoming.problems.hear,
            hear_matching=self._hear_matching,
        )
        self._thread = threading.Thread(
            target=self._work, name=f"cogmap-{space}-{agent}", daemon=True
        )

    def start(self) -> None:
        """Asks the service for the agent's watermark, and starts the thread.

        If the service has samples of this session already, another run uses its number, and after
        the first put nobody could tell whose they are. Without an answer the thread asks again: a
        robot may start before its service.

        Raises `ApiError` when the service knows no such space; the run is closed then.
        """
        self._ask_and_wait(bounds.FIRST_ANSWER_S)
        if self._problem is not None:
            self.connection.close()
            raise self._problem.error(self.connection.where_asked)
        begins(self)
        self._thread.start()

    # For the robot

    def silence(self) -> str:
        """Why nothing may come back, to be added to a message; empty if something has."""
        is_unheard = self.watermark is None
        return self.connection.silence() or bounds.silence(self.window, self._gap, is_unheard)

    def append(
        self, body: SampleBody, stamp_ns: Optional[int], deadline: float, accepted: int
    ) -> int:
        """Takes a sample into the window and returns its number; waits for room until the
        deadline."""
        by_clock = stamp_ns is None
        data = b"" if stamp_ns is None else encode_sample(Sample(stamp_ns, body))
        with self.changed:
            while True:
                self.check_open()
                if by_clock:
                    # Stamped under the lock that numbers it, and again after each wait: a sample of
                    # another thread that gets in between would else have the later stamp and the
                    # earlier number.
                    stamp_ns = self.clock.stamp(time.time_ns())
                    data = encode_sample(Sample(stamp_ns, body))
                if self.window.has_room(len(data)):
                    break
                self.window.hurry()
                self._wake.set()
                remaining = deadline - time.monotonic()
                if remaining <= 0:
                    raise WindowFull(accepted, self.window.pending, self.silence())
                self.changed.wait(remaining)
            now = time.monotonic()
            starts_batch = self.window.sent == self.window.next_seq
            seq = self.window.append(data, now)
            if stamp_ns is not None:
                self.clock.take(seq, stamp_ns)
            due = self.window.ready(now)
        if due and self._may_send and self._publishing.acquire(timeout=bounds.TURN_S):
            # A full batch leaves on the caller's thread, so that what one program sends for several
            # robots leaves in that order.
            try:
                self._send_due()
            finally:
                self._publishing.release()
        elif due or starts_batch:
            self._wake.set()
        return seq

    def end_session(self) -> None:
        """Appends the session's last sample, once, with the condition held: at the stamp of the one
        before, because the robot's clock may be another than this machine's. A full window is left
        as it is."""
        if not self._ends_session or self._is_refused() or not self.window.next_seq:
            return
        self._ends_session = False
        data = encode_sample(Sample(self.clock.latest_ns, SessionEnd()))
        if self.window.has_room(len(data)):
            self.window.append(data, time.monotonic())

    def wait_durable(self, timeout_s: float) -> int:
        """Waits until the watermark covers all samples; returns how many are missing after the
        time."""
        if self.is_own_thread():
            raise CalledFromCallback("a callback cannot wait for watermarks: they come after it")
        with self.changed:
            target = self.window.next_seq
            self.window.hurry()
            self._wake.set()
            self.changed.wait_for(
                lambda: self.window.durable >= target or self._is_refused(), timeout_s
            )
            if self.window.durable < target:
                self.check_usable()
            return max(0, target - self.window.durable)

    def wait_estimate(self, seq: Optional[int], timeout_s: float) -> Estimate:
        """Waits for an estimate, or for one that includes a sample."""
        if self.is_own_thread() and seq is not None:
            raise CalledFromCallback("a callback cannot wait for an estimate: it comes after it")
        with self.changed:
            self.window.hurry()
            self._wake.set()
            self.changed.wait_for(lambda: self._has_estimate(seq) or self._is_refused(), timeout_s)
            if self.estimate is not None and self._has_estimate(seq):
                return self.estimate
            self.check_usable()
            what = "no estimate" if seq is None else f"no estimate of sample {seq}"
            silence = self.silence()
            refused = None if seq is None else self.rejections.reason_of(seq)
            why = f": the sample was refused ({refused.value})" if refused is not None else silence
            raise Timeout(f"{what} of agent {self.agent} within {timeout_s:g} s{why}")

    def _has_estimate(self, seq: Optional[int]) -> bool:
        return self.estimate is not None and (seq is None or self.estimate.seq >= seq)

    def wait_heard(self, timeout_s: float) -> bool:
        """Waits until the service listens to this run's samples; says whether it does."""
        deadline = time.monotonic() + timeout_s
        while not self.connection.is_heard():
            if time.monotonic() >= deadline:
                return False
            time.sleep(bounds.MATCH_POLL_S)
        if self.is_own_thread():
            # Only the thread itself ends the wait below.
            return True
        with self.changed:
            # Full batches leave on the caller's thread only from then on.
            return self.changed.wait_for(
                lambda: self._may_send or self._stop_at is not None,
                max(0.0, deadline - time.monotonic()),
            )

    def check_open(self) -> None:
        """Raises if no sample can be taken in."""
        if self._is_behind:
            raise Closed(
                f"robot {self.agent} of space {self.space} is that of another process, which "
                "forked this one off"
            )
        if self.closing:
            raise Closed(f"robot {self.agent} of space {self.space} is closed")
        self.check_usable()

    def check_usable(self) -> None:
        """Raises if nothing that is sent would be taken."""
        if self._superseded_by is not None:
            self.superseded_told = True
            raise SessionSuperseded(self.agent, self.session_id, self._superseded_by)
        if self._broken is not None:
            raise Unreachable(self._broken)
        if self._problem is not None:
            raise self._problem.error(self.connection.where_asked)

    def _is_refused(self) -> bool:
        return self._is_useless() or self._problem is not None

    # The end

    def stop(self, flush_s: float) -> None:
        """Lets the thread end as soon as everything is acknowledged, at the latest after `flush_s`.
        It waits for nothing and takes no lock: a garbage collection may call it anywhere."""
        at = time.monotonic() + flush_s
        self._stop_at = at if self._stop_at is None else min(at, self._stop_at)
        self._wake.set()

    def stay_behind(self) -> None:
        """This process was forked off: the run goes on in the other one, and is closed here."""
        # Another thread may have held the locks, and is not here to release them.
        self.changed = threading.Condition()
        self._publishing = threading.Lock()
        self.closing = self._is_behind = True

    def join(self, timeout_s: float) -> bool:
        """Waits for the end of the thread; says whether it came."""
        if not self.is_own_thread():
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def is_own_thread(self) -> bool:
        """Whether the caller is the run's own thread, as in a callback."""
        return threading.current_thread() is self._thread

    def _is_over(self) -> bool:
        if self._stop_at is None:
            return False
        with self.changed:
            # Also of a robot that was dropped, or that the program's end has left open.
            self.end_session()
            done = self.window.pending == 0 or self._is_refused()
        return done or time.monotonic() >= self._stop_at

    # The thread

    def _work(self) -> None:
        try:
            while not self._is_over():
                self._wake.wait(self._idle_s())
                self._turn()
        finally:
            self._receive()
            self._tell_rejections(at_once=True)
            if self.window.pending and not self.closing:
                missing, silence = self.window.pending, self.silence()
                _log.warning(
                    "%s: %d samples are lost, not acknowledged%s", self.agent, missing, silence
                )
            with self.changed:
                self.closing = True
                self.changed.notify_all()
            self.connection.close()
            has_ended(self)

    def _turn(self) -> None:
        self._receive()
        self._tell_rejections()
        if not self._may_send:
            # A put before the subscriber is known is dropped on the way: so wait for it, but not
            # for ever, since what is dropped is sent again.
            is_heard = self.connection.is_heard()
            if not is_heard and time.monotonic() < self._match_deadline:
                return
            self._was_away = not is_heard
            if not self._is_known:
                self._ask_and_wait(bounds.SECOND_ANSWER_S)
            with self.changed:
                self._may_send = True
                self.changed.notify_all()
        self._pump()
        with self.changed:
            now = time.monotonic()
            if self._stop_at is not None:
                self.window.hurry()
            ask = not self._is_useless() and self.window.watch(now)
            if self._is_back:
                self._is_back = False
                ask = self.window.rejoin(now) or ask
            if self._problem is not None and now >= self._ask_again_at:
                self._ask_again_at = now + bounds.PROBLEM_S
                ask = True
        if ask:
            _log.debug("no progress of %s: asking for the watermark", self.agent)
            self._ask(lambda: None)
        self._pump()

    def _idle_s(self) -> Optional[float]:
        with self.changed:
            if self._is_useless():
                at = None
            elif not self._may_send:
                return bounds.MATCH_POLL_S
            else:
                at = self.window.wake_at()
            again = None if self._problem is None else self._ask_again_at
            candidates = (at, again, self.rejections.tell_at(), self._stop_at)
            times = [one for one in candidates if one is not None]
        return max(0.0, min(times) - time.monotonic()) if times else None

    def _is_useless(self) -> bool:
        """Whether nothing will ever be acknowledged again."""
        return self._superseded_by is not None or self._broken is not None

    def _break(self, error: Unreachable) -> None:
        with self.changed:
            self._broken = str(error)
            self.changed.notify_all()

    def _hear_matching(self, is_matching: bool) -> None:
        if not is_matching:
            self._was_away = True
        elif self._was_away:
            self._was_away = False
            self._is_back = self._may_send
        self._wake.set()

    def _ask(self, ended: Callable[[], None]) -> None:
        try:
            self.connection.ask_watermark(ended)
        except Unreachable as error:
            self._break(error)
            ended()

    def _ask_and_wait(self, timeout_s: float) -> None:
        answered = threading.Event()
        self._ask(answered.set)
        answered.wait(timeout_s)
        self._receive()

    def _pump(self) -> None:
        """Sends what is due, after what another thread is sending."""
        with self._publishing:
            self._send_due()

    def _send_due(self) -> None:
        while True:
            with self.changed:
                if self._is_useless() or not self._may_send:
                    return
                outgoing = self.window.take(time.monotonic())
            if outgoing is None:
                return
            try:
                self.connection.put(
                    encode_batch(self.session_id, outgoing.first_seq, outgoing.samples)
                )
            except Unreachable as error:
                self._break(error)
                return

    def _receive(self) -> None:
        for told in self._incoming.drain(self._listeners.want_estimates(), self._is_wanted):
            if isinstance(told, Estimate):
                self._take_estimate(told)
            elif isinstance(told, Watermark):
                self._take_watermark(told)
            else:
                self._take_problem(told)

    def _is_wanted(self, estimate: Estimate) -> bool:
        """Whether it is of this run and not before the one that is known, nor that one again, and
        of no owner of the space that has lost it."""
        with self.changed:
            is_outdated = self.window.is_outdated(estimate.term)
            known = self.estimate
        is_later = known is None or is_news(estimate, known)
        return not is_outdated and estimate.session == self.session_id and is_later

    def _take_estimate(self, estimate: Estimate) -> None:
        with self.changed:
            self.estimate = estimate
            self.changed.notify_all()
        self._listeners.hear_estimate(estimate)

    def _take_watermark(self, watermark: Watermark) -> None:
        with self.changed:
            if self.window.is_outdated(watermark.term):
                return
            self._is_known = True
            self._problem = None
            if watermark.session < self.session_id:
                # An earlier run of this agent; ours has not arrived yet.
                return
            # The service cannot have applied what this run never sent: that is of another run with
            # our number. `applied` moves before `durable`, so it tells first.
            foreign = max(watermark.applied, watermark.durable) > self.window.sent
            if watermark.session > self.session_id or foreign:
                self._superseded_by = max(watermark.session, self._superseded_by or 0)
                self.changed.notify_all()
            if self._superseded_by is not None:
                # Two runs may share the number, so nobody knows which of them this is about.
                return
            now = time.monotonic()
            self._gap = watermark.gap
            gap = None if watermark.gap is None else (watermark.gap.start, watermark.gap.stop)
            durable, applied, term = watermark.durable, watermark.applied, watermark.term
            self.window.acknowledge(durable, applied, gap, now, term)
            if self.watermark is None or watermark.durable >= self.watermark.durable:
                self.watermark = watermark
            self.rejections.take(watermark.rejected, now)
            self.changed.notify_all()

    def _take_problem(self, problem: Problem) -> None:
        if not problem.says_unknown_agent and not problem.blames_the_request:
            # It has too much to do, or is about to end: asking again later may help.
            _log.debug("%s: %s", self.connection.where_asked, problem.detail)
            return
        with self.changed:
            self._is_known = True
            self._problem = None if problem.says_unknown_agent else problem
            self.changed.notify_all()

    def _tell_rejections(self, at_once: bool = False) -> None:
        with self.changed:
            told = self.rejections.tell(time.monotonic(), at_once)
            stamps = self.clock.backwards if told else {}
        if not told:
            return
        for sentence in sentences(told, stamps):
            _log.warning("%s: %s", self.agent, sentence)
        for rejection in told:
            self._listeners.hear_rejection(rejection)
