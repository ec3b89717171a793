"""A robot that keeps sending while things happen to the service, and what has to come of it."""

from __future__ import annotations

import itertools
import json
import random
import threading
from dataclasses import dataclass
from types import TracebackType
from typing import Dict, Iterator, List, Optional, Tuple, Type

import cogmap

from server import Server
from wait import LONG_S, eventually

#: Samples in one call of the client.
_CALL_SAMPLES = 25
_START_NS = 1_700_000_000_000_000_000
_STEP_NS = 20_000_000


def drive(seed: int) -> Iterator[cogmap.Sample]:
    """An endless drive: a start pose, then motion with now and then a sighting or a level."""
    chance = random.Random(seed)
    yield cogmap.Sample(_START_NS, cogmap.StartPose((0, 0, 0)))
    for step in itertools.count(1):
        body: cogmap.SampleBody
        if step % 40 == 0:
            body = cogmap.Level("light", chance.random())
        elif step % 25 == 0:
            target = cogmap.LandmarkTarget(f"post {chance.randrange(8)}")
            body = cogmap.Sighting(target, cogmap.RangeBearing(2.0, chance.random(), 0.1, 0.02))
        else:
            linear, angular = (0.5, 0.0, 0.0), (0.0, 0.0, chance.uniform(-0.5, 1.0))
            body = cogmap.Velocity(linear, angular, _STEP_NS * 1e-9)
        yield cogmap.Sample(_START_NS + step * _STEP_NS, body)


class Feeder:
    """A thread that sends a drive until it is told to finish. The robot's window sets its pace."""

    def __init__(self, robot: cogmap.Robot, seed: int) -> None:
        self.robot = robot
        self._samples = drive(seed)
        self._sent: List[cogmap.Sample] = []
        self._error: Optional[cogmap.CogmapError] = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._feed)

    def __enter__(self) -> Feeder:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        self._stop.set()
        self._thread.join()
        self.robot.__exit__(kind, error, trace)

    def _feed(self) -> None:
        try:
            while not self._stop.is_set():
                samples = list(itertools.islice(self._samples, _CALL_SAMPLES))
                self.robot.send(samples)
                self._sent.extend(samples)
        except cogmap.CogmapError as error:
            self._error = error

    @property
    def told(self) -> int:
        """The number below which the client has been told that everything is on disk."""
        mark = self.robot.watermark
        return 0 if mark is None else mark.durable

    def await_told(self, durable: int) -> None:
        """Waits until the client has been told so of everything below `durable`."""

        def reached() -> bool:
            assert self._error is None, repr(self._error)
            return self.told >= durable

        eventually(f"{durable} durable samples", reached)

    def finish(self) -> List[cogmap.Sample]:
        """Stops sending, waits until all is durable, and returns what was sent."""
        self._stop.set()
        self._thread.join()
        assert self._error is None, repr(self._error)
        self.robot.flush(LONG_S)
        return self._sent


@dataclass(frozen=True)
class Outcome:
    """What became of the samples of the only agent of the space `default`."""

    digest: str
    map_revision: int
    poses: Tuple[cogmap.StampedPose, ...]

    @classmethod
    def read(cls, server: Server, agent: str) -> Outcome:
        """Reads it from a service."""
        info = server.client().space("default")
        poses = server.client().trajectory("default", agent).poses
        return cls(info.digest, info.map_revision, poses)

    @classmethod
    def undisturbed(
        cls, calm: Server, agent: str, session: int, samples: List[cogmap.Sample]
    ) -> Outcome:
        """That of a service to which nothing happens, sent the samples over HTTP."""
        for first in range(0, len(samples), 1000):
            batch = cogmap.SampleBatch(session, first, tuple(samples[first : first + 1000]))
            calm.client().post_samples("default", agent, batch)
        return cls.read(calm, agent)


def journaled(server: Server) -> Dict[Tuple[str, int], List[Tuple[int, int]]]:
    """Sequence number and stamp of each sample in a journal, in its order, by agent and session."""
    names: Dict[int, str] = {}
    found: Dict[Tuple[str, int], List[Tuple[int, int]]] = {}
    for line in server.journal():
        (kind, entry), = json.loads(line).items()
        if kind == "Enrol":
            names[entry["agent"]] = entry["name"]
            continue
        assert kind == "Samples", line
        batch = entry["batch"]
        samples = found.setdefault((names[entry["agent"]], batch["session"]), [])
        for seq, sample in enumerate(batch["samples"], batch["first_seq"]):
            samples.append((seq, sample["stamp_ns"]))
    return found


def numbered(samples: List[cogmap.Sample]) -> List[Tuple[int, int]]:
    """The same for samples that were sent: each number once, in order."""
    return [(seq, sample.stamp_ns) for seq, sample in enumerate(samples)]
