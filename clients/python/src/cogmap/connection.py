"""What a robot has declared in a Zenoh session, and what it says and asks there."""

from __future__ import annotations

from typing import Any, Callable, List

import zenoh

from .errors import Unreachable
from .key import durable_key, estimate_key, query_key, samples_key
from .link import reason
from .query import WatermarkQuery
from .wire import CBOR, JSON, encode

#: How long a query may take [s].
_QUERY_TIMEOUT_S = 2.0

_Hear = Callable[[Any], None]


class Connection:
    """The publisher, the subscribers and the questions of one agent.

    Callbacks run on the threads that read the network, so they may only put things into queues.
    Zenoh's default, a Python thread for each callback that is no daemon, would keep the program
    from ending.

    Args:
        session: The Zenoh session.
        owns_session: Whether `close` closes the session too.
        address: Where the session leads, for messages.
        run_number: Number of the run, with which the service is asked whether it may begin.
    """

    def __init__(
        self,
        session: zenoh.Session,
        owns_session: bool,
        address: str,
        space: str,
        agent: str,
        run_number: int,
        *,
        hear_estimate: _Hear,
        hear_watermark: _Hear,
        hear_problem: _Hear,
        hear_matching: Callable[[bool], None],
    ) -> None:
        self.address = address
        self._session = session
        self._owns_session = owns_session
        self._agent = agent
        self._query_key = query_key(space, "watermark")
        self._selector = f"{self._query_key}?session={run_number}"
        self._samples_key = samples_key(space, agent)
        self._hear_watermark = hear_watermark
        self._hear_problem = hear_problem
        self._undeclare: List[Callable[[], object]] = []
        try:
            for key, hear in (
                (estimate_key(space, agent), hear_estimate),
                (durable_key(space, agent), hear_watermark),
            ):
                subscriber = session.declare_subscriber(key, _direct(hear))
                self._undeclare.append(subscriber.undeclare)
            self._publisher = session.declare_publisher(
                self._samples_key,
                encoding=CBOR,
                congestion_control=zenoh.CongestionControl.BLOCK,
                express=False,
            )
            self._undeclare.append(self._publisher.undeclare)
            listener = self._publisher.declare_matching_listener(
                _direct(lambda status: hear_matching(_is_matching(status)))
            )
            self._undeclare.append(listener.undeclare)
        except zenoh.ZError as error:
            self.close()
            raise Unreachable(f"{self._samples_key} at {address}: {reason(error)}") from None

    @property
    def where_asked(self) -> str:
        """The key of the watermark's query and the address, for messages."""
        return f"{self._query_key} at {self.address}"

    def is_heard(self) -> bool:
        """Whether anybody subscribes to the samples."""
        try:
            return _is_matching(self._publisher.matching_status)
        except zenoh.ZError:
            return False

    def silence(self) -> str:
        """Why nothing may come back, to be added to a message; empty if the service is there."""
        if self.is_heard():
            return ""
        return f": no service listens to {self._samples_key} at {self.address}"

    def put(self, batch: bytes) -> None:
        """Publishes a batch. It may block for seconds on a congested network.

        Raises `Unreachable` when the session is closed.
        """
        try:
            self._publisher.put(batch)
        except zenoh.ZError as error:
            raise Unreachable(f"{self._samples_key} at {self.address}: {reason(error)}") from None

    def ask_watermark(self, ended: Callable[[], None]) -> None:
        """Asks for the agent's watermark without waiting; `ended` is called when no more answers
        come.

        Raises `Unreachable` when the session is closed.
        """

        def hear(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._hear_watermark(reply.ok)
            elif reply.err is not None and str(reply.err.encoding) in (CBOR, JSON):
                # Zenoh itself says by other errors that no answer came.
                self._hear_problem(reply.err)

        try:
            self._session.get(
                self._selector,
                zenoh.handlers.Callback(hear, ended, indirect=False),
                payload=encode(WatermarkQuery(self._agent)),
                encoding=CBOR,
                timeout=_QUERY_TIMEOUT_S,
            )
        except zenoh.ZError as error:
            raise Unreachable(f"{self.where_asked}: {reason(error)}") from None

    def close(self) -> None:
        """Undeclares everything, and closes the session if it is the connection's own. It may hang
        on a dead network: the caller gives it a thread that nobody has to wait for."""
        steps = list(self._undeclare)
        if self._owns_session:
            steps.append(self._session.close)
        for step in steps:
            try:
                step()
            except zenoh.ZError:
                # The session is gone already, which is what the step was for.
                continue


def _direct(hear: _Hear) -> Any:
    """A callback that runs on the thread that reads the network."""
    return zenoh.handlers.Callback(hear, indirect=False)


def _is_matching(status: object) -> bool:
    # The type stubs of zenoh 1.10 say bool; what comes is an object, and that is always true.
    return bool(getattr(status, "matching", status))
