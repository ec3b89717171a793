"""The storage of all nodes fails in one way or another, and nothing that was acknowledged is lost.

The nodes go on by themselves afterwards: none of them is started again.
"""

from __future__ import annotations

import time
from typing import Callable

import pytest

from cluster import Cluster
from storage import Storage
from wait import eventually
from wiring import Relays
from writer import Writer

#: Messages that are acknowledged before and after something happens.
MESSAGES = 10
#: How long the storage stands still, or refuses everything [s]: longer than the lease.
FAILS_S = 8.0
#: Every so-many-th PUT is done and not answered: often enough to meet each kind of object, seldom
#: enough for most second attempts to be answered.
LOST_EVERY = 5
#: Answers that each node loses at least.
LOST = 5

Fault = Callable[[Storage, Relays], None]


def frozen(storage: Storage, relays: Relays) -> None:
    storage.freeze()
    try:
        time.sleep(FAILS_S)
    finally:
        storage.thaw()


def restarted(storage: Storage, relays: Relays) -> None:
    storage.kill()
    storage.start()


def refusing(storage: Storage, relays: Relays) -> None:
    for relay in relays.storage.values():
        relay.refuse()
    try:
        time.sleep(FAILS_S)
    finally:
        for relay in relays.storage.values():
            relay.mend()
    assert all(relay.refused > 0 for relay in relays.storage.values()), "all were refused something"


def forgetful(storage: Storage, relays: Relays) -> None:
    for relay in relays.storage.values():
        relay.lose_answers(LOST_EVERY)
    try:
        for name, relay in relays.storage.items():
            eventually(f"{LOST} lost answers of {name}", lambda: relay.lost >= LOST)
    finally:
        for relay in relays.storage.values():
            relay.mend()


@pytest.mark.parametrize("fault", [frozen, restarted, refusing, forgetful])
def test_storage_that_fails(
    relayed: Cluster, relays: Relays, storage: Storage, fault: Fault
) -> None:
    shard = relayed.create("hall")
    before = relayed.whole()
    with Writer(relayed.others(relayed.owner(shard))[0].url, "hall") as writer:
        writer.await_acks(MESSAGES)
        fault(storage, relays)
        writer.await_acks(MESSAGES)
        assert all(node.runs for node in relayed.nodes.values()), "none has ended"
        after = relayed.whole()
        print(f"terms {before.terms} before, {after.terms} after")
        assert all(new >= old for new, old in zip(after.terms, before.terms))
        if fault is frozen:
            assert after == before, "nobody takes from others what none of them can write"
        writer.await_acks(MESSAGES)
        relayed.assert_all_there_once(writer)
