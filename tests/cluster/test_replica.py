"""A node that does not own a space answers questions about it, where the question allows that."""

from __future__ import annotations

import json
import statistics
import time
import urllib.error
import urllib.request
from dataclasses import dataclass
from typing import Any, List, Optional

from asking import insist
from circle import AGENT, batch, undisturbed
from cluster import Cluster, Node
from cogmap.wire import CBOR, encode
from conftest import MakeCluster
from figures import report
from wait import eventually

#: Messages of which the lag is measured, and samples of each.
MESSAGES = 60
SAMPLES = 10
#: Lag of a replica behind the acknowledgement that is promised, the median [s].
LAG_S_MAX = 0.15
#: How old an answer may be that the questions here put up with [ms].
MAX_AGE_MS = 5000


@dataclass(frozen=True)
class Told:
    """What a node says of the robot."""

    durable: int
    #: How old the answer may be [ms]; `None` where it came from the owner.
    age_ms: Optional[int]
    revision: Optional[int]


def told(node: Node, space: str) -> Optional[Told]:
    """What a node says of the robot, as old as it likes to be; `None` if it says nothing."""
    path = f"/v1/spaces/{space}/agents/{AGENT}?max_age_ms={MAX_AGE_MS}"
    try:
        with urllib.request.urlopen(node.url + path, timeout=5) as answer:
            body: Any = json.load(answer)
            age, revision = (
                answer.headers.get(name) for name in ("cogmap-age-ms", "cogmap-map-revision")
            )
    except (OSError, urllib.error.HTTPError):
        return None
    whole = [None if value is None else int(value) for value in (age, revision)]
    return Told(body["watermark"]["durable"], *whole)


def follows(node: Node, space: str, samples: int) -> Optional[Told]:
    """What a node says by its replica, once that has so many samples."""
    answer = told(node, space)
    if answer is None or answer.age_ms is None or answer.durable < samples:
        return None
    return answer


def send(cluster: Cluster, node: Node, space: str, first: int) -> int:
    """Sends a message to the owner, and returns how far the samples are on disk."""
    message = encode(batch(first, SAMPLES))
    path = f"/v1/spaces/{space}/agents/{AGENT}/samples"
    answer = insist(node.url, "POST", path, message, CBOR)
    durable: int = answer["watermark"]["durable"]
    return durable


def test_replicas_answer_a_moment_later_and_while_nobody_owns_the_space(
    make_cluster: MakeCluster,
) -> None:
    cluster = make_cluster(settings=["cluster.replicas=true"])
    cluster.start()
    cluster.whole()
    shard = cluster.create("hall")
    owner = cluster.owner(shard)
    other = cluster.others(owner)[0]
    sent = send(cluster, owner, "hall", 0)
    eventually("a replica", lambda: follows(other, "hall", sent))
    lags_s: List[float] = []
    for _ in range(MESSAGES):
        sent = send(cluster, owner, "hall", sent)
        begin_s = time.monotonic()
        answer = eventually("the message at the replica", lambda: follows(other, "hall", sent))
        lags_s.append(time.monotonic() - begin_s)
        # The robot's enrolment, and its samples.
        assert answer.revision is not None and answer.revision >= sent + 1
    median_s = statistics.median(lags_s)
    report(
        "lag of a replica",
        {
            "messages": MESSAGES,
            "p50 [s]": round(median_s, 3),
            "worst [s]": round(max(lags_s), 3),
        },
    )
    assert median_s <= LAG_S_MAX
    space = f"/v1/spaces/hall?max_age_ms={MAX_AGE_MS}"
    digest = insist(other.url, "GET", space)["digest"]
    assert {"hall": digest} == undisturbed(cluster.home, {"hall": sent})
    # Nobody owns the space for a while, and what is known of it is told all the same.
    owner.kill()
    last = told(other, "hall")
    assert last is not None and last.durable == sent
    owner.start()
    cluster.whole()
