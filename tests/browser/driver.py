"""Agents that the tests drive, over HTTP: each call returns when its samples are on disk."""

from __future__ import annotations

import math
import threading
from types import TracebackType
from typing import List, Optional, Type

import cogmap

from server import Server

#: The first stamp: its last digits are lost where a stamp is taken for a double.
START_NS = 1_795_264_924_668_453_163
_STEP_NS = 50_000_000
_EXACT = cogmap.MotionNoise((1e-4,) * 3, (1e-5,) * 3)


class Driver:
    """An agent that drives in circles, a level and a sighting now and then. It is told that it starts
    at `x`; without that it does not know where it is, and sees a lamp that nobody else sees."""

    def __init__(
        self, service: Server, agent: str, space: str = "default", x: Optional[float] = 0.0
    ) -> None:
        self.agent = agent
        self._service = service
        self._space = space
        self._seq = 0
        self._lamp = "lamp" if x is not None else f"lamp of {agent}"
        if x is not None:
            self._send([cogmap.Sample(START_NS, cogmap.StartPose((x, 0.0, 0.5)))])

    @property
    def stamp_ns(self) -> int:
        """Stamp of the latest sample."""
        return START_NS + (self._seq - 1) * _STEP_NS

    def drive(self, steps: int) -> None:
        """Goes on by some steps of ten centimetres."""
        samples: List[cogmap.Sample] = []
        for step in range(self._seq, self._seq + steps):
            body: cogmap.SampleBody
            if step % 10 == 5:
                body = cogmap.Level("light", math.sin(step / 30))
            elif step % 10 == 9:
                body = cogmap.Sighting(cogmap.LandmarkTarget(self._lamp),
                                       cogmap.RangeBearing(2.0, 0.3, 0.1, 0.02))
            else:
                turn = cogmap.quaternion_from_yaw(0.05)
                body = cogmap.Increment((0.1, 0.0, 0.01), turn, _EXACT)
            samples.append(cogmap.Sample(START_NS + step * _STEP_NS, body))
        self._send(samples)

    def end(self) -> None:
        """Ends the session."""
        stamp_ns = START_NS + self._seq * _STEP_NS
        self._send([cogmap.Sample(stamp_ns, cogmap.SessionEnd())])

    def _send(self, samples: List[cogmap.Sample]) -> None:
        batch = cogmap.SampleBatch(1, self._seq, tuple(samples))
        self._service.client().post_samples(self._space, self.agent, batch)
        self._seq += len(samples)


class Driving:
    """Lets a driver go on, in a thread, until the block ends."""

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._go)

    def __enter__(self) -> Driving:
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

    def _go(self) -> None:
        while not self._stop.wait(0.1):
            self._driver.drive(2)
