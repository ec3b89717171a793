#!/usr/bin/env python3
"""Gridness of the cells: an outside judge of the rate maps that a service answers.

The judge is `GridScorer` of NeuralPlayground: it rotates a rate map's autocorrelation, and
subtracts the largest correlation at 30°, 90° and 150° from the smallest at 60° and 120°. Every
module is asked for more than 1 in its hexagonal layers, and for less than 0 where the same fields
lie in squares; the program ends with 1 where that fails.
"""

from __future__ import annotations

import one_thread  # isort: skip  # noqa: F401

import argparse
import json
import sys
import warnings
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Dict, Optional, Tuple

import numpy as np
from neuralplayground.comparison import GridScorer

import rate_map
from grid import Floats, Grid
from service import BINARY, service

#: What the gridness of every module's layers has to be above, and that of its squares below.
_HEXAGONS_ABOVE = 1.0
_SQUARES_BELOW = 0.0
#: Edge of a rate map in spacings: a whole number of fields along it, and more than the ring of six
#: around the middle that the judge looks at.
_EDGE_SPACINGS = 4.0
#: Standard deviation of the fields of the perfect lattice in spacings, that of the cells.
_WIDTH = 1 / 6


@dataclass(frozen=True)
class Verdict:
    """What the judge says of one rate map."""

    #: Index of the module, finest first; absent for the perfect lattice.
    module: Optional[int]
    spacing_m: float
    #: Which plane; see `rate_map.slices`.
    slice: str
    #: Absent where the judge finds no ring of fields.
    gridness: Optional[float]
    #: Distance of neighbouring fields as the judge sees it [m].
    judged_spacing_m: Optional[float]


def main() -> int:
    """Records and judges what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cell", type=int, default=13, help="index of the cell in its module")
    parser.add_argument("--bins", type=int, default=40, help="bins along an edge of a rate map")
    parser.add_argument("--binary", type=Path, default=BINARY, help="the program cogmap")
    parser.add_argument("--out", type=Path, help="write the rate maps into this directory, as CSV")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    args = parser.parse_args()

    with service(args.binary) as server:
        client = server.client()
        client.create_space("plane")
        grid = Grid.read(client, "plane")
        slices = rate_map.slices(grid, args.cell, _EDGE_SPACINGS)
        print(f"recording {len(slices)} rate maps", file=sys.stderr, flush=True)
        maps = rate_map.record(client, "plane", slices, args.bins)

    perfect = rate_map.hexagons(args.bins, _EDGE_SPACINGS, _WIDTH)
    verdicts = [Verdict(None, 1.0, "perfect", *_judge(perfect, 1.0))]
    for slice_, rates in zip(slices, maps):
        spacing_m = grid.modules[slice_.module].spacing_m
        verdict = Verdict(slice_.module, spacing_m, slice_.kind, *_judge(rates, spacing_m))
        verdicts.append(verdict)
        if args.out is not None:
            args.out.mkdir(parents=True, exist_ok=True)
            name = f"module-{slice_.module}-{slice_.kind}.csv"
            np.savetxt(args.out / name, rates, fmt="%.6f", delimiter=",")

    passed = all(map(_holds, verdicts))
    report = {
        "cell": args.cell,
        "bins": args.bins,
        "edge_spacings": _EDGE_SPACINGS,
        "hexagons_above": _HEXAGONS_ABOVE,
        "squares_below": _SQUARES_BELOW,
        "passed": passed,
        "verdicts": [asdict(verdict) for verdict in verdicts],
    }
    print(json.dumps(report) if args.json else _text(report))
    return 0 if passed else 1


def _holds(verdict: Verdict) -> bool:
    """Whether a rate map has what is asked of its slice; nothing is, where the cut is oblique."""
    if verdict.slice == "layer":
        return verdict.gridness is not None and verdict.gridness > _HEXAGONS_ABOVE
    if verdict.slice == "square":
        return verdict.gridness is not None and verdict.gridness < _SQUARES_BELOW
    return True


def _judge(rates: Floats, spacing_m: float) -> Tuple[Optional[float], Optional[float]]:
    """Gridness and distance of neighbouring fields [m] of a rate map."""
    # The judge writes into what it is given. Where it finds no fields it warns, and answers NaN or
    # fails.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            scores = GridScorer(len(rates)).get_scores(rates.copy())[1]
        except (IndexError, ValueError):
            return None, None
    numbers = (scores["gridscore"], scores["scale"] * _EDGE_SPACINGS * spacing_m / len(rates))
    gridness, judged_m = (float(number) if np.isfinite(number) else None for number in numbers)
    return gridness, judged_m


def _text(report: Dict[str, Any]) -> str:
    """The report as a table."""
    lines = [
        f"Cell {report['cell']} of every module, {report['bins']} × {report['bins']} bins over "
        f"{report['edge_spacings']:g} × {report['edge_spacings']:g} spacings.",
        "module  spacing [m]  slice       gridness  judged spacing [m]",
    ]
    for verdict in report["verdicts"]:
        module = "-" if verdict["module"] is None else verdict["module"]
        gridness, judged_m = (
            "none" if verdict[name] is None else f"{verdict[name]:.3f}"
            for name in ("gridness", "judged_spacing_m")
        )
        lines.append(
            f"{module:>6}  {verdict['spacing_m']:>11.3f}  {verdict['slice']:<10}{gridness:>10}"
            f"{judged_m:>20}"
        )
    words = "Asked and found" if report["passed"] else "Asked, but NOT found"
    lines.append(
        f"{words}: above {report['hexagons_above']:g} in every layer, below "
        f"{report['squares_below']:g} in every square."
    )
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
