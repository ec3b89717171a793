"""Nodes come and go while robots write, and the robots hardly notice."""

from __future__ import annotations

import time
from contextlib import ExitStack
from typing import List

from cluster import QUIET_S, Cluster
from conftest import MakeCluster
from figures import ROUNDS, quantile, report
from writer import Writer

SPACES = 8
#: Messages that each robot is acknowledged before and after something happens.
MESSAGES = 50
#: Longest time between two acknowledgements of a robot while its space moves as planned [s]: the
#: old owner ends what it has begun and makes a checkpoint, and the new one opens the shard in a
#: quarter of a second.
PAUSE_S_MAX = 2.0


def test_a_node_joins_and_leaves_under_load(make_cluster: MakeCluster) -> None:
    cluster = make_cluster()
    cluster.start()
    placement = cluster.whole()
    # One of whom it is known that it takes a part.
    joining = cluster.nodes[max(placement.names, key=placement.names.count)]
    staying = cluster.others(joining)
    joining.terminate()
    cluster.whole()
    spaces = [f"hall-{number}" for number in range(SPACES)]
    for space in spaces:
        cluster.create(space)
    with ExitStack() as stack:
        writers = [
            stack.enter_context(Writer(staying[number % 2].url, space))
            for number, space in enumerate(spaces)
        ]
        await_all(writers)
        cluster.start(joining.name)
        cluster.await_part(joining)
        await_all(writers)
        joining.terminate()
        left = cluster.whole()
        assert set(left.names) <= {node.name for node in staying}
        await_all(writers)
        assert_pauses_short(writers)
        cluster.assert_all_there_once(*writers)


def await_all(writers: List[Writer]) -> None:
    """Waits until each robot was acknowledged something."""
    begin_s = time.monotonic()
    for writer in writers:
        writer.await_acks_since(begin_s, MESSAGES)


def assert_pauses_short(writers: List[Writer]) -> None:
    pauses_s = [writer.longest_pause_s() for writer in writers]
    figures = {
        "robots": len(writers),
        "longest pause of each [s]": [round(pause_s, 2) for pause_s in pauses_s],
        "longest pause [s]": round(max(pauses_s), 2),
    }
    report("a node joins and leaves", figures)
    assert max(pauses_s) <= PAUSE_S_MAX


def test_a_node_that_is_killed_and_back_at_once_is_seen_by_all(cluster: Cluster) -> None:
    back_s: List[float] = []
    for number in range(ROUNDS):
        node = list(cluster.nodes.values())[number % len(cluster.nodes)]
        begin_s = time.monotonic()
        node.kill()
        cluster.start(node.name)
        cluster.whole()
        back_s.append(time.monotonic() - begin_s - QUIET_S)
    report(
        "node back at once",
        {
            "rounds": ROUNDS,
            "p50 [s]": round(quantile(back_s, 0.5), 1),
            "worst [s]": round(max(back_s), 1),
        },
    )
