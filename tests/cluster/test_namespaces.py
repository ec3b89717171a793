"""Where packets are lost, which tells nobody anything, one node owns each shard all the same."""

from __future__ import annotations

import time
from typing import Iterator, Optional, Tuple

import pytest

from cluster import Cluster, Node, assert_stays
from conftest import MakeCluster
from figures import report
from namespaces import NODES, STORAGE, Namespaces
from test_partition import CALM_S, MESSAGES, Watcher
from wait import eventually
from writer import Writer

#: Lease of the nodes [s], the default.
LEASE_S = 5.0
#: Time until Zenoh misses who says nothing [s].
ZENOH_S = 10.0


@pytest.fixture
def namespaces() -> Iterator[Namespaces]:
    """The namespaces of `apart`."""
    namespaces = Namespaces()
    yield namespaces
    namespaces.close()


@pytest.fixture
def apart(namespaces: Namespaces, make_cluster: MakeCluster) -> Cluster:
    """Three nodes that have settled, each in a namespace."""
    cluster = make_cluster(wiring=namespaces)
    cluster.start()
    cluster.whole()
    return cluster


@pytest.mark.parametrize(
    "lost", [(NODES,), (STORAGE,), (NODES, STORAGE)], ids=["nodes", "storage", "both"]
)
def test_a_node_whose_packets_are_lost(
    apart: Cluster, namespaces: Namespaces, lost: Tuple[str, ...]
) -> None:
    shard = apart.create("hall")
    owner = apart.owner(shard)
    others = apart.others(owner)
    with Writer(others[0].url, "hall") as writer:
        writer.await_acks(MESSAGES)
        with Watcher(apart.awake, writer) as watcher:
            begin_s = time.monotonic()
            for switch in lost:
                namespaces.lose(owner.name, switch)
            apart.await_other_owner(shard, owner)
            writer.await_acks()
            report(f"packets lost: {', '.join(lost)}", {"followed after [s]": _since(begin_s)})
            assert_stays(apart, others, CALM_S)
            writer.await_acks(MESSAGES)
            watcher.check()
            for switch in lost:
                namespaces.mend(owner.name, switch)
            apart.await_part(owner)
            writer.await_acks(MESSAGES)
        watcher.check()
        apart.assert_all_there_once(writer)


def test_a_team_in_three_parts(apart: Cluster, namespaces: Namespaces) -> None:
    shard = apart.create("hall")
    with Writer(apart.owner(shard).url, "hall") as writer:
        writer.await_acks(MESSAGES)
        with Watcher(apart.awake, writer) as watcher:
            for node in apart.awake:
                namespaces.lose(node.name, NODES)
            # By then all have missed one another, those who are alone have given their shards up,
            # and two leases later somebody has taken each.
            time.sleep(ZENOH_S + 4.0 * LEASE_S)
            writer.through(_holder(apart, shard).url)
            writer.await_acks(MESSAGES)
            pause_s = round(writer.longest_pause_s(), 1)
            report("a team in three parts", {"without an owner [s]": pause_s})
            watcher.check()
            for node in apart.awake:
                namespaces.mend(node.name, NODES)
            apart.whole()
            writer.await_acks(MESSAGES)
        watcher.check()
        apart.assert_all_there_once(writer)


def _holder(cluster: Cluster, shard: int) -> Node:
    """Waits until one node says that a shard is open with it."""

    def look() -> Optional[Node]:
        views = [(node, node.view()) for node in cluster.awake]
        holders = [node for node, view in views if view is not None and shard in view.opened()]
        return holders[0] if holders else None

    return eventually(f"an owner of shard {shard}", look)


def _since(begin_s: float) -> float:
    return round(time.monotonic() - begin_s, 1)
