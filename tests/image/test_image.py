"""The container image, as an engine runs it: with the rights that docker/compose.yaml leaves it.

Not a part of the gate, for it needs an engine and builds Zenoh: `make docker-check` builds the
image and runs this.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import urllib.request
import uuid
from pathlib import Path
from typing import Any, Dict, Iterator, List

import pytest

from wait import eventually

ROOT = Path(__file__).parents[2]
COMPOSE = ROOT / "docker" / "compose.yaml"
ENGINE = shlex.split(os.environ.get("ENGINE", "docker"))
IMAGE = os.environ.get("IMAGE", "cogmap")
#: What compose.yaml gives the service, as options of `run`.
CONFINED = ["--read-only", "--cap-drop=ALL", "--security-opt=no-new-privileges"]
#: The user that owns the store, in every image.
USER = 10001
#: Longest run of a command of the engine [s].
_COMMAND_S = 120.0


def try_engine(*arguments: str) -> "subprocess.CompletedProcess[str]":
    """Runs a command of the engine to its end."""
    return subprocess.run(
        [*ENGINE, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        timeout=_COMMAND_S,
    )


def engine(*arguments: str) -> str:
    """Runs a command of the engine to its end, a good one, and returns what it printed."""
    done = try_engine(*arguments)
    assert done.returncode == 0, f"{done.args} ended with {done.returncode}: {done.stderr}"
    return done.stdout.strip()


class Container:
    """A running service."""

    def __init__(self, volume: str, *environment: str) -> None:
        self.name = f"cogmap-check-{uuid.uuid4().hex[:8]}"
        publish = ["--publish=127.0.0.1::8080", f"--volume={volume}:/data"]
        settings = [f"--env={variable}" for variable in environment]
        engine("run", "--detach", f"--name={self.name}", *CONFINED, *publish, *settings, IMAGE)
        self.url = "http://" + engine("port", self.name, "8080").splitlines()[0]
        eventually("readiness", self.ready)

    def ready(self) -> bool:
        state = engine("inspect", "--format={{.State.Running}}", self.name)
        assert state == "true", engine("logs", self.name)
        try:
            self.get("/readyz")
        except OSError:
            return False
        return True

    def get(self, path: str) -> str:
        with urllib.request.urlopen(self.url + path) as answer:
            text: str = answer.read().decode()
        return text

    def post(self, path: str, body: Any) -> Any:
        head = {"Content-Type": "application/json"}
        request = urllib.request.Request(self.url + path, json.dumps(body).encode(), head)
        with urllib.request.urlopen(request) as answer:
            return json.load(answer)

    def shell(self, command: str) -> "subprocess.CompletedProcess[str]":
        return try_engine("exec", self.name, "sh", "-c", command)

    def remove(self) -> None:
        try_engine("rm", "--force", self.name)


@pytest.fixture
def volume() -> Iterator[str]:
    """A volume for one test's store."""
    name = engine("volume", "create")
    yield name
    try_engine("volume", "rm", "--force", name)


@pytest.fixture
def container(volume: str) -> Iterator[Container]:
    """A service on an empty volume."""
    container = Container(volume)
    yield container
    container.remove()


def health_check() -> List[str]:
    """The command by which an engine asks for the health, as the image says it."""
    config = json.loads(engine("image", "inspect", IMAGE))[0]
    found = config.get("Healthcheck") or config["Config"]["Healthcheck"]
    kind, *command = found["Test"]
    assert kind == "CMD"
    return [str(word) for word in command]


def test_the_health_check_tells_a_ready_service_from_another(container: Container) -> None:
    asked = try_engine("exec", container.name, *health_check())
    assert asked.returncode == 0, asked.stderr
    # A container in which nothing listens.
    word, *words = health_check()
    absent = try_engine("run", "--rm", *CONFINED, f"--entrypoint={word}", IMAGE, *words)
    assert absent.returncode != 0


def test_the_service_may_write_its_volume_alone(container: Container) -> None:
    status = container.shell("cat /proc/1/status").stdout
    fields: Dict[str, List[str]] = {}
    for line in status.splitlines():
        name, _, values = line.partition(":")
        fields[name] = values.split()
    assert fields["Uid"] == [str(USER)] * 4
    assert int(fields["CapEff"][0], 16) == 0
    assert fields["NoNewPrivs"] == ["1"]
    assert container.shell("touch /data/file && rm /data/file").returncode == 0
    for path in ("/file", "/usr/local/bin/file"):
        refused = container.shell(f"touch {path}")
        assert "Read-only file system" in refused.stderr, path


def test_samples_survive_a_kill(container: Container, volume: str) -> None:
    twist = {"linear_m_s": [0.5, 0, 0], "angular_rad_s": [0, 0, 0]}
    motion = {"velocity": {**twist, "duration_s": 0.1}}
    start = {"start_pose": {"translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1]}}
    samples = [{"stamp_ns": 0, "body": start}]
    samples += [{"stamp_ns": n * 100_000_000, "body": motion} for n in range(1, 21)]
    path = "/v1/spaces/default/agents/ada"
    batch = {"session": 1, "first_seq": 0, "samples": samples}
    container.post(f"{path}/samples", batch)
    before = json.loads(container.get(f"{path}/trajectory"))
    engine("kill", "--signal=KILL", container.name)
    container.remove()

    again = Container(volume)
    try:
        assert json.loads(again.get(f"{path}/trajectory")) == before
        x_m, _, _ = json.loads(again.get(path))["estimate"]["translation_m"]
        assert abs(x_m - 1.0) < 1e-6
    finally:
        again.remove()


def test_the_service_ends_well_when_it_is_asked_to(container: Container) -> None:
    engine("stop", "--time=30", container.name)
    status = engine("inspect", "--format={{.State.ExitCode}}", container.name)
    assert status == "0", engine("logs", container.name)


def test_the_image_carries_the_page(container: Container) -> None:
    page = container.get("/")
    assets = re.findall(r'(?:src|href)="(/?assets/[^"]+)"', page)
    assert assets, page
    for asset in assets:
        assert container.get("/" + asset.lstrip("/"))


def test_the_store_may_be_on_object_storage(volume: str) -> None:
    container = Container(volume, "COGMAP_STORE__URL=file:///data/objects")
    try:
        assert container.shell("test -d /data/objects").returncode == 0
    finally:
        container.remove()


def test_compose_takes_its_file() -> None:
    programs = (["docker-compose"], [*ENGINE, "compose"])
    for program in programs:
        try:
            found = subprocess.run([*program, "version"], stdout=subprocess.DEVNULL)
        except FileNotFoundError:
            continue
        if found.returncode == 0:
            command = [*program, "--file", str(COMPOSE), "config", "--quiet"]
            subprocess.run(command, check=True)
            return
    pytest.skip("there is no compose here")
