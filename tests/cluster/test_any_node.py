"""Any node answers for all of them, and says what it cannot answer for.

Not a part of the gate: `make drills-cluster`.
"""

from __future__ import annotations

from asking import ask, insist
from cluster import Cluster


def test_spaces_of_a_frozen_owner_are_said_to_be_missing(cluster: Cluster) -> None:
    shard = cluster.create("hall")
    owner = cluster.owner(shard)
    other = cluster.others(owner)[0]
    listed = insist(other.url, "GET", "/v1/spaces")
    assert "hall" in [space["name"] for space in listed["spaces"]]
    assert "missing_shards" not in listed
    owner.pause()
    answer = ask(other.url, "GET", "/v1/spaces")
    owner.resume()
    assert answer.is_good, answer
    assert "hall" not in [space["name"] for space in answer.body["spaces"]]
    assert shard in answer.body["missing_shards"]


def test_the_name_of_a_space_may_be_escaped(cluster: Cluster) -> None:
    cluster.create("hall")
    for node in cluster.awake:
        for name in ("hall", "h%61ll", "%68%61%6C%6C"):
            assert insist(node.url, "GET", f"/v1/spaces/{name}")["name"] == "hall", name
