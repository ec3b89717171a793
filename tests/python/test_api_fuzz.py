"""The HTTP interface keeps what its description promises, whatever is asked of it."""

from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path

from binary import environment
from feeder import drive
from server import Server

CONFIG = Path(__file__).with_name("schemathesis.toml")
#: Names of what is there, in place of made-up ones.
NAMES = """
[parameters]
"path.space" = "default"

[[operations]]
include-operation-id = "get_agent_grid"
parameters = { "path.agent" = "ada" }

[[operations]]
include-operation-id = "get_landmark"
parameters = { "path.id" = "post 1" }
"""
#: Most requests for each operation of a phase.
EXAMPLES = 30
#: Longest run, on a machine that is busy with other tests [s].
FUZZ_S = 600.0


def fill(service: Server) -> None:
    """Gives a service something to find and to page through."""
    for agent, seed in (("ada", 1), ("bea", 2)):
        with service.robot(agent) as robot:
            samples = list(itertools.islice(drive(seed), 1000))
            robot.send(samples)
            robot.marker("home", ends_trip=True, stamp_ns=samples[-1].stamp_ns)


def fuzz(service: Server, directory: Path, config: Path, *options: str) -> None:
    """Asks the service whatever its description allows and more, and checks each answer."""
    program = Path(sys.executable).with_name("schemathesis")
    command = [str(program), "--config-file", str(config), "run", f"{service.url}/openapi.json"]
    command += ["--checks", "all", "--max-examples", str(EXAMPLES), *options]
    # Streams do not end by themselves; the tests of the client follow them.
    command += ["--exclude-operation-id", "follow_events", "--exclude-operation-id", "watch_space"]
    # What failed has to be seen whole, and none of it is secret.
    command += ["--output-sanitize", "false", "--no-color"]
    done = subprocess.run(
        command,
        cwd=directory,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=FUZZ_S,
    )
    assert done.returncode == 0, done.stdout
    assert service.client().ready()


def test_whatever_is_asked_is_answered_as_described(service: Server, tmp_path: Path) -> None:
    fill(service)
    fuzz(service, tmp_path, CONFIG)


def test_what_is_there_is_answered_as_described(service: Server, tmp_path: Path) -> None:
    fill(service)
    config = tmp_path / "schemathesis.toml"
    config.write_text(CONFIG.read_text() + NAMES)
    removing = ("create_space", "delete_space", "remove_agent")
    kept = [option for name in removing for option in ("--exclude-operation-id", name)]
    fuzz(service, tmp_path, config, "--phases", "fuzzing", "--mode", "positive", *kept)
