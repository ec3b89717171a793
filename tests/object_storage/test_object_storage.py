"""The store on object storage, by a real S3 server: what robots were told is there whatever ends.

Not a part of the gate, for the server is a large package: `make object-storage-check` installs it
and runs this. The gate tries the same store in a directory.
"""

from __future__ import annotations

import random
import threading
import time
from pathlib import Path
from typing import Dict, Iterator, List

import pytest

import cogmap
from binary import run
from circle import BATCH, batch, undisturbed
from server import Server
from storage import BUCKET, Storage

ROUNDS = 20
#: Messages of a round.
MESSAGES = 20
#: How long the storage or a service stands still [s].
FROZEN_S = 8.0


@pytest.fixture(scope="module")
def storage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Storage]:
    storage = Storage(tmp_path_factory.mktemp("storage"))
    with pytest.MonkeyPatch.context() as patch:
        for name, value in storage.environment().items():
            patch.setenv(name, value)
        yield storage
    storage.close()


@pytest.fixture
def url(storage: Storage, request: pytest.FixtureRequest) -> str:
    return f"s3://{BUCKET}/{request.node.name}"


def service(home: Path, name: str, settings: List[str]) -> Server:
    directory = home / name
    directory.mkdir()
    return Server(directory, settings)


def durable(server: Server) -> int:
    """How far the samples are acknowledged."""
    mark = server.client().agent("hall", "ada").watermark
    return 0 if mark is None else mark.durable


class Feeder:
    """Sends samples, one message after the other, until a service no longer takes them."""

    def __init__(self, server: Server, first: int) -> None:
        self.acknowledged = first
        self._server = server
        self._thread = threading.Thread(target=self._feed)
        self._thread.start()

    def _feed(self) -> None:
        # It is to learn at once that the service owns nothing any more.
        client = self._server.client(retry_timeout_s=0.0)
        while True:
            try:
                answer = client.post_samples("hall", "ada", batch(self.acknowledged))
            except (cogmap.ApiError, OSError):
                return
            self.acknowledged = answer.watermark.durable

    def join(self) -> int:
        """How far samples were acknowledged when it was refused or cut off."""
        self._thread.join()
        return self.acknowledged


def test_what_was_acknowledged_is_there_after_each_kill(url: str, tmp_path: Path) -> None:
    chance = random.Random(7)
    server = service(tmp_path, "service", [f"store.url={url}"])
    server.start()
    server.client().create_space("hall")
    acknowledged = 0
    for _ in range(ROUNDS):
        feeder = Feeder(server, acknowledged)
        time.sleep(chance.uniform(0.05, 0.5))
        server.kill()
        told = feeder.join()
        server.start()
        if told > 0:
            acknowledged = durable(server)
            assert acknowledged >= told
    digest = server.client().space("hall").digest
    server.close()
    assert acknowledged > ROUNDS * BATCH
    assert digest == undisturbed(tmp_path, {"hall": acknowledged})["hall"]


def test_a_service_that_was_taken_over_from_writes_nothing(url: str, tmp_path: Path) -> None:
    servers = [service(tmp_path, name, [f"store.url={url}"]) for name in ("one", "two")]
    servers[0].start()
    servers[0].client().create_space("hall")
    acknowledged = 0
    for number in range(ROUNDS):
        owner, other = servers[number % 2], servers[(number + 1) % 2]
        feeder = Feeder(owner, acknowledged)
        time.sleep(0.3)
        owner.pause()
        other.start()
        reached = durable(other)
        for _ in range(MESSAGES):
            reached = other.client().post_samples("hall", "ada", batch(reached)).watermark.durable
        owner.resume()
        told = feeder.join()
        assert told <= reached, "the old owner has acknowledged something"
        assert durable(other) == reached
        with pytest.raises(cogmap.ApiError, match="taken over"):
            owner.client(retry_timeout_s=0.0).post_samples("hall", "ada", batch(reached))
        owner.terminate()
        acknowledged = reached
    last = servers[ROUNDS % 2]
    digest = last.client().space("hall").digest
    last.close()
    assert digest == undisturbed(tmp_path, {"hall": acknowledged})["hall"]


def test_while_the_storage_stands_still_watermarks_do(
    url: str, storage: Storage, tmp_path: Path
) -> None:
    server = service(tmp_path, "service", [f"store.url={url}"])
    server.start()
    server.client().create_space("hall")
    server.client().post_samples("hall", "ada", batch(0))
    storage.freeze()
    try:
        feeder = Feeder(server, BATCH)
        time.sleep(FROZEN_S)
        assert durable(server) == BATCH
        assert server.client().ready(), "it goes on answering"
    finally:
        storage.thaw()
    deadline = time.monotonic() + FROZEN_S
    while durable(server) <= 2 * BATCH and time.monotonic() < deadline:
        time.sleep(0.05)
    server.kill()
    told = feeder.join()
    assert told > 2 * BATCH, "nothing is refused"
    server.start()
    assert durable(server) >= told
    server.close()


def test_a_store_goes_there_and_back(url: str, tmp_path: Path) -> None:
    local = service(tmp_path, "local", [])
    local.start()
    local.client().create_space("hall")
    local.client().post_samples("hall", "ada", batch(0, 3000))
    digests: Dict[str, str] = {"local": local.client().space("hall").digest}
    local.terminate()
    there = run("store", "copy", local.data, url)
    remote = service(tmp_path, "remote", [f"store.url={url}"])
    remote.start()
    digests["remote"] = remote.client().space("hall").digest
    remote.terminate()
    back = service(tmp_path, "back", [])
    assert run("store", "copy", url, back.data) == there
    back.start()
    digests["back"] = back.client().space("hall").digest
    back.terminate()
    assert set(digests.values()) == {digests["local"]}
