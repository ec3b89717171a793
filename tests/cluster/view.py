"""What a node says of its cluster: `GET /v1/cluster`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Optional, Tuple


@dataclass(frozen=True)
class Shard:
    """A shard, as a node sees it."""

    owner: Optional[str]
    term: int
    #: `open` is said by the owner alone; of others it is `elsewhere`.
    state: str
    #: How many spaces it has; only where it is open.
    spaces: Optional[int]


@dataclass(frozen=True)
class View:
    """A cluster, as a node sees it."""

    node: Optional[str]
    #: State of each node, by its name: `live`, `apart` or `lapsed`.
    states: Dict[str, str]
    #: The shards, by their numbers.
    shards: Tuple[Shard, ...]

    @classmethod
    def read(cls, body: Any) -> View:
        """Reads an answer."""
        owners = sorted(body["owners"], key=lambda each: int(each["shard"]))
        assert [each["shard"] for each in owners] == list(range(body["shards"])), body
        shards = tuple(
            Shard(each["owner"], each["term"], each["state"], each["spaces"]) for each in owners
        )
        states = {each["name"]: each["state"] for each in body["nodes"]}
        return cls(body["node"], states, shards)

    def opened(self) -> Tuple[int, ...]:
        """The shards that the node itself has open."""
        return tuple(number for number, shard in enumerate(self.shards) if shard.state == "open")


@dataclass(frozen=True)
class Placement:
    """Which node owns which shard, as all who were asked agree."""

    #: Name of the owner and its term, by the shard's number.
    owners: Tuple[Tuple[str, int], ...]

    @property
    def names(self) -> Tuple[str, ...]:
        """The owners' names, by the shards' numbers."""
        return tuple(name for name, _ in self.owners)

    @property
    def terms(self) -> Tuple[int, ...]:
        """The terms, by the shards' numbers."""
        return tuple(term for _, term in self.owners)


def agreement(views: Dict[str, View]) -> Optional[Placement]:
    """The placement, if each shard is open at exactly one of the nodes that were asked, and all of
    them name that one as its owner."""
    n_shards = len(next(iter(views.values())).shards)
    owners = []
    for number in range(n_shards):
        seen = {name: view.shards[number] for name, view in views.items()}
        opened = [name for name, shard in seen.items() if shard.state == "open"]
        if len(opened) != 1 or any(shard.owner != opened[0] for shard in seen.values()):
            return None
        owners.append((opened[0], seen[opened[0]].term))
    return Placement(tuple(owners))
