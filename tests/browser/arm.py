"""An arm that learns things by touch, and touches them again."""

from __future__ import annotations

from typing import List, Sequence

import cogmap

from server import Server

_STEP_NS = 20_000_000
_START_NS = 1_795_264_924_000_000_000
_EXACT = cogmap.MotionNoise((1e-5,) * 3, (1e-6,) * 3)
#: What is felt along two things, one level every two centimetres.
FELT = {
    "cup": (3.0, 5.0, 9.0, 2.0, 7.0, 7.0, 1.0, 4.0),
    "can": (3.0, 9.0, 2.0, 5.0, 1.0, 7.0, 4.0, 7.0),
}


class Arm:
    """An arm in the space `default`."""

    def __init__(self, service: Server) -> None:
        self._service = service
        self._seq = 0
        self._send([cogmap.StartPose((1.0, 1.0, 1.0))])

    def learn(self, name: str) -> None:
        """Learns a thing by moving along it."""
        self._send([cogmap.ObjectMark(cogmap.LearnObject(name))])
        self.touch(FELT[name], 0.02)
        self._send([cogmap.ObjectMark(cogmap.EndObject())])

    def identify(self) -> None:
        """Says that what is felt next is to be recognised."""
        self._send([cogmap.ObjectMark(cogmap.IdentifyObject())])

    def touch(self, levels: Sequence[float], step_m: float) -> None:
        """Feels levels, one after each step."""
        for level in levels:
            step = cogmap.Increment((step_m, 0.0, 0.0), noise=_EXACT)
            self._send([cogmap.Level("texture", level), step])

    def _send(self, bodies: List[cogmap.SampleBody]) -> None:
        stamps = (_START_NS + (self._seq + i) * _STEP_NS for i in range(len(bodies)))
        samples = tuple(cogmap.Sample(stamp, body) for stamp, body in zip(stamps, bodies))
        batch = cogmap.SampleBatch(1, self._seq, samples)
        self._service.client().post_samples("default", "arm", batch)
        self._seq += len(bodies)
