"""A robot speaks Zenoh with one node, of a space that another one owns, and loses that owner."""

from __future__ import annotations

import itertools
import threading
from pathlib import Path
from typing import Iterator, List

import cogmap
from asking import insist
from circle import AGENT, SESSION, undisturbed_by
from cluster import Cluster
from feeder import Feeder, drive
from wait import LONG_S, eventually

#: Kills of an owner.
KILLS = 3
#: Samples that are acknowledged before and after each of them.
SAMPLES = 500
#: Seed of the drive.
SEED = 11
#: Samples without acknowledgement that the robot holds: they pace it.
WINDOW = 256


class Terms:
    """The terms of the estimates that a robot has heard, in their order."""

    def __init__(self, robot: cogmap.Robot) -> None:
        self._lock = threading.Lock()
        self._heard: List[int] = []
        robot.on_estimate(self._hear)

    def _hear(self, estimate: cogmap.Estimate) -> None:
        with self._lock:
            self._heard.append(int(getattr(estimate, "term")))

    @property
    def heard(self) -> List[int]:
        """All that came so far."""
        with self._lock:
            return list(self._heard)


def test_a_robot_loses_the_owner_of_its_space(cluster: Cluster, tmp_path: Path) -> None:
    shard = cluster.create("hall")
    owner = cluster.owner(shard)
    # The robot's node lives on; the others are killed in their turn when they own the space.
    near = cluster.others(owner)[0]
    with cogmap.Robot(
        "hall",
        AGENT,
        connect=near.endpoint,
        session_id=SESSION,
        window_samples=WINDOW,
        send_timeout_s=LONG_S,
        ends_session=False,
    ) as robot:
        terms = Terms(robot)
        with Feeder(robot, SEED) as feeder:
            for _ in range(KILLS):
                owner = cluster.owner(shard)
                assert owner is not near, "the placement is the same whenever the cluster is whole"
                feeder.await_told(feeder.told + SAMPLES)
                before = terms.heard[-1]
                owner.kill()
                feeder.await_told(feeder.told + SAMPLES)
                # A later owner has answered the robot.
                eventually("estimates of a later term", lambda: terms.heard[-1] > before)
                cluster.start(owner.name)
                cluster.whole()
            sent = feeder.finish()
        heard = terms.heard
    assert heard == sorted(heard), "terms never go back"
    for node in cluster.awake:
        assert cluster.durable(node, "hall") == len(sent)
    info = insist(near.url, "GET", "/v1/spaces/hall")
    assert info["map_revision"] == len(sent) + 1
    assert {"hall": info["digest"]} == undisturbed_by(tmp_path, {"hall": batches(sent)})


def batches(samples: List[cogmap.Sample]) -> Iterator[cogmap.SampleBatch]:
    """Samples in messages of a thousand."""
    left = iter(samples)
    for first in itertools.count(0, 1000):
        taken = tuple(itertools.islice(left, 1000))
        if not taken:
            return
        yield cogmap.SampleBatch(SESSION, first, taken)
