"""An owner that stands still or ends is followed by another node, and what robots were told stays.

Not a part of the gate, for it takes minutes: `make drills-cluster`.
"""

from __future__ import annotations

import time
import urllib.error
import urllib.request
from typing import List

from asking import AGAIN, insist, samples_path
from circle import AGENT, BATCH
from cluster import Cluster
from cogmap.wire import CBOR
from conftest import MakeCluster
from figures import ROUNDS, quantile, report
from storage import Storage
from wait import LONG_S
from writer import Writer, message

#: Messages that are acknowledged before and after something happens: a fifth of a second of them.
MESSAGES = 10
#: Rounds of the negative control at most, of which one has to show the loss.
CONTROLS_MAX = 10
#: Time in which a request that was sent reaches the storage [s].
ARRIVES_S = 0.5
#: Longest time without acknowledgements after an owner was killed, in half of all rounds [s]: its
#: end is noticed at once, because its connections close; the next owner waits for half a second
#: whether it stays away, opens the shard in a quarter of a second, and replays its spaces.
FOLLOWED_S_P50 = 3.0
#: The same in the worst round [s]: the lease of five seconds, for an owner whose end nobody
#: noticed, and three more to open the shard on a busy machine.
FOLLOWED_S_MAX = 8.0


def test_a_frozen_owner_writes_nothing(cluster: Cluster) -> None:
    shard = cluster.create("hall")
    # A robot that stays with the owner is heard again by the one that was frozen.
    beside = cluster.create_in(shard, "beside")
    owner = cluster.owner(shard)
    other = cluster.others(owner)[0]
    with Writer(other.url, "hall") as writer, Writer(
        owner.url, beside, patience_s=LONG_S
    ) as stubborn:
        for _ in range(ROUNDS):
            writer.await_acks(MESSAGES)
            stubborn.await_acks(MESSAGES)
            told = stubborn.acknowledged
            owner.pause()
            follower = cluster.await_other_owner(shard, owner)
            writer.await_acks(MESSAGES)
            assert cluster.durable(follower, beside) >= told, "what was acknowledged is there"
            owner.resume()
            writer.await_acks(MESSAGES)
            stubborn.await_acks(MESSAGES)
            for node in cluster.awake:
                told = stubborn.acknowledged
                assert cluster.durable(node, beside) >= told, f"{node.name} knows what was told"
            cluster.whole()
            owner = cluster.owner(shard)
            writer.through(cluster.others(owner)[0].url)
            stubborn.through(owner.url)
        cluster.assert_all_there_once(writer, stubborn)


def test_who_asks_a_frozen_owner_is_not_kept_waiting(cluster: Cluster) -> None:
    owner = cluster.owner(cluster.create("hall"))
    url = f"{cluster.others(owner)[0].url}/v1/spaces/hall"
    owner.pause()
    begin_s = time.monotonic()
    # Whatever the answer is: the clients ask again by themselves.
    try:
        urllib.request.urlopen(url, timeout=LONG_S).close()
    except urllib.error.HTTPError as error:
        assert error.code in AGAIN, error
    waited_s = time.monotonic() - begin_s
    owner.resume()
    report("frozen owner", {"answered after [s]": round(waited_s, 2)})
    assert waited_s <= FOLLOWED_S_MAX


def test_without_its_fence_the_drill_sees_a_loss(cluster: Cluster, storage: Storage) -> None:
    """The negative control of the drill above: an owner that nothing fences acknowledges samples
    that nobody has."""
    shard = cluster.create("hall")
    log = f"{cluster.store}/shards/{shard}/wal"
    for number in range(CONTROLS_MAX):
        beside = cluster.create_in(shard, f"beside-{number}")
        owner = cluster.owner(shard)
        # Without a pace there is nearly always a message under way.
        with Writer(owner.url, beside, pace_s=0.0, patience_s=LONG_S) as stubborn:
            stubborn.await_acks(MESSAGES)
            owner.pause()
            # What was sent before that arrives.
            time.sleep(ARRIVES_S)
            before = set(storage.objects(log))
            follower = cluster.await_other_owner(shard, owner)
            # The first entry of the next owner is in the place where the one before would go on.
            fence = next(name for name in storage.objects(log) if name not in before)
            storage.remove(f"{log}/{fence}")
            owner.resume()
            cluster.whole()
        told, there = stubborn.acknowledged, cluster.durable(follower, beside)
        print(f"round {number}: {told} samples were acknowledged, {there} are there")
        if there < told:
            return
    raise AssertionError(f"nothing was lost in {CONTROLS_MAX} rounds without a fence")


def test_a_killed_owner_is_followed_soon(cluster: Cluster) -> None:
    shard = cluster.create("hall")
    followed_s: List[float] = []
    with Writer(cluster.others(cluster.owner(shard))[0].url, "hall") as writer:
        for number in range(ROUNDS):
            owner = cluster.owner(shard)
            # Through either of the others, in turn.
            writer.through(cluster.others(owner)[number % 2].url)
            writer.await_acks(MESSAGES)
            term = writer.acks[-1].term
            killed_s = time.monotonic()
            owner.kill()
            ack = writer.await_acks_since(killed_s)
            assert ack.term > term, "another owner says so"
            followed_s.append(ack.told_s - killed_s)
            told = writer.acknowledged
            for node in cluster.awake:
                assert cluster.durable(node, "hall") >= told, f"{node.name} knows what was told"
            cluster.start(owner.name)
            cluster.whole()
        cluster.assert_all_there_once(writer)
    figures = {
        "kills": len(followed_s),
        "time to the next acknowledgement, p50 [s]": round(quantile(followed_s, 0.5), 2),
        "worst [s]": round(max(followed_s), 2),
        "all [s]": [round(each, 2) for each in followed_s],
    }
    report("killed owner", figures)
    assert quantile(followed_s, 0.5) <= FOLLOWED_S_P50
    assert max(followed_s) <= FOLLOWED_S_MAX


def test_two_claimants_at_once(make_cluster: MakeCluster) -> None:
    cluster = make_cluster()
    cluster.start()
    cluster.create("hall")
    placement = cluster.whole()
    third = cluster.nodes[max(placement.names, key=placement.names.count)]
    claimants = [name for name in cluster.nodes if name != third.name]
    sent = 0
    for _ in range(ROUNDS):
        for node in cluster.awake:
            node.kill()
        # All shards are without an owner, and both see so at the same time.
        cluster.start(*claimants)
        claimed = cluster.whole()
        assert set(claimed.names) <= set(claimants)
        assert all(new > old for new, old in zip(claimed.terms, placement.terms))
        sent = post(cluster, sent)
        cluster.start(third.name)
        joined = cluster.await_part(third)
        assert all(new >= old for new, old in zip(joined.terms, claimed.terms))
        # And now those of the third one are.
        third.kill()
        placement = cluster.whole()
        assert set(placement.names) <= set(claimants)
        orphaned = [shard for shard, name in enumerate(joined.names) if name == third.name]
        assert all(placement.terms[shard] > joined.terms[shard] for shard in orphaned)
        sent = post(cluster, sent)
    cluster.assert_holds({"hall": sent})


def post(cluster: Cluster, first: int) -> int:
    """A message through each node; the number of samples that are on disk then."""
    for node in cluster.awake:
        path = samples_path("hall", AGENT)
        answer = insist(node.url, "POST", path, message(first, BATCH), CBOR)
        first += BATCH
        assert answer["watermark"]["durable"] == first, answer
    return first
