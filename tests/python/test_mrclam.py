"""A recorded team, published robot by robot over Zenoh, makes the map that a replay without any
network makes, to the last bit. `COGMAP_MRCLAM` names the directory of the real set 6, or the one
above it, for the same with that."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List

import pytest

import cogmap
from binary import environment, lab, run
from recording import write_recording
from server import Server
from wait import LONG_S

#: The example program.
mrclam = importlib.import_module("mrclam")
REAL = os.environ.get("COGMAP_MRCLAM")
#: Longest time for the publishing of a recording [s].
PUBLISH_S = 900.0
#: Error of dead reckoning on the real set [m], robots 1 to 5: RMSE of the position without
#: alignment, measured with an implementation in Python that shares no code with this project.
REAL_ERRORS_M = (2.678, 3.168, 3.859, 1.564, 1.759)


@dataclass(frozen=True)
class Replayed:
    """What a replay without a service says."""

    report: Any
    #: The trajectory of each robot, as TUM.
    ways: Dict[str, str]


@pytest.fixture(params=["made up", *(["real"] if REAL else [])])
def directory(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Directory of a data set."""
    if request.param == "real":
        parent = Path(str(REAL))
        nested = parent / "MRCLAM_Dataset6"
        return nested if nested.is_dir() else parent
    write_recording(tmp_path, seed=1)
    return tmp_path


@pytest.fixture
def replayed(directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Replayed:
    """The data set, replayed without a service."""
    out = tmp_path_factory.mktemp("replayed")
    report = json.loads(lab("replay", "mrclam", directory, "--out", out, "--json"))
    ways = {robot: (out / f"{robot}.causal.tum").read_text() for robot in report["robots"]}
    return Replayed(report, ways)


def publish(directory: Path, server: Server) -> None:
    """Publishes a data set as the example program does, but in sessions of the number that a replay
    has: the map remembers the sessions of trips."""
    recordings = mrclam.load(directory)
    span = mrclam.common_span(recordings)
    streams = {robot: mrclam.stream(robot, recordings, *span) for robot in recordings}
    link = cogmap.open_session(server.endpoint)
    options: Dict[str, Any] = {"session": link, "session_id": 1, "batch_samples": 1}
    # A replay ends no sessions.
    options.update(window_samples=1024, send_timeout_s=LONG_S, ends_session=False)
    robots = {n: cogmap.Robot("default", f"robot{n}", **options) for n in recordings}
    for robot in robots.values():
        assert robot.wait_for_service()
    for number, sample in mrclam.merged(streams):
        robots[number].send([sample])
    for robot in robots.values():
        robot.flush(LONG_S)
        robot.close()
    link.close()  # type: ignore[no-untyped-call]  # zenoh leaves it without a type


def assert_applied_once(server: Server, replayed: Replayed) -> None:
    """Every sample of every robot was applied once: none lost, none refused, none twice."""
    for robot, said in replayed.report["robots"].items():
        detail = server.client().agent("default", robot)
        mark, sent = detail.watermark, said["samples"]
        assert (mark.applied, mark.durable, mark.rejected) == (sent, sent, ())
        assert detail.lag_samples == 0
    samples, robots = replayed.report["samples"], len(replayed.report["robots"])
    assert server.counter("cogmap_applied_samples_total") == samples
    # One record for each agent's enrolment, one for each sample.
    assert server.client().space("default").map_revision == robots + samples


def test_a_published_team_makes_the_map_of_a_replay(
    directory: Path, replayed: Replayed, service: Server
) -> None:
    publish(directory, service)
    assert_applied_once(service, replayed)
    assert service.counter("cogmap_duplicate_samples_total") == 0
    info = service.client().space("default")
    memories = (info.digest, info.places, info.trips, info.landmarks)
    kinds = ("digest", "places", "trips", "landmarks")
    assert memories == tuple(replayed.report[kind] for kind in kinds)
    for robot, way in replayed.ways.items():
        poses = service.client().trajectory("default", robot).poses
        told = [(pose.stamp_ns, *pose.translation_m, *pose.rotation_xyzw) for pose in poses]
        assert told == rows(way), "to the last bit"
    service.terminate()
    for robot, way in replayed.ways.items():
        data = ("--data-dir", service.data)
        assert run("export", "trajectory", *data, "--agent", robot) == way
    service.start()
    assert service.client().space("default") == info, "after a restart too"


def rows(tum: str) -> List[Any]:
    """Stamp [ns], position and quaternion of each line."""
    split = [line.split(" ") for line in tum.splitlines()]
    return [(int(stamp.replace(".", "")), *map(float, pose)) for stamp, *pose in split]


def test_the_example_program_publishes_every_sample_once(
    directory: Path, replayed: Replayed, service: Server
) -> None:
    command = [sys.executable, str(mrclam.__file__), str(directory)]
    command += ["--space", "default", "--connect", service.endpoint]
    done = subprocess.run(
        command, env=environment(), stdout=subprocess.PIPE, timeout=PUBLISH_S, check=True
    )
    assert_applied_once(service, replayed)
    said = json.loads(done.stdout)
    assert {robot: (one["durable"], one["rejected"]) for robot, one in said.items()} == {
        robot: (one["samples"], 0) for robot, one in replayed.report["robots"].items()
    }
    service.terminate()
    for robot, way in replayed.ways.items():
        data = ("--data-dir", service.data)
        assert run("export", "trajectory", *data, "--agent", robot) == way


if REAL:

    @pytest.mark.parametrize("directory", ["real"], indirect=True)
    def test_dead_reckoning_errs_as_an_independent_program_says(replayed: Replayed) -> None:
        robots = replayed.report["robots"]
        errors = [robots[f"robot{n}"]["dead_reckoning_ate_rmse_m"] for n in range(1, 6)]
        assert errors == pytest.approx(REAL_ERRORS_M, rel=0.02)


def test_another_recording_makes_another_map(tmp_path: Path) -> None:
    digests = set()
    for seed in (1, 2):
        write_recording(tmp_path, seed)
        digests.add(json.loads(lab("replay", "mrclam", tmp_path, "--json"))["digest"])
    assert len(digests) == 2, "or equal digests would prove nothing"
