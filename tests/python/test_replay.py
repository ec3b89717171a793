"""Recordings that `cogmap-lab replay` sends through a running service make the map that they make
in the core, to the last bit, in batches of any size."""

from __future__ import annotations

import json
import math
import random
import struct
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple

import pytest

from binary import lab
from conftest import MakeServer
from server import Server

Write = Callable[[Path], None]


def rounds() -> List[Tuple[float, float, float]]:
    """Four rounds of ten seconds on a circle: stamp [s], x and y [m]."""
    stamps = [k / 10 for k in range(401)]
    turns = [stamp * math.tau / 10 for stamp in stamps]
    return [(t, 10 * math.sin(turn), -10 * math.cos(turn)) for t, turn in zip(stamps, turns)]


def write_tuc(directory: Path) -> None:
    """Odometry whose gyroscope drifts, with a match of every second with a round before, and as
    many false ones."""
    draw = random.Random(1)
    speed, turn = 10 * math.tau / 10, math.tau / 10
    lines = []
    for k, (t, _, _) in enumerate(rounds()):
        motion = f"{speed} 0 {turn + 0.01}" if k else "0 0 0"
        lines.append(f"odom2 {t} {motion} 0.0025 0.0025 0.0001")
    for t in range(11, 40):
        lines += [f"loop {t} {t - 10} 0.5", f"loop {t} {draw.uniform(0, t - 10):.1f} 0.5"]
    (directory / "made_Input.txt").write_text("\n".join(lines) + "\n")
    truth = [f"point2 {t} {x} {y} 0 0 0 0" for t, x, y in rounds()]
    (directory / "made_GT.txt").write_text("\n".join(["angle 0 0 0", *truth]) + "\n")


def write_victoria(directory: Path) -> None:
    """A car that goes round a tree, and sees it."""
    lines = []
    for k in range(60):
        lines.append(f"ODOMETRY {k} {k + 1} 1.0 0.0 0.1 0.01 0 0 0.01 0 0.0004")
        lines.append(f"LANDMARK {k + 1} 1000 0.0 {10.0 + 0.1 * (-1) ** k} 0.04 0 0.04")
    (directory / "victoria_park.txt").write_text("\n".join(lines) + "\n")


def write_tables(directory: Path) -> None:
    """Two robots that feel the light of the room."""
    samples = ["t_s,agent,kind,f1,f2,f3,f4,f5,f6,f7"]
    truth = ["t_s,agent,x,y,z,yaw,quality"]
    for robot in ("one", "two"):
        for k in range(80):
            samples.append(f"{k},{robot},increment,0.5,0,0,0.1,0.01,0,0.01")
            samples.append(f"{k},{robot},level,light,{math.sin(k / 5):.3f}")
            truth.append(f"{k},{robot},{5 * math.sin(k / 10):.3f},{-5 * math.cos(k / 10):.3f},0,,")
    (directory / "samples.csv").write_text("\n".join(samples) + "\n")
    (directory / "truth.csv").write_text("\n".join(truth) + "\n")


@pytest.fixture
def service(make_service: MakeServer) -> Server:
    """A service that runs."""
    return make_service()


FORMATS: Dict[str, Tuple[Write, List[str]]] = {
    "tuc": (write_tuc, ["--all"]),
    "unstated": (write_tuc, ["--all", "--unstated-noise", "--setting", "length_error_sd=0.01"]),
    "victoria": (write_victoria, []),
    "csv": (write_tables, ["--one-space", "--together"]),
}


@pytest.mark.parametrize("name", FORMATS)
def test_a_replay_through_a_service_is_that_in_the_core(
    name: str, service: Server, tmp_path: Path
) -> None:
    write, options = FORMATS[name]
    write(tmp_path)
    command = "tuc" if name == "unstated" else name

    def replayed(kind: str, *where: object) -> Tuple[Any, Dict[str, str]]:
        out = tmp_path / kind
        arguments = [command, tmp_path, *options, *where, "--out", out, "--json"]
        report = json.loads(lab("replay", *arguments))
        return report, {file.name: file.read_text() for file in sorted(out.iterdir())}

    core, ways = replayed("core")
    assert core["update_ms"]["max"] > 0
    through = ["--connect", service.endpoint, "--http", service.url, "--space", "replayed"]
    served, served_ways = replayed("served", "--batch", 7, *through)
    assert served["digest"] == core["digest"]
    assert served_ways == ways
    assert all(ways.values())
    for figure in ("samples", "places", "causal_ate_rmse_m", "refined_aligned_ate_rmse_m"):
        assert served[figure] == core[figure]


def test_a_replay_says_what_was_told(tmp_path: Path) -> None:
    write_tuc(tmp_path)
    setting = ["--setting", "length_error_sd=0.01"]
    report = json.loads(lab("replay", "tuc", tmp_path, "--all", *setting, "--json"))
    assert report["start_pose"] == "from the truth"
    assert report["settings"] == {"length_error_sd": 0.01}
    assert report["matches"] == 58
    assert 0.4 < report["false_share"] < 0.6
    # A gyroscope that drifts by 0.01 rad/s for 40 s.
    assert report["dead_reckoning_ate_rmse_m"] > 0.5


def write_views(directory: Path) -> None:
    """Two robots that go the same way, one after the other, and see it alike but for noise."""
    draw = random.Random(1)
    samples = ["t_s,agent,kind,f1,f2,f3,f4,f5,f6,f7"]
    truth = ["t_s,agent,x,y,z,yaw,quality"]
    places = [[draw.gauss(0, 1) for _ in range(32)] for _ in range(40)]
    views: List[List[float]] = []
    for robot in ("one", "two"):
        for k, place in enumerate(places):
            if k:
                samples.append(f"{k},{robot},increment,2,0,0,0,0.01,0,0.001")
            samples.append(f"{k},{robot},descriptor,camera,{len(views)}")
            views.append([x + draw.gauss(0, 0.3) for x in place])
            truth.append(f"{k},{robot},{2 * k},0,0,0,")
    (directory / "samples.csv").write_text("\n".join(samples) + "\n")
    (directory / "truth.csv").write_text("\n".join(truth) + "\n")
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': ({len(views)}, 32)}}".encode()
    numbers = b"".join(struct.pack("<32f", *view) for view in views)
    magic = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header))
    (directory / "camera.npy").write_bytes(magic + header + numbers)


def test_a_robot_is_told_where_it_is_by_its_last_views(tmp_path: Path) -> None:
    write_views(tmp_path)
    asked = ["--taught", "one", "--length", "3", "--within-m", "2.5", "--json"]
    (row,) = json.loads(lab("replay", "sequences", tmp_path, *asked))["rows"]
    assert row["agent"] == "two"
    assert row["questions"] == 37
    assert row["right"] == 1.0
    assert row["claims"] > 30
    assert row["claims_right"] == 1.0
