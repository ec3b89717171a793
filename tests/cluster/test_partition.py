"""A node that is cut off from the other nodes or from the storage does no harm, and comes back."""

from __future__ import annotations

import threading
from types import TracebackType
from typing import Callable, Dict, List, Optional, Tuple, Type

import pytest

from asking import ask
from circle import AGENT
from cluster import Cluster, Node, assert_stays
from relay import Relay
from wiring import Relays
from writer import Writer

#: Messages that are acknowledged before and after something happens.
MESSAGES = 10
#: How long nothing may change hands after the others have settled [s].
CALM_S = 10.0
#: Time between the watcher's questions [s].
_GLANCE_S = 0.05


class Watcher:
    """A thread that asks one node after the other how far the samples of a writer are on disk. What
    it was told, and what the writer was told, is never taken back by anyone."""

    def __init__(self, nodes: List[Node], writer: Writer) -> None:
        self._nodes = nodes
        self._writer = writer
        self._told: Dict[str, int] = {}
        self._wrong: List[str] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch)

    def __enter__(self) -> Watcher:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        self._stop.set()
        self._thread.join()

    def check(self) -> None:
        """Nothing was taken back so far."""
        assert not self._wrong, self._wrong

    def _watch(self) -> None:
        highest = 0
        while not self._stop.is_set():
            for node in self._nodes:
                # Whatever was told before this question.
                highest = max(highest, self._writer.acknowledged)
                durable = self._durable(node)
                if durable is not None and durable < highest:
                    self._wrong.append(f"{node.name} says {durable} after {highest}")
                highest = max(highest, durable or 0)
            self._stop.wait(_GLANCE_S)

    def _durable(self, node: Node) -> Optional[int]:
        path = f"/v1/spaces/{self._writer.space}/agents/{AGENT}"
        try:
            answer = ask(node.url, "GET", path)
        except OSError:
            return None
        return int(answer.body["watermark"]["durable"]) if answer.is_good else None


def links(relays: Relays, node: str) -> Tuple[Relay, ...]:
    return relays.links_of(node)


def storage(relays: Relays, node: str) -> Tuple[Relay, ...]:
    return (relays.storage[node],)


@pytest.mark.parametrize("how", [Relay.cut, Relay.freeze], ids=["cut", "frozen"])
@pytest.mark.parametrize("of", [links, storage], ids=["links", "storage"])
def test_a_node_cut_off_from_the_others(
    relayed: Cluster,
    relays: Relays,
    of: Callable[[Relays, str], Tuple[Relay, ...]],
    how: Callable[[Relay], None],
) -> None:
    shard = relayed.create("hall")
    owner = relayed.owner(shard)
    others = relayed.others(owner)
    with Writer(others[0].url, "hall") as writer:
        writer.await_acks(MESSAGES)
        with Watcher(relayed.awake, writer) as watcher:
            for relay in of(relays, owner.name):
                how(relay)
            # Without the storage it can write nothing, and without the others fewer robots reach
            # it: either way the others follow it.
            relayed.await_other_owner(shard, owner)
            assert_stays(relayed, others, CALM_S)
            writer.await_acks(MESSAGES)
            watcher.check()
            for relay in of(relays, owner.name):
                relay.mend()
            relayed.await_part(owner)
            writer.await_acks(MESSAGES)
        watcher.check()
        relayed.assert_all_there_once(writer)

