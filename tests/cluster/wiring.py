"""How the nodes of a cluster reach one another and the storage."""

from __future__ import annotations

from typing import Dict, Tuple

from host import Host
from relay import Relay
from storage import Storage
from storage_relay import StorageRelay


class Wiring:
    """Straight: every address is the one that it leads to."""

    def host(self, node: str) -> Host:
        """Where a node runs."""
        return Host()

    def link(self, source: str, target: str, endpoint: str) -> str:
        """Where a node finds another one's Zenoh, which listens at `endpoint`."""
        return endpoint

    def endpoint(self, node: str, storage: Storage) -> str:
        """Where a node finds the storage."""
        return storage.endpoint

    def close(self) -> None:
        """Ends what it has set up."""


class Relays(Wiring):
    """Every link passes a relay of its own, which can be cut."""

    def __init__(self) -> None:
        #: Before each node's storage.
        self.storage: Dict[str, StorageRelay] = {}
        self._links: Dict[Tuple[str, str], Relay] = {}

    def links_of(self, node: str) -> Tuple[Relay, ...]:
        """The links between a node and the others, whichever of them connects."""
        return tuple(relay for ends, relay in self._links.items() if node in ends)

    def link(self, source: str, target: str, endpoint: str) -> str:
        relay = self._links[source, target] = Relay(int(endpoint.rpartition(":")[2]))
        return f"tcp/127.0.0.1:{relay.port}"

    def endpoint(self, node: str, storage: Storage) -> str:
        relay = self.storage[node] = StorageRelay(storage.port)
        return relay.endpoint

    def close(self) -> None:
        for relay in (*self._links.values(), *self.storage.values()):
            relay.close()
