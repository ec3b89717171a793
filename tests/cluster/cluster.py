"""Several nodes over one store on object storage."""

from __future__ import annotations

import json
import threading
import time
from pathlib import Path
from typing import Dict, Iterable, List, Mapping, Optional, Sequence, Tuple

from asking import ask, insist
from circle import AGENT, undisturbed
from host import Host
from server import Server
from storage import BUCKET, Storage
from view import Placement, View, agreement
from wait import LONG_S, eventually
from wiring import Wiring
from writer import Writer

SHARDS = 4
NAMES = ("a", "b", "c")
#: A cluster has settled when the owners have been the same for so long [s]: four times as long as
#: live nodes have to be the same before a shard changes hands.
QUIET_S = 2.0
#: Most spaces that are made to find one of a shard: with four shards it takes more than 64 once in
#: a hundred million times.
_TRIES_MAX = 64


class Node(Server):
    """A node, as a process of its own.

    Args:
        home: Directory for its log.
        name: Its name.
        url: The store.
        variables: What tells it where the storage is.
        settings: Further settings.
        host: Where it runs.
    """

    def __init__(
        self,
        home: Path,
        name: str,
        url: str,
        variables: Mapping[str, str],
        settings: Sequence[str] = (),
        host: Host = Host(),
    ) -> None:
        home.mkdir(parents=True)
        self.name = name
        self.is_paused = False
        self._own_settings: List[str] = []
        super().__init__(home, self._own_settings, variables=variables, host=host)
        self._own_settings += [
            "cluster.enabled=true",
            f"cluster.node={name}",
            f"cluster.address={self.address}",
            f"store.url={url}",
            f"store.shards={SHARDS}",
            # Routers pass on what others say, and connect to nobody but those whom they are told.
            "zenoh.mode=router",
            *settings,
        ]

    def connect_to(self, endpoints: Iterable[str]) -> None:
        """Names the Zenoh endpoints of the others, before it starts."""
        self._own_settings.append(f"zenoh.connect={json.dumps(list(endpoints))}")

    def pause(self) -> None:
        super().pause()
        self.is_paused = True

    def resume(self) -> None:
        super().resume()
        self.is_paused = False

    def view(self) -> Optional[View]:
        """What it says of the cluster; `None` if it says nothing."""
        try:
            answer = ask(self.url, "GET", "/v1/cluster")
        except OSError:
            return None
        return View.read(answer.body) if answer.is_good else None


