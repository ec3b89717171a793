"""A stand-in for the service, with a Zenoh router of its own on a loopback port.

It does what a client can see of the real one: puts samples in order, publishes watermarks and
estimates, answers watermark queries. Tests tell it what to lose.
"""

from __future__ import annotations

import json
import queue
import socket
import threading
from types import TracebackType
from typing import Callable, Dict, List, Optional, Tuple, Type

import zenoh

from cogmap import Estimate, Rejection, Sample, SampleBatch, SeqRange, Status, Watermark
from cogmap.problem import Problem
from cogmap.wire import CBOR, decode, encode


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


class StandIn:
    """The service for one agent in the space `lab`."""

    def __init__(self, port: Optional[int] = None, agent: str = "ada") -> None:
        self.agent = agent
        self.port = free_port() if port is None else port
        self.endpoint = f"tcp/127.0.0.1:{self.port}"
        #: The samples on disk.
        self.journal: List[Sample] = []
        #: Every batch that arrived, lost ones included.
        self.batches: List[SampleBatch] = []
        #: Encodings of the messages that arrived.
        self.encodings: List[str] = []
        self.session = 0
        #: Its number as the owner of the space.
        self.term = 0
        self.rejected: Tuple[Rejection, ...] = ()
        #: Says whether the batch of this number is lost on arrival.
        self.loses: Callable[[int], bool] = lambda number: False
        self.publishes_watermarks = True
        self.answers_queries = True
        #: Whether a query is held, without an answer and without an end.
        self.delays_queries = False
        self._held: List[zenoh.Query] = []
        self.queries = 0
        #: What queries are refused by.
        self.problem: Optional[Problem] = None
        self._waiting: Dict[int, Sample] = {}
        self._arrived: queue.Queue[Optional[Tuple[str, bytes]]] = queue.Queue()
        config = zenoh.Config()
        config.insert_json5("mode", '"router"')
        config.insert_json5("listen/endpoints", json.dumps([self.endpoint]))
        config.insert_json5("connect/endpoints", "[]")
        config.insert_json5("scouting/multicast/enabled", "false")
        self._zenoh = zenoh.open(config)
        self._worker = threading.Thread(target=self._work, daemon=True)
        self._entities: List[object] = []

    def listen(self) -> None:
        """Begins to take samples and queries."""
        self._worker.start()
        self._entities = [
            self._zenoh.declare_subscriber(
                f"cogmap/lab/{self.agent}/samples",
                lambda message: self._arrived.put(
                    (str(message.encoding), message.payload.to_bytes())
                ),
            ),
            self._zenoh.declare_queryable("cogmap/*/query/watermark", self._answer),
        ]

    def watermark(self) -> Watermark:
        durable = len(self.journal)
        gap = SeqRange(durable, min(self._waiting)) if self._waiting else None
        return Watermark(self.session, durable, durable, gap, self.rejected, self.term)

    def publish(self, watermark: Watermark) -> None:
        self._zenoh.put(f"cogmap/lab/{self.agent}/durable", encode(watermark), encoding=CBOR)

    def publish_estimate(self, estimate: Estimate) -> None:
        self._zenoh.put(f"cogmap/lab/{self.agent}/estimate", encode(estimate), encoding=CBOR)

    def publish_bytes(self, data: bytes, encoding: str) -> None:
        """Something that is not a watermark where watermarks are expected."""
        self._zenoh.put(f"cogmap/lab/{self.agent}/durable", data, encoding=encoding)

    def close(self) -> None:
        self._arrived.put(None)
        if self._worker.is_alive():
            self._worker.join(10)
        self._zenoh.close()  # type: ignore[no-untyped-call]

    def __enter__(self) -> StandIn:
        self.listen()
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        self.close()

    def _work(self) -> None:
        while True:
            arrived = self._arrived.get()
            if arrived is None:
                return
            encoding, data = arrived
            batch = decode(SampleBatch, data, encoding)
            self.encodings.append(encoding)
            self.batches.append(batch)
            if not self.loses(len(self.batches) - 1):
                self._take(batch)

    def _take(self, batch: SampleBatch) -> None:
        if batch.session > self.session:
            self.session = batch.session
            self.journal, self._waiting = [], {}
        for seq, sample in enumerate(batch.samples, batch.first_seq):
            if seq >= len(self.journal):
                self._waiting[seq] = sample
        while len(self.journal) in self._waiting:
            self.journal.append(self._waiting.pop(len(self.journal)))
        if self.journal:
            self.publish_estimate(self.estimate())
        if self.publishes_watermarks:
            self.publish(self.watermark())

    def estimate(self) -> Estimate:
        latest = self.journal[-1]
        return Estimate(
            space="lab",
            agent=self.agent,
            session=self.session,
            seq=len(self.journal) - 1,
            stamp_ns=latest.stamp_ns,
            frame="map",
            map_revision=len(self.journal),
            status=Status.LOCALIZED,
            translation_m=(1.0, 2.0, 0.0),
            rotation_xyzw=(0.0, 0.0, 0.0, 1.0),
            covariance=(0.0,) * 21,
            term=self.term,
        )

    def _answer(self, query: zenoh.Query) -> None:
        if self.delays_queries:
            self.queries += 1
            self._held.append(query)
            return
        with query:
            self.queries += 1
            if str(query.key_expr) != "cogmap/lab/query/watermark" or self.problem is not None:
                problem = self.problem or Problem(
                    "/problems/unknown-space", "unknown space", 404, "no such space"
                )
                query.reply_err(encode(problem), encoding=CBOR)
            elif self.answers_queries:
                query.reply("cogmap/lab/query/watermark", encode(self.watermark()), encoding=CBOR)
