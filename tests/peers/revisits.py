#!/usr/bin/env python3
"""Views alone: a robot's refined map beside GTSAM's optimum of the same links.

For each seed `cogmap-lab eval env2` walks through the second room of the paper with odometry that
drifts and views of the room, and writes what it remembers and believes as a graph. GTSAM solves
that graph from rotations on, with the same kernel for revisits. What is told is how far both are
apart (RMS of positions), and what dead reckoning and cogmap are off: where the refined map is
farther off than dead reckoning and GTSAM agrees with it, the links do not say more.
"""

from __future__ import annotations

import one_thread  # isort: skip  # noqa: F401

import argparse
import json
import subprocess
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, List

import gtsam
import numpy as np
from graphs import Graph, whole

#: What `make release` builds.
_BINARY = Path("target", "release", "cogmap-lab")
#: The room, the walk and the noise of `docs/accuracy.md`.
_WALK = (
    "eval env2 --recruit novelty --walk persistent --percept descriptor --translation-noise 0.05 "
    "--scale-bias 0.01 --rotation-noise-deg 0.5 --gyro-bias-deg 0.02 --runs 1 --json"
)

#: Deviations far beyond which a revisit does not pull.
_MATCH_SCALE = 3.0


@dataclass(frozen=True)
class Row:
    """One walk. Errors are RMSE of position, without alignment."""

    seed: int
    closures: int
    dead_reckoning_m: float
    causal_m: float
    refined_m: float
    #: RMS distance of cogmap's refined positions from GTSAM's.
    from_gtsam_m: float
    #: Cost of cogmap's poses over that of GTSAM's, by GTSAM's count.
    cost_ratio: float


def main() -> int:
    """Runs the comparison that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=20, help="number of walks")
    parser.add_argument("--seed", type=int, default=1, help="seed of the first walk")
    parser.add_argument("--binary", type=Path, default=_BINARY, help="the program cogmap-lab")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    args = parser.parse_args()
    rows = [_compare(seed, args.binary) for seed in range(args.seed, args.seed + args.runs)]
    if args.json:
        version = getattr(gtsam, "__version__", None)
        print(json.dumps({"gtsam": version, "rows": [asdict(row) for row in rows]}))
    else:
        print(_text(rows))
    return 0


def _compare(seed: int, binary: Path) -> Row:
    with tempfile.TemporaryDirectory() as home:
        file = Path(home, "walk.g2o")
        command = [str(binary), *_WALK.split(), "--seed", str(seed), "--export-g2o", str(file)]
        done = subprocess.run(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True
        )
        graph = Graph(file)
    ours = json.loads(done.stdout)
    _doubt(graph)
    cost, _, optimum = whole(graph)
    apart = graph.positions(graph.start) - optimum
    return Row(
        seed,
        round(ours["closures"]["mean"]),
        ours["dead_reckoning_ate_rmse_m"]["mean"],
        ours["causal_ate_rmse_m"]["mean"],
        ours["refined_ate_rmse_m"]["mean"],
        float(np.sqrt((apart**2).sum(1).mean())),
        graph.factors.error(graph.start) / cost,
    )


def _doubt(graph: Graph) -> None:
    """Gives the revisits, which join poses that do not follow one another, the kernel that cogmap gives them."""
    doubted = gtsam.NonlinearFactorGraph()
    kernel = gtsam.noiseModel.mEstimator.GemanMcClure.Create(_MATCH_SCALE)
    for index, (first, second) in enumerate(graph.joined):
        # The binding knows the factors by their general type only.
        factor: Any = graph.factors.at(index)
        if abs(second - first) > 1:
            noise = gtsam.noiseModel.Robust.Create(kernel, factor.noiseModel())
            factor = gtsam.BetweenFactorPose3(first, second, factor.measured(), noise)
        doubted.push_back(factor)
    graph.factors = doubted


def _text(rows: List[Row]) -> str:
    """The rows as a table, and their means."""
    lines = ["seed  closures  dead reckoning  causal  refined  refined from GTSAM [m]  cost ratio"]
    for row in rows:
        lines.append(
            f"{row.seed:>4}{row.closures:>10}{row.dead_reckoning_m:>16.3f}{row.causal_m:>8.3f}"
            f"{row.refined_m:>9.3f}{row.from_gtsam_m:>24.3f}{row.cost_ratio:>12.4f}"
        )
    columns = ("dead_reckoning_m", "causal_m", "refined_m", "from_gtsam_m")
    means = [float(np.mean([getattr(row, name) for row in rows])) for name in columns]
    lines.append(f"mean{means[0]:>26.3f}{means[1]:>8.3f}{means[2]:>9.3f}{means[3]:>24.3f}")
    return "\n".join(lines)


if __name__ == "__main__":
    raise SystemExit(main())
