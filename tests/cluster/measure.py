#!/usr/bin/env python3
"""Measures how much several nodes over one object storage take, beside an embedded store.

Each space has a robot that sends messages of samples over HTTP, one after the other, the next one
when the one before is acknowledged. The robots are spread over the nodes without regard to who owns
their spaces, so of three nodes two pass a message on in two of three cases. Robots, nodes and the
storage share this machine: ratios say more than rates.

Prints one JSON object on standard output and a table on standard error.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import List, Optional, Sequence

sys.path.insert(0, str(Path(__file__).parents[1] / "python"))

from asking import insist
from cluster import SHARDS, Cluster
from figures import quantile
from server import Server
from storage import Storage
from writer import Ack, Writer

#: Beats of a node, each with a PUT, by its default settings [1/s].
_BEATS_PER_S = 2.0
#: Most nodes that one machine is asked to run.
_NODES_MAX = 8
#: Shortest time until what is measured begins [s]: connections are made, caches are filled.
_WARM_UP_S = 3.0


@dataclass(frozen=True)
class Result:
    """What was measured of one store."""

    store: str
    nodes: int
    spaces: int
    #: Samples that were acknowledged [1/s].
    samples_per_s: float
    #: From sending a message until its watermark came [ms].
    p50_ms: float
    p99_ms: float
    #: Requests to the storage [1/s]; of the embedded store none.
    put_per_s: Optional[float]
    get_per_s: Optional[float]
    #: PUT that docs/scaling.md reckons with, if the interval of commits is told [1/s].
    expected_put_per_s: Optional[float]


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs the program and returns its exit code."""
    options = _options(argv)
    results: List[Result] = []
    with tempfile.TemporaryDirectory(prefix="cogmap-measure-") as directory:
        home = Path(directory)
        results.append(_embedded(home, options))
        (home / "storage").mkdir()
        storage = Storage(home / "storage")
        try:
            for n_nodes in options.nodes:
                results.append(_nodes(home, storage, n_nodes, options))
        finally:
            storage.close()
        results.append(_embedded(home, options))
    print(json.dumps({"options": vars(options), "results": [asdict(each) for each in results]}))
    print(_table(results), file=sys.stderr)
    return 0


def _options(argv: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument(
        "--nodes", type=int, nargs="+", default=[1, 2, 3, 4], help="numbers of nodes"
    )
    parser.add_argument("--spaces", type=int, default=64, help="spaces, each with one robot")
    parser.add_argument("--batch", type=int, default=100, help="samples of a message")
    parser.add_argument("--seconds", type=float, default=20.0, help="how long is measured [s]")
    parser.add_argument(
        "--commit-interval", type=float, help="engine.commit_interval_s of all services [s]"
    )
    options = parser.parse_args(argv)
    if not set(options.nodes) <= set(range(1, _NODES_MAX + 1)):
        parser.error(f"--nodes: 1 to {_NODES_MAX}")
    return options


def _settings(options: argparse.Namespace) -> List[str]:
    if options.commit_interval is None:
        return []
    return [f"engine.commit_interval_s={options.commit_interval}"]


def _embedded(home: Path, options: argparse.Namespace) -> Result:
    server = Server(Path(tempfile.mkdtemp(prefix="embedded-", dir=home)), _settings(options))
    server.start()
    try:
        return _measured("embedded", [server.url], None, options)
    finally:
        server.close()


def _nodes(home: Path, storage: Storage, n_nodes: int, options: argparse.Namespace) -> Result:
    name = f"nodes-{n_nodes}"
    names = [f"node-{number}" for number in range(n_nodes)]
    cluster = Cluster(storage, home / name, name, names, settings=_settings(options))
    try:
        cluster.start()
        cluster.whole()
        urls = [node.url for node in cluster.nodes.values()]
        return _measured("object storage", urls, storage, options)
    finally:
        cluster.close()


def _measured(
    store: str, urls: List[str], storage: Optional[Storage], options: argparse.Namespace
) -> Result:
    spaces = [f"space-{number}" for number in range(options.spaces)]
    for space in spaces:
        insist(urls[0], "PUT", f"/v1/spaces/{space}", b"{}")
    with ExitStack() as stack:
        writers = [
            stack.enter_context(
                Writer(urls[number % len(urls)], space, samples=options.batch, pace_s=0.0)
            )
            for number, space in enumerate(spaces)
        ]
        for writer in writers:
            writer.await_acks()
        time.sleep(_WARM_UP_S)
        requests = storage.requests() if storage is not None else {}
        begin_s = time.monotonic()
        time.sleep(options.seconds)
        end_s = time.monotonic()
        later = storage.requests() if storage is not None else {}
        acks: List[Ack] = []
        for writer in writers:
            writer.finish()
            acks += [ack for ack in writer.acks if begin_s <= ack.told_s < end_s]
    took_s = end_s - begin_s
    waits_ms = [1000.0 * (ack.told_s - ack.sent_s) for ack in acks]

    def rate(method: str) -> Optional[float]:
        if storage is None:
            return None
        return round((later.get(method, 0) - requests.get(method, 0)) / took_s, 1)

    expected: Optional[float] = None
    if storage is not None and options.commit_interval is not None:
        expected = len(urls) * _BEATS_PER_S + SHARDS / options.commit_interval
    return Result(
        store=store,
        nodes=len(urls),
        spaces=options.spaces,
        samples_per_s=round(len(acks) * options.batch / took_s, 1),
        p50_ms=round(quantile(waits_ms, 0.5), 2),
        p99_ms=round(quantile(waits_ms, 0.99), 2),
        put_per_s=rate("PUT"),
        get_per_s=rate("GET"),
        expected_put_per_s=expected,
    )


def _table(results: List[Result]) -> str:
    lines = [
        "| store | nodes | spaces | durable samples/s | p50 [ms] | p99 [ms] | PUT/s | expected "
        "| GET/s |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for each in results:
        rates = (each.put_per_s, each.expected_put_per_s, each.get_per_s)
        put, expected, get = ("" if rate is None else rate for rate in rates)
        lines.append(
            f"| {each.store} | {each.nodes} | {each.spaces} | {each.samples_per_s} "
            f"| {each.p50_ms} | {each.p99_ms} | {put} | {expected} | {get} |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
