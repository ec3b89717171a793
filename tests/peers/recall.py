#!/usr/bin/env python3
"""Recall of places by grid code: `cogmap-lab bench recall` beside FAISS and a k-d tree.

The peers hold the places of the benchmark and are asked the queries of its last round, in the same
run, with one thread each. FAISS gets the activations of all grid cells as vectors; the k-d
tree gets the positions themselves. Before anything is measured, codes and places are compared with
those of a running service.
"""

from __future__ import annotations

import one_thread  # isort: skip  # noqa: F401

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional

import faiss
import numpy as np
from scipy.spatial import cKDTree

import index
import places
from grid import Floats, Grid
from service import BINARY, service

#: An answer farther from the query than this is another place's [m].
_FAR_M = 0.5
#: Positions at which codes are compared with the service's, and places drawn to be compared.
_CHECKED_CODES = 100
_CHECKED_PLACES = 500


@dataclass(frozen=True)
class Row:
    """One way to find places, at one number of them. Times are elapsed ones of cogmap, as the benchmark
    tells them, and processor times of its peers."""

    places: int
    name: str
    us_p50: float
    us_p99: float
    #: `us_p50` over that of cogmap at the same number of places.
    times_cogmap: float
    #: Mean time of one question when all are asked in one call; cogmap has no such call.
    us_in_batch: Optional[float]
    #: Single questions that were timed.
    asked: int
    #: Share of the winners that are those of a scan of the same codes; not asked of positions.
    recall_at_1: Optional[float]
    #: Share of the winners that are the places nearest to the query; the benchmark does not tell.
    nearest: Optional[float]
    #: Share of the winners that are more than half a metre from the query.
    beyond_half_m: float
    bytes_per_place: float
    build_s: float


