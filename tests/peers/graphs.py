#!/usr/bin/env python3
"""Pose graphs: `cogmap-lab replay g2o` beside GTSAM, each graph as a whole.

GTSAM starts from rotations (its own chordal start in space; in the plane, where it has none for
correlated noise, the same written here) and goes on by Levenberg-Marquardt. Both get the file's own
model, in the same run, with one thread.
"""

from __future__ import annotations

import one_thread  # isort: skip  # noqa: F401

import argparse
import json
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Dict, Iterator, List, Tuple

import gtsam
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

Floats = NDArray[np.float64]

#: What `make release` builds.
_BINARY = Path("target", "release", "cogmap-lab")
#: Deviation of the prior that holds the first pose.
_HELD_SD = 1e-6


@dataclass(frozen=True)
class Solved:
    """One program on one graph."""

    chi2_half: float
    batch_s: float


@dataclass(frozen=True)
class Row:
    """One graph. A ratio is cogmap's figure over GTSAM's."""

    graph: str
    poses: int
    closures: int
    cogmap: Solved
    gtsam: Solved
    ratios: Dict[str, float]


class Graph:
    """A g2o file as GTSAM reads it."""

    def __init__(self, path: Path) -> None:
        text = path.read_text()
        self.is_spatial = "EDGE_SE3" in text
        self.factors, self.start = gtsam.readG2o(str(path), self.is_spatial)
        #: For each factor the poses that it joins.
        self.joined: List[Tuple[int, int]] = []
        for index in range(self.factors.size()):
            first, second = self.factors.at(index).keys()
            self.joined.append((first, second))
        self.keys = sorted({key for pair in self.joined for key in pair})

    def pose(self, values: Any, key: int) -> Any:
        """A pose of either kind."""
        return values.atPose3(key) if self.is_spatial else values.atPose2(key)

    def positions(self, values: Any) -> Floats:
        """All positions, in the order of the keys."""
        return self.rows([self.pose(values, key) for key in self.keys])

    def rows(self, poses: List[Any]) -> Floats:
        """Positions as rows of three coordinates."""
        rows = np.zeros((len(poses), 3))
        for row, pose in zip(rows, poses):
            row[: 3 if self.is_spatial else 2] = pose.translation()
        return rows

    def hold(self, key: int, pose: Any) -> Any:
        """What holds a pose."""
        n, kind = (6, "Pose3") if self.is_spatial else (3, "Pose2")
        noise = gtsam.noiseModel.Diagonal.Sigmas(np.full(n, _HELD_SD))
        return getattr(gtsam, f"PriorFactor{kind}")(key, pose, noise)

    def first(self) -> Any:
        """Where the first pose is."""
        if self.start.exists(self.keys[0]):
            return self.pose(self.start, self.keys[0])
        return gtsam.Pose3() if self.is_spatial else gtsam.Pose2()


def main() -> int:
    """Runs the comparison that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="+", type=Path, help="graphs, or directories of graphs")
    parser.add_argument("--binary", type=Path, default=_BINARY, help="the program cogmap-lab")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    args = parser.parse_args()
    rows = []
    for path in _graphs(args.paths):
        print(path.name, file=sys.stderr, flush=True)
        rows.append(_compare(path, args.binary))
    if args.json:
        version = getattr(gtsam, "__version__", None)
        print(json.dumps({"gtsam": version, "rows": [asdict(row) for row in rows]}))
    else:
        print(_text(rows))
    return 0


def _graphs(paths: List[Path]) -> Iterator[Path]:
    for path in paths:
        yield from sorted(path.glob("**/*.g2o")) if path.is_dir() else [path]


def _compare(path: Path, binary: Path) -> Row:
    chi2_half, batch_s, _ = whole(Graph(path))
    command = [str(binary), "replay", "g2o", str(path), "--json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    ours = json.loads(done.stdout)
    cogmap = Solved(ours["chi2_half"], ours["batch_s"])
    peer = Solved(chi2_half, batch_s)
    ratios = {
        name: value / other
        for (name, value), other in zip(asdict(cogmap).items(), asdict(peer).values())
    }
    return Row(path.stem, ours["poses"], ours["closures"], cogmap, peer, ratios)


def whole(graph: Graph) -> Tuple[float, float, Floats]:
    """Half of chi-squared, time of start and solution, and positions at the optimum."""
    begin = time.perf_counter()
    factors = gtsam.NonlinearFactorGraph(graph.factors)
    factors.push_back(graph.hold(graph.keys[0], graph.first()))
    if graph.is_spatial:
        start = gtsam.InitializePose3.initialize(factors)
    else:
        start = _planar_start(graph)
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setRelativeErrorTol(1e-6)
    result = gtsam.LevenbergMarquardtOptimizer(factors, start, parameters).optimize()
    elapsed_s = time.perf_counter() - begin
    return graph.factors.error(result), elapsed_s, graph.positions(result)


def _planar_start(graph: Graph) -> Any:
    """Rotations and then positions that the edges agree on in the least squares sense.

    Directions and positions are complex numbers; z_j = z_i r_ij, then p_j - p_i = z_i t_ij.
    """
    number = {key: index for index, key in enumerate(graph.keys)}
    first = np.array([number[pair[0]] for pair in graph.joined])
    second = np.array([number[pair[1]] for pair in graph.joined])
    # The binding knows the factors by their general type only.
    edges: List[Any] = [graph.factors.at(index) for index in range(len(graph.joined))]
    measured = [edge.measured() for edge in edges]
    turns = np.exp(1j * np.array([pose.theta() for pose in measured]))
    shifts = np.array([complex(pose.x(), pose.y()) for pose in measured])
    origin = graph.first()
    ones = np.ones(len(first))
    directions = _agreed(first, second, turns, 0.0 * ones, np.exp(1j * origin.theta()))
    directions /= np.abs(directions)
    steps = directions[first] * shifts
    positions = _agreed(first, second, ones, steps, complex(origin.x(), origin.y()))
    start = gtsam.Values()
    for key, z, p in zip(graph.keys, directions, positions):
        start.insert(key, gtsam.Pose2(p.real, p.imag, float(np.angle(z))))
    return start


def _agreed(first: Any, second: Any, factors: Any, steps: Any, origin: complex) -> Any:
    """The x with x_second = factors · x_first + steps in the least squares sense, and x_0 = origin."""
    n_edges, n = len(first), int(max(first.max(), second.max())) + 1
    rows = np.r_[np.arange(n_edges), np.arange(n_edges)]
    entries = np.r_[np.ones(n_edges), -factors].astype(complex)
    matrix = csc_matrix((entries, (rows, np.r_[second, first])), shape=(n_edges, n))
    right = steps - matrix[:, [0]].toarray()[:, 0] * origin
    rest = matrix[:, 1:]
    adjoint = rest.conj().T
    return np.r_[origin, splu(csc_matrix(adjoint @ rest)).solve(adjoint @ right)]


def _text(rows: List[Row]) -> str:
    """The rows as a table."""
    lines = ["graph            by        chi2/2       whole [s]"]
    for row in rows:
        for name, solved in (("cogmap", row.cogmap), ("GTSAM", row.gtsam)):
            cells = f"{solved.chi2_half:>13.4f}{solved.batch_s:>12.3f}"
            lines.append(f"{row.graph:<17}{name:<7}{cells}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
