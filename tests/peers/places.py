"""The places and queries of `cogmap-lab bench recall`, as it writes them, and the check that a service founds
the same ones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import List

import cogmap
import numpy as np

from grid import Floats


@dataclass(frozen=True)
class Drawn:
    """Places, and queries beside them."""

    #: Positions of the places [m], in the order of recruitment.
    places: Floats
    #: Positions of the queries [m].
    queries: Floats


def read(directory: Path, size: int) -> Drawn:
    """What `cogmap-lab bench recall --out` wrote at one number of places."""
    return Drawn(*(_positions(directory / f"{name}-{size}.csv") for name in ("places", "queries")))


def _positions(file: Path) -> Floats:
    positions: Floats = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
    return positions


def check(client: cogmap.Client, space: str, drawn: Drawn) -> None:
    """Puts an agent of a new space down at all places, and compares those that it founds.

    Raises:
        RuntimeError: They are not those drawn.
    """
    client.create_space(space)
    still = cogmap.Increment((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    samples: List[cogmap.Sample] = []
    for x, y, z in drawn.places.tolist():
        for body in (cogmap.StartPose((x, y, z)), still):
            samples.append(cogmap.Sample(len(samples), body))
    for first in range(0, len(samples), 2000):
        batch = cogmap.SampleBatch(1, first, tuple(samples[first : first + 2000]))
        client.post_samples(space, "surveyor", batch)
    found = np.array([place.translation_m for place in client.places(space)])
    if found.shape != drawn.places.shape or not np.allclose(found, drawn.places, atol=1e-9):
        raise RuntimeError(
            f"the service founded {len(found)} places where {len(drawn.places)} were drawn, or other "
            "ones: has the rule of recruitment changed?"
        )
