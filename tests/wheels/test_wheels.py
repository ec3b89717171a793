"""The wheels in target/wheels on a bare machine: a new virtual environment, and no Rust.

Not a part of the gate, for the binary in the wheel is an optimised one, which takes minutes to
build: `make wheels-check` builds the wheels and runs this.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Dict, Iterator, List, Union

import pytest

from port import Port
from wait import eventually

ROOT = Path(__file__).parents[2]
#: Where `make wheels` puts them.
WHEELS = Path(os.environ.get("COGMAP_WHEELS", ROOT / "target" / "wheels")).resolve()
#: Longest run of a command: the installation waits for the package index [s].
_COMMAND_S = 300.0
#: The robot of the client's page.
_ROBOT_PAGE = ROOT / "clients" / "python" / "README.md"


class Machine:
    """A virtual environment with the wheels, and nothing else on the path than the system."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.programs = home / "venv" / "bin"
        subprocess.run([sys.executable, "-m", "venv", str(home / "venv")], check=True)
        # Ours must be those that were just built; what they depend on may come from the index.
        ours = [str(wheel) for wheel in sorted(WHEELS.glob("*.whl"))]
        assert len(ours) == 2, f"{WHEELS} has {ours}: run `make wheels` first"
        self.run("pip", "install", "--quiet", "--no-index", "--no-deps", *ours)
        self.run("pip", "install", "--quiet", *self._dependencies())

    def _dependencies(self) -> List[str]:
        text = self.run(
            "python",
            "-c",
            "from importlib.metadata import requires\n"
            "print('\\n'.join((requires('cogmap') or []) + (requires('cogmap-server') or [])))",
        )
        return [line for line in text.splitlines() if line and "extra ==" not in line]

    def environment(self) -> Dict[str, str]:
        """The caller's environment, without what this project sets, and without its programs."""
        path = f"{self.programs}:/usr/bin:/bin"
        kept = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("COGMAP_", "PYTHON", "CARGO", "RUST"))
        }
        return {**kept, "PATH": path, "HOME": str(self.home)}

    def run(self, program: str, *arguments: Union[str, Path]) -> str:
        """Runs a program of the environment to its end, a good one."""
        done = subprocess.run(
            [str(self.programs / program), *map(str, arguments)],
            cwd=self.home,
            env=self.environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            timeout=_COMMAND_S,
        )
        assert done.returncode == 0, f"{done.args} ended with {done.returncode}: {done.stderr}"
        return done.stdout


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    return Machine(tmp_path_factory.mktemp("machine"))


@pytest.fixture
def endpoint(machine: Machine, tmp_path: Path) -> Iterator[str]:
    """The Zenoh endpoint of a running service."""
    http, zenoh = Port(), Port()
    endpoint = f"tcp/127.0.0.1:{zenoh.number}"
    command = [str(machine.programs / "cogmap"), "serve", "--data-dir", str(tmp_path / "data")]
    command += ["--http", f"127.0.0.1:{http.number}", "--zenoh", endpoint]
    with (tmp_path / "log").open("wb") as log:
        service = subprocess.Popen(command, env=machine.environment(), stdout=log, stderr=log)

    def ready() -> bool:
        assert service.poll() is None, (tmp_path / "log").read_text()
        try:
            urllib.request.urlopen(f"http://127.0.0.1:{http.number}/readyz").close()
        except OSError:
            return False
        return True

    try:
        eventually("readiness", ready)
        yield endpoint
    finally:
        service.terminate()
        assert service.wait(_COMMAND_S) == 0


def test_the_client_brings_the_module_and_the_service_the_program(machine: Machine) -> None:
    owners = machine.run(
        "python",
        "-c",
        "from importlib.metadata import files\n"
        "for name in ('cogmap', 'cogmap-server'):\n"
        "    for file in files(name):\n"
        "        print(name, file.locate().resolve())\n",
    )
    found = {file: owner for owner, file in (line.split(" ", 1) for line in owners.splitlines())}
    assert found[str(machine.programs / "cogmap")] == "cogmap-server"
    where = machine.run("python", "-c", "import cogmap; print(cogmap.__file__)").strip()
    assert found[where] == "cogmap"
    assert not [file for file, owner in found.items() if owner == "cogmap" and "/bin/" in file]


def test_both_are_of_one_version(machine: Machine) -> None:
    versions = machine.run(
        "python",
        "-c",
        "from importlib.metadata import version\n"
        "print(version('cogmap'), version('cogmap-server'))",
    ).split()
    program = machine.run("cogmap", "--version").split()[-1]
    assert versions == [program, program]


def test_the_demo_runs(machine: Machine) -> None:
    told = json.loads(machine.run("cogmap", "demo", "--duration", "5s", "--json"))
    assert told["samples_durable"] == told["samples_sent"] > 0
    assert told["robots"]


def test_a_robot_in_ten_lines_is_localized(machine: Machine, endpoint: str) -> None:
    page = _ROBOT_PAGE.read_text()
    program, behind = page.split("```python\n", 1)[1].split("```", 1)
    printed = behind.split("```text\n", 1)[1].split("```", 1)[0]
    (machine.home / "robot.py").write_text(re.sub(r"tcp/[\d.:]+", endpoint, program))
    assert machine.run("python", "robot.py") == printed