class Cluster:
    """The nodes of a store of their own. None of them runs at first.

    Args:
        storage: The storage.
        home: Directory for the logs.
        store: Prefix of the store in the storage's bucket.
        names: Names of the nodes.
        wiring: How they reach one another and the storage.
        settings: Further settings of all nodes.
    """

    def __init__(
        self,
        storage: Storage,
        home: Path,
        store: str,
        names: Sequence[str] = NAMES,
        wiring: Optional[Wiring] = None,
        settings: Sequence[str] = (),
    ) -> None:
        self.home = home
        #: Prefix of the store in the bucket.
        self.store = store
        self._wiring = wiring or Wiring()
        #: Who has said that a shard is open there, by shard and term.
        self._holders: Dict[Tuple[int, int], str] = {}
        self._holding = threading.Lock()
        url = f"s3://{BUCKET}/{store}"
        self.nodes: Dict[str, Node] = {}
        for name in names:
            variables = storage.environment(self._wiring.endpoint(name, storage))
            host = self._wiring.host(name)
            self.nodes[name] = Node(home / name, name, url, variables, settings, host)
        for name, node in self.nodes.items():
            others = [other for other in self.nodes.values() if other is not node]
            node.connect_to(
                self._wiring.link(name, other.name, other.endpoint) for other in others
            )

    def start(self, *names: str) -> None:
        """Starts nodes at the same instant, all that do not run if none is named, and waits until
        they are ready."""
        chosen = [self.nodes[name] for name in names] or list(self.nodes.values())
        started = [node for node in chosen if not node.runs]
        for node in started:
            node.launch()
        for node in started:
            node.await_ready()

    def close(self) -> None:
        """Ends all nodes, each of which has to end well, and the wiring."""
        errors: List[BaseException] = []
        for node in self.nodes.values():
            try:
                node.close()
            except Exception as error:  # The others have to end too.
                errors.append(error)
        self._wiring.close()
        if errors:
            raise errors[0]

    @property
    def awake(self) -> List[Node]:
        """The nodes that run and are not paused."""
        return [node for node in self.nodes.values() if node.runs and not node.is_paused]

    def others(self, *nodes: Node) -> List[Node]:
        """Those that are awake, but for some."""
        return [node for node in self.awake if node not in nodes]

    def agreed(self, nodes: Optional[Sequence[Node]] = None) -> Optional[Placement]:
        """Who owns what, if all nodes, or all of some, agree now."""
        views = self._views(self.awake if nodes is None else nodes)
        return None if views is None else agreement(views)

    def settled(self, nodes: Optional[Sequence[Node]] = None) -> Placement:
        """Waits until nothing changes hands any more among all nodes, or among some."""
        return self._unchanging(self.awake if nodes is None else nodes, needs_live=False)

    def whole(self) -> Placement:
        """The same, and until all nodes that are awake see one another."""
        return self._unchanging(self.awake, needs_live=True)

    def await_part(self, node: Node) -> Placement:
        """The same, and until a node owns something."""

        def look() -> Optional[bool]:
            placement = self.agreed()
            return placement is not None and node.name in placement.names

        eventually(f"a part of {node.name}", look)
        return self.whole()

    def _unchanging(self, nodes: Sequence[Node], needs_live: bool) -> Placement:
        names = {node.name for node in nodes}
        views: Optional[Dict[str, View]] = None
        latest: Optional[Placement] = None
        since_s = time.monotonic()

        def look() -> Optional[Placement]:
            nonlocal views, latest, since_s
            views = self._views(nodes)
            found = None if views is None else agreement(views)
            if views is not None and needs_live:
                seen = [
                    {name for name, state in view.states.items() if state == "live"}
                    for view in views.values()
                ]
                found = found if all(live == names for live in seen) else None
            if found is None or found != latest:
                latest, since_s = found, time.monotonic()
            return latest if time.monotonic() - since_s >= QUIET_S else None

        try:
            return eventually(f"a settled cluster of {sorted(names)}", look)
        except AssertionError as error:
            raise AssertionError(f"{error}; the last views: {views}") from error

    def _views(self, nodes: Sequence[Node]) -> Optional[Dict[str, View]]:
        """What nodes say; `None` if one of them says nothing. No two of them may ever say that a
        shard is open with them in the same term."""
        views: Dict[str, View] = {}
        for node in nodes:
            view = node.view()
            if view is None:
                return None
            views[node.name] = view
        with self._holding:
            for name, view in views.items():
                for shard in view.opened():
                    term = view.shards[shard].term
                    holder = self._holders.setdefault((shard, term), name)
                    assert holder == name, f"{holder} and {name} own shard {shard} in term {term}"
        return views

    def owner(self, shard: int) -> Node:
        """Waits until all agree on who owns a shard."""
        placement = eventually("agreement on who owns what", self.agreed)
        return self.nodes[placement.names[shard]]

    def await_other_owner(self, shard: int, old: Node) -> Node:
        """Waits until the others agree that another node than the old one owns a shard."""

        def look() -> Optional[Node]:
            placement = self.agreed(self.others(old))
            return None if placement is None else self.nodes[placement.names[shard]]

        return eventually(f"another owner than {old.name} of shard {shard}", look)

    def create(self, space: str) -> int:
        """Creates a space, and returns the number of its shard: the one that has one more then."""
        before = self._n_spaces()
        insist(self.awake[0].url, "PUT", f"/v1/spaces/{space}", b"{}")

        def look() -> Optional[int]:
            pairs = zip(before, self._n_spaces())
            grown = [shard for shard, (old, new) in enumerate(pairs) if new > old]
            return grown[0] if grown else None

        return eventually(f"a shard with the space {space}", look)

    def create_in(self, shard: int, name: str) -> str:
        """Creates spaces until one lies in a shard, and returns its name."""
        for number in range(_TRIES_MAX):
            space = f"{name}-{number}"
            if self.create(space) == shard:
                return space
        raise AssertionError(f"none of {_TRIES_MAX} spaces lies in shard {shard}")

    def _n_spaces(self) -> List[int]:
        """How many spaces each shard has. The cluster has settled."""

        def look() -> Optional[List[int]]:
            views = self._views(self.awake)
            if views is None or agreement(views) is None:
                return None
            counts = [0] * SHARDS
            for view in views.values():
                for shard in view.opened():
                    counts[shard] = view.shards[shard].spaces or 0
            return counts

        return eventually("the numbers of spaces", look)

    def durable(self, node: Node, space: str) -> int:
        """How far the robot's samples in a space are on disk, as a node says."""
        body = insist(node.url, "GET", f"/v1/spaces/{space}/agents/{AGENT}")
        durable: int = body["watermark"]["durable"]
        return durable

    def assert_all_there_once(self, *writers: Writer) -> None:
        """What was acknowledged, and nothing else, is in the spaces of writers, which are ended by
        this: every sample once, and in maps like those to which nothing happened."""
        self.assert_holds({writer.space: writer.finish() for writer in writers})

    def assert_holds(self, sent: Mapping[str, int]) -> None:
        """So many samples of the robot, each applied once, make up the maps of spaces, through
        whichever node one asks."""
        digests: Dict[str, str] = {}
        for space, samples in sent.items():
            assert samples > 0, f"nothing was acknowledged in {space}"
            for node in self.awake:
                agent = insist(node.url, "GET", f"/v1/spaces/{space}/agents/{AGENT}")
                mark = agent["watermark"]
                found = (mark["durable"], mark["applied"], agent["lag_samples"])
                assert found == (samples, samples, 0), f"{space} through {node.name}: {mark}"
                info = insist(node.url, "GET", f"/v1/spaces/{space}")
                # One record for the robot's enrolment, one for each sample.
                assert info["map_revision"] == samples + 1, f"{space} through {node.name}"
                assert digests.setdefault(space, info["digest"]) == info["digest"]
        assert digests == undisturbed(self.home, sent)

    def log_tails(self) -> Dict[str, str]:
        """The ends of the nodes' logs."""
        return {name: node.log_tail() for name, node in self.nodes.items()}


def assert_stays(cluster: Cluster, nodes: Sequence[Node], duration_s: float) -> None:
    """For so long no shard changes hands among nodes, of which each is asked again and again."""
    before = cluster.settled(nodes)
    deadline_s = time.monotonic() + min(duration_s, LONG_S)
    while time.monotonic() < deadline_s:
        now = cluster.agreed(nodes)
        assert now is None or now == before, f"{before} became {now}"
        time.sleep(0.1)
    assert cluster.settled(nodes) == before
