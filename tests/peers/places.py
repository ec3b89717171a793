"""The places and queries of `cogmap bench recall`, drawn again from the same random stream
(`service/src/cli/bench/recall.rs`), and the check that a service recruits the same ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import List

import cogmap
import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from grid import Floats

#: Increment and multipliers of SplitMix64.
_GOLDEN = np.uint64(0x9E37_79B9_7F4A_7C15)
_MIX = (np.uint64(0xBF58_476D_1CE4_E5B9), np.uint64(0x94D0_49BB_1331_11EB))


class Stream:
    """The benchmark's random stream (SplitMix64)."""

    def __init__(self, seed: int) -> None:
        self._state = np.uint64(seed)

    def uniform(self, count: int) -> Floats:
        """The next numbers, uniform in [0, 1)."""
        # Unsigned arithmetic wraps, as it has to.
        with np.errstate(over="ignore"):
            bits = self._state + np.arange(1, count + 1, dtype=np.uint64) * _GOLDEN
            self._state = self._state + np.uint64(count) * _GOLDEN
            bits = (bits ^ (bits >> np.uint64(30))) * _MIX[0]
            bits = (bits ^ (bits >> np.uint64(27))) * _MIX[1]
            bits = bits ^ (bits >> np.uint64(31))
        return (bits >> np.uint64(11)).astype(np.float64) / 2.0**53


@dataclass(frozen=True)
class Drawn:
    """Places, and queries beside them."""

    #: Positions at which an agent was put down [m], those between places too.
    candidates: Floats
    #: Positions of the places [m], in the order of recruitment.
    places: Floats
    #: Positions of the queries [m].
    queries: Floats


def draw(
    places: int, queries: int, seed: int, places_per_m3: float, jitter_m: float, radius_m: float
) -> Drawn:
    """Draws places all over a cube, none closer than a field radius to an earlier one, and queries at
    normal distances from them.

    Args:
        places: Number of places.
        queries: Number of queries.
        seed: Seed of the stream.
        places_per_m3: Density of the places.
        jitter_m: Standard deviation of a query's position from a place, along each axis.
        radius_m: Field radius.
    """
    edge_m = (places / places_per_m3) ** (1 / 3)
    count = places + places // 2 + 100
    while True:
        candidates = (Stream(seed).uniform(3 * count).reshape(-1, 3) - 0.5) * edge_m
        recruited = np.flatnonzero(_recruited(candidates, radius_m))
        if len(recruited) >= places:
            break
        count *= 2
    used = int(recruited[places - 1]) + 1
    positions = candidates[recruited[:places]]
    stream = Stream(seed)
    stream.uniform(3 * used)
    numbers = stream.uniform(7 * queries).reshape(-1, 7)
    chosen = positions[(numbers[:, 0] * places).astype(np.int64)]
    # Box & Muller, in the benchmark's order: a radius, then an angle, for each axis.
    radius = np.sqrt(-2 * np.log(1 - numbers[:, 1::2]))
    shift = radius * np.cos(2 * np.pi * numbers[:, 2::2]) * jitter_m
    return Drawn(candidates[:used], positions, chosen + shift)


def _recruited(candidates: Floats, radius_m: float) -> npt.NDArray[np.bool_]:
    """Which of the positions found a place, when visited in order: those with no place within a field
    radius, where a place's confidence is one half."""
    pairs = cKDTree(candidates).query_pairs(radius_m, output_type="ndarray")
    pairs = pairs[np.argsort(pairs[:, 1])]
    recruited = np.ones(len(candidates), np.bool_)
    for earlier, later in pairs.tolist():
        if recruited[earlier]:
            recruited[later] = False
    return recruited


def check(client: cogmap.Client, space: str, drawn: Drawn) -> None:
    """Puts an agent of a new space down at all candidates, and compares the places that it founds.

    Raises:
        RuntimeError: They are not those drawn.
    """
    client.create_space(space)
    still = cogmap.Increment((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    samples: List[cogmap.Sample] = []
    for x, y, z in drawn.candidates.tolist():
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