def main() -> int:
    """Runs the comparison that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    sizes = [1_000, 10_000, 100_000]
    parser.add_argument("--places", type=_numbers, default=sizes, help="numbers of places: 1000,…")
    parser.add_argument("--ef-search", type=_numbers, default=[16, 64, 256], help="of HNSW")
    most = "leave HNSW out above this number of places: building it takes minutes from 100,000 on"
    parser.add_argument("--hnsw-most", type=int, default=sys.maxsize, help=most)
    parser.add_argument("--rounds", type=int, default=20, help="cogmap's, of 1,000 queries")
    parser.add_argument("--seed", type=int, default=1, help="of places and queries")
    parser.add_argument("--patience", type=float, default=20.0, help="most time for one row [s]")
    parser.add_argument("--binary", type=Path, default=BINARY, help="the program cogmap")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    args = parser.parse_args()
    faiss.omp_set_num_threads(1)

    with tempfile.TemporaryDirectory() as name, service(args.binary) as server:
        directory = Path(name)
        bench = _bench(args, _CHECKED_PLACES, 1, directory)
        client = server.client()
        settings = client.create_space("codes").settings
        grid = Grid.read(client, "codes")
        # A cube as large as that of the most places.
        drawn = places.read(directory, _CHECKED_PLACES)
        edge_m = float(np.ptp(drawn.places)) * (max(args.places) / _CHECKED_PLACES) ** (1 / 3)
        worst = grid.check(client, "codes", edge_m, _CHECKED_CODES)
        places.check(client, "places", drawn)
    _progress(f"codes as the service answers them, to {worst:.0e}; places as it founds them")

    rows = []
    for size in args.places:
        for row in _compare(args, grid, size):
            _progress(_line(row))
            rows.append(row)
    report = {
        "query": bench["query"],
        "grid": {
            "modules": settings.grid_modules,
            "spacing_m": settings.grid_spacing_m,
            "ratio": settings.grid_ratio,
            "cells": grid.cells,
        },
        "largest_difference_of_codes": worst,
        "faiss": faiss.__version__,
        "faiss_call_us": index.faiss_call_us(grid.cells),
        "tree_call_us": index.tree_call_us(),
        "rows": [asdict(row) for row in rows],
    }
    print(json.dumps(report) if args.json else _text(report))
    return 0


def _numbers(text: str) -> List[int]:
    return [int(number) for number in text.split(",")]


def _bench(args: argparse.Namespace, size: int, rounds: int, out: Path) -> Dict[str, Any]:
    """The report of `cogmap-lab bench recall`, which writes places and queries into `out`."""
    command = [args.binary.with_name("cogmap-lab"), "bench", "recall", "--json", "--places", size, "--rounds", rounds]
    command += ["--seed", args.seed, "--out", out]
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, check=True)
    report: Dict[str, Any] = json.loads(done.stdout)
    return report


def _compare(args: argparse.Namespace, grid: Grid, size: int) -> Iterator[Row]:
    """All ways at one number of places, cogmap first."""
    with tempfile.TemporaryDirectory() as name:
        ours = _bench(args, size, args.rounds, Path(name))["rows"][0]
        drawn = places.read(Path(name), size)
    yield Row(
        size,
        "cogmap",
        ours["us_p50"],
        ours["us_p99"],
        1.0,
        None,
        1_000 * args.rounds,
        ours["recall_at_1"],
        None,
        ours["beyond_half_m"],
        ours["bytes_per_place"],
        ours["build_s"],
    )
    codes, queries = grid.codes(drawn.places), grid.codes(drawn.queries)

    nearest = cKDTree(drawn.places).query(drawn.queries)[1]

    def row(measured: index.Measured, scanned: Optional[index.Winners]) -> Row:
        distance = np.linalg.norm(drawn.places[measured.winners] - drawn.queries, axis=1)
        p50 = _quantile(measured.times_us, 0.5)
        return Row(
            size,
            measured.name,
            p50,
            _quantile(measured.times_us, 0.99),
            p50 / ours["us_p50"],
            measured.us_in_batch,
            len(measured.times_us),
            None if scanned is None else float(np.mean(measured.winners == scanned)),
            float(np.mean(measured.winners == nearest)),
            float(np.mean(distance > _FAR_M)),
            measured.bytes_per_place,
            measured.build_s,
        )

    scanned = index.flat(codes, queries, args.patience)
    yield row(scanned, scanned.winners)
    yield row(index.tree(drawn.places, drawn.queries, args.patience), None)
    if size <= args.hnsw_most:
        _progress(f"building HNSW of {size} places")
        for measured in index.hnsw(codes, queries, args.ef_search, args.patience):
            yield row(measured, scanned.winners)


def _quantile(values: Floats, q: float) -> float:
    """By nearest rank, as the benchmark's."""
    return float(np.quantile(values, q, method="inverted_cdf"))


def _progress(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _text(report: Dict[str, Any]) -> str:
    """The report as a table."""
    lines = [
        f"Query: {report['query']}. {report['grid']['cells']} cells, finest spacing "
        f"{report['grid']['spacing_m']} m, ratio {report['grid']['ratio']:.4f}.",
        f"From Python, a call of FAISS {report['faiss']} costs {report['faiss_call_us']:.1f} µs of its "
        f"p50, one of the tree {report['tree_call_us']:.1f} µs.",
        "  places  by                  p50 [µs]   p99 [µs]  × cogmap  in batch  recall@1   nearest"
        "   > 0.5 m  bytes/place  build [s]",
    ]
    lines.extend(_line(Row(**row)) for row in report["rows"])
    return "\n".join(lines)


def _line(row: Row) -> str:
    """A row of the table."""
    cells = [
        f"{row.places:>8}  {row.name:<18}{row.us_p50:>10.2f} {row.us_p99:>10.2f}",
        f"{row.times_cogmap:>10.2f}",
        _cell(row.us_in_batch, 2),
        _cell(row.recall_at_1, 4),
        _cell(row.nearest, 4),
        f"{row.beyond_half_m:>10.5f}{row.bytes_per_place:>13.1f}{row.build_s:>11.2f}",
    ]
    return "".join(cells)


def _cell(value: Optional[float], digits: int) -> str:
    return f"{'':>10}" if value is None else f"{value:>10.{digits}f}"


if __name__ == "__main__":
    sys.exit(main())
