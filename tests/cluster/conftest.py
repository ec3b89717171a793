"""One storage for all drills, and clusters that are ended after them, whatever happens."""

from __future__ import annotations

from pathlib import Path
from typing import Callable, Generator, Iterator, List, Optional, Sequence

import pytest

from cluster import NAMES, Cluster
from namespaces import can_make_namespaces
from storage import Storage
from wiring import Relays, Wiring

MakeCluster = Callable[..., Cluster]
#: Only who may administer the network can make namespaces.
collect_ignore = [] if can_make_namespaces() else ["test_namespaces.py"]
_CLUSTERS = pytest.StashKey[List[Cluster]]()


@pytest.fixture(scope="session")
def storage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Storage]:
    """The storage."""
    storage = Storage(tmp_path_factory.mktemp("storage"))
    yield storage
    storage.close()


@pytest.fixture
def make_cluster(
    request: pytest.FixtureRequest, storage: Storage, tmp_path: Path
) -> Iterator[MakeCluster]:
    """Makes clusters, each on a store of its own: `make_cluster(names=..., wiring=...)`."""
    clusters: List[Cluster] = []
    request.node.stash[_CLUSTERS] = clusters

    def make(
        names: Sequence[str] = NAMES,
        wiring: Optional[Wiring] = None,
        settings: Sequence[str] = (),
    ) -> Cluster:
        number = len(clusters)
        store = f"{tmp_path.name}-{number}"
        cluster = Cluster(storage, tmp_path / str(number), store, names, wiring, settings)
        clusters.append(cluster)
        return cluster

    yield make
    for cluster in clusters:
        cluster.close()


@pytest.fixture
def cluster(make_cluster: MakeCluster) -> Cluster:
    """Three nodes that have settled."""
    cluster = make_cluster()
    cluster.start()
    cluster.whole()
    return cluster


@pytest.fixture
def relays() -> Relays:
    """The relays of `relayed`."""
    return Relays()


@pytest.fixture
def relayed(make_cluster: MakeCluster, relays: Relays) -> Cluster:
    """Three nodes that have settled, with a relay in each of their links."""
    cluster = make_cluster(wiring=relays)
    cluster.start()
    cluster.whole()
    return cluster


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Adds the logs of a failed test's nodes to its report."""
    report = yield
    if report.failed:
        for cluster in item.stash.get(_CLUSTERS, []):
            for name, log in cluster.log_tails().items():
                report.sections.append((f"log of {name}", log))
    return report
