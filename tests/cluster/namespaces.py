"""Nodes in network namespaces of their own, between which packets can be lost.

A cut relay closes its connections, and a frozen one still takes new ones. Where packets are lost
nobody is told anything, as when a switch or a radio link fails.

Each node has three links: one to the tests, which is never cut, one to a switch that all nodes
share, and one to a switch that all share with the storage. The addresses are of the block for
benchmarks of networks (RFC 2544).
"""

from __future__ import annotations

import os
import shutil
import subprocess
from typing import Dict, List

from host import Host
from storage import Storage
from storage_relay import StorageRelay
from wiring import Wiring

#: The two switches, by the name of a link to them.
NODES, STORAGE = "nodes", "storage"
_SWITCHES = {NODES: 0, STORAGE: 1}
#: Where the tests, and before the storage a relay, are at the switch of the storage.
_STORAGE_ADDRESS = "198.19.1.254"


def can_make_namespaces() -> bool:
    """Whether this process may make network namespaces and links."""
    if shutil.which("ip") is None:
        return False
    name = f"cogmap-{os.getpid()}-try"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True, check=False)
    if made.returncode != 0:
        return False
    link = ["ip", "link", "add", "lo1", "netns", name, "type", "veth", "peer", "name", "lo2"]
    linked = subprocess.run([*link, "netns", name], capture_output=True, check=False)
    subprocess.run(["ip", "netns", "del", name], check=True)
    return linked.returncode == 0


class Namespaces(Wiring):
    """A namespace for each node and one for the switches."""

    def __init__(self) -> None:
        self._prefix = f"cogmap-{os.getpid()}"
        self._numbers: Dict[str, int] = {}
        self._namespaces: List[str] = []
        self._relay: List[StorageRelay] = []
        self._switches = self._namespace("switches")
        for switch in _SWITCHES:
            _ip("-n", self._switches, "link", "add", switch, "type", "bridge")
            _ip("-n", self._switches, "link", "set", switch, "up")
        # Its other end goes with the namespace.
        self._plug("tests", "", STORAGE, f"{_STORAGE_ADDRESS}/24")

    def host(self, node: str) -> Host:
        number = self._numbers[node] = len(self._numbers) + 1
        namespace = self._namespace(node)
        _ip("-n", namespace, "link", "set", "lo", "up")
        here, there = f"198.18.{number}.1", f"198.18.{number}.2"
        outer = self._outer(number)
        _ip("link", "add", outer, "type", "veth", "peer", "name", "tests", "netns", namespace)
        _ip("address", "add", f"{here}/30", "dev", outer)
        _ip("link", "set", outer, "up")
        _ip("-n", namespace, "address", "add", f"{there}/30", "dev", "tests")
        _ip("-n", namespace, "link", "set", "tests", "up")
        for switch in _SWITCHES:
            self._plug(node, namespace, switch, f"{self._address(node, switch)}/24")
        return Host(
            enter=("ip", "netns", "exec", namespace),
            listens="0.0.0.0",
            reached=there,
            inner=self._address(node, NODES),
        )

    def endpoint(self, node: str, storage: Storage) -> str:
        if not self._relay:
            self._relay.append(StorageRelay(storage.port, _STORAGE_ADDRESS))
        return self._relay[0].endpoint

    def lose(self, node: str, switch: str) -> None:
        """From now on no packet passes between a node and a switch."""
        _ip("-n", self._switches, "link", "set", f"{switch}-{node}", "nomaster")

    def mend(self, node: str, switch: str) -> None:
        """Lets packets pass again."""
        _ip("-n", self._switches, "link", "set", f"{switch}-{node}", "master", switch)

    def close(self) -> None:
        """Takes all down; a second time there is nothing left."""
        while self._relay:
            self._relay.pop().close()
        while self._namespaces:
            _ip("netns", "del", self._namespaces.pop())
        # Where a namespace goes its links go, and with them their other ends, some time later.
        for outer in (self._storage_end, *map(self._outer, self._numbers.values())):
            subprocess.run(["ip", "link", "del", outer], capture_output=True, check=False)

    @property
    def _storage_end(self) -> str:
        return f"cm{os.getpid()}s"

    def _outer(self, number: int) -> str:
        """The tests' end of their link to a node."""
        return f"cm{os.getpid()}n{number}"

    def _address(self, node: str, switch: str) -> str:
        return f"198.19.{_SWITCHES[switch]}.{self._numbers[node]}"

    def _namespace(self, name: str) -> str:
        namespace = f"{self._prefix}-{name}"
        _ip("netns", "add", namespace)
        self._namespaces.append(namespace)
        return namespace

    def _plug(self, name: str, namespace: str, switch: str, address: str) -> None:
        """Links a namespace, or the tests, with a switch."""
        port = f"{switch}-{name}"
        inside = ("-n", namespace) if namespace else ()
        end = switch if namespace else self._storage_end
        ends = ("type", "veth", "peer", "name", port, "netns", self._switches)
        _ip(*inside, "link", "add", end, *ends)
        _ip(*inside, "address", "add", address, "dev", end)
        _ip(*inside, "link", "set", end, "up")
        _ip("-n", self._switches, "link", "set", port, "master", switch, "up")


def _ip(*arguments: str) -> None:
    done = subprocess.run(["ip", *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"ip {' '.join(arguments)}: {done.stderr}"
