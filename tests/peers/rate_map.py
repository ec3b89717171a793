"""Rate maps of grid cells, recorded by agents that walk over a plane and ask at every step."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import List, Sequence, Tuple

import cogmap
import numpy as np

from grid import Explorer, Floats, Grid


@dataclass(frozen=True)
class Slice:
    """A square part of a plane, and the cell that is recorded there."""

    kind: str
    #: Index of the module, finest first.
    module: int
    #: Index of the cell within its module.
    cell: int
    #: Middle of the square [m].
    centre: Floats
    #: Two perpendicular unit vectors in the plane, one row each.
    axes: Floats
    edge_m: float


def slices(grid: Grid, cell: int, edge_spacings: float) -> Tuple[Slice, ...]:
    """Three planes of every module, each through the middle of one of the cell's fields.

    `layer` is spanned by the first two lattice vectors, which are 60° apart: the fields lie in
    hexagons. `square` is spanned by the first one and the difference of the others, which are
    perpendicular: the same lattice, and the same fields, in squares. `horizontal` is the plane z =
    const, in which a walking rat would be recorded: the layers of the first module, an oblique cut
    through all others.
    """
    found = []
    for index, module in enumerate(grid.modules):
        first, second, third = module.basis.T
        planes = {
            "layer": (first, second),
            "square": (first, third - second),
            "horizontal": (np.array([1.0, 0, 0]), np.array([0, 1.0, 0])),
        }
        centre = module.basis @ module.preferred[cell]
        edge_m = edge_spacings * module.spacing_m
        for kind, spanned in planes.items():
            found.append(Slice(kind, index, cell, centre, _perpendicular(*spanned), edge_m))
    return tuple(found)


def record(
    client: cogmap.Client, space: str, slices: Sequence[Slice], bins: int
) -> List[Floats]:
    """Rate maps, one for each slice: the activation of the slice's cell at the middles of `bins` × `bins` squares.

    Every row has an agent of its own. It is put down at the row's beginning, and gets to the other
    bins by motion, so that what is recorded is path integration.
    """
    maps = [np.full((bins, bins), np.nan) for _ in slices]
    middles = (np.arange(bins) + 0.5) / bins - 0.5

    def walk(row: int) -> None:
        explorer = Explorer(client, space, f"walker-{row}")
        for slice_, rates in zip(slices, maps):
            along, across = slice_.axes * slice_.edge_m
            start = slice_.centre + middles[0] * along + middles[row] * across
            state = explorer.stand(start)
            for column in range(bins):
                if column > 0:
                    state = explorer.step(along / bins)
                rates[row, column] = state.modules[slice_.module].activation[slice_.cell]

    # The answers to all rows' samples wait for the same syncs of the disk.
    with ThreadPoolExecutor(bins) as pool:
        list(pool.map(walk, range(bins)))
    return maps


def hexagons(bins: int, edge_spacings: float, width: float) -> Floats:
    """The rate map of a perfect hexagonal lattice of Gaussian fields: what the judge can be given at most.

    Args:
        bins: Bins along an edge.
        edge_spacings: Length of an edge.
        width: Standard deviation of a field in spacings.
    """
    basis = np.array([[1.0, 0.5], [0.0, 0.75**0.5]])
    reach = np.arange(-np.ceil(edge_spacings) - 1, np.ceil(edge_spacings) + 2)
    centres = np.stack(np.meshgrid(reach, reach), -1).reshape(-1, 2) @ basis.T
    middles = ((np.arange(bins) + 0.5) / bins - 0.5) * edge_spacings
    points = np.stack(np.meshgrid(middles, middles), -1)
    squared = ((points[:, :, None, :] - centres) ** 2).sum(-1).min(-1)
    rates: Floats = np.exp(squared / (-2 * width**2))
    return rates


def _perpendicular(first: Floats, second: Floats) -> Floats:
    """Perpendicular unit vectors of the plane of two others, the first one's direction kept."""
    along = first / np.linalg.norm(first)
    across = second - (second @ along) * along
    return np.stack([along, across / np.linalg.norm(across)])
