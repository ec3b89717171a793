"""A robot on a wide circle: samples that depend on their numbers alone, and the maps of them."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Dict, Iterable, Mapping

import cogmap

from server import Server

AGENT = "ada"
SESSION = 1
#: Samples of a message.
BATCH = 10
#: Time between samples [ns].
_STEP_NS = 10_000_000
#: Samples of a message where nothing disturbs.
_LONG_BATCH = 1000


def batch(first: int, count: int = BATCH) -> cogmap.SampleBatch:
    """Samples of the robot from one number on."""
    forward, about = (0.5, 0.0, 0.0), (0.0, 0.0, 0.1)
    samples = tuple(
        cogmap.Sample(seq * _STEP_NS, cogmap.Velocity(forward, about, _STEP_NS * 1e-9))
        for seq in range(first, first + count)
    )
    return cogmap.SampleBatch(SESSION, first, samples)


def undisturbed(home: Path, samples: Mapping[str, int]) -> Dict[str, str]:
    """The digests of spaces, each with so many samples of the robot, on an embedded store to which
    nothing happens."""

    def batches(count: int) -> Iterable[cogmap.SampleBatch]:
        for first in range(0, count, _LONG_BATCH):
            yield batch(first, min(_LONG_BATCH, count - first))

    return undisturbed_by(home, {space: batches(count) for space, count in samples.items()})


def undisturbed_by(home: Path, sent: Mapping[str, Iterable[cogmap.SampleBatch]]) -> Dict[str, str]:
    """The same of other samples."""
    server = Server(Path(tempfile.mkdtemp(prefix="undisturbed-", dir=home)))
    server.start()
    digests: Dict[str, str] = {}
    try:
        client = server.client()
        for space, batches in sent.items():
            client.create_space(space)
            for each in batches:
                client.post_samples(space, AGENT, each)
            digests[space] = client.space(space).digest
    finally:
        server.close()
    return digests
