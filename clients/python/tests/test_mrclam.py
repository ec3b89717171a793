"""The published stream of a recorded team, from tables small enough to do by hand."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import List, Tuple

import pytest

import cogmap
import mrclam
from stand_in import StandIn

S = 1_000_000_000


@pytest.fixture
def directory(tmp_path: Path) -> Path:
    def write(name: str, text: str) -> None:
        (tmp_path / name).write_text("# comment\n" + text)

    write("Barcodes.dat", "1 11\n2 22\n3 33\n6 66\n20 99\n")
    write("Robot1_Odometry.dat", "100.0 1.0 0.5\n101.0 2.0 0.0\n101.0 3.0 -0.5\n104.0 0.0 0.0\n")
    write(
        "Robot1_Measurement.dat",
        "100.2 66 1.0 0.1\n"  # before the span
        "101.5 66 2.0 0.2\n"
        "101.5 22 2.5 -0.2\n"
        "101.25 99 3.0 0.3\n"  # rows need not be sorted
        "101.75 11 1.0 0.0\n"  # the robot itself
        "101.77 33 1.0 0.0\n"  # a robot that is not in the team
        "101.8 12345 1.0 0.0\n"  # in no table
        "103.5 66 1.0 0.0\n",  # the end of the span is not within it
    )
    write("Robot1_Groundtruth.dat", "100.0 0.0 0.0 3.0\n101.0 1.0 2.0 -3.0\n104.0 1 2 0\n")
    write("Robot2_Odometry.dat", "100.5 1.0 0.0\n103.5 0.0 0.0\n")
    write("Robot2_Measurement.dat", "101.5 66 1.0 0.0\n")
    write("Robot2_Groundtruth.dat", "99.0 5.0 5.0 0.0\n105.0 5.0 5.0 0.0\n")
    write("Robot3_Odometry.dat", "0.0 1.0 0.0\n")  # without truth: left out
    return tmp_path


def stream(directory: Path, robot: int) -> List[cogmap.Sample]:
    recordings = mrclam.load(directory)
    return mrclam.stream(robot, recordings, *mrclam.common_span(recordings))


def test_the_span_is_common_to_all_tables(directory: Path) -> None:
    recordings = mrclam.load(directory)
    assert sorted(recordings) == [1, 2]
    assert mrclam.common_span(recordings) == (100_500_000_000, 103_500_000_000)


def test_a_stream_is_cut_at_commands_and_sightings(directory: Path) -> None:
    def moved(stamp_ns: int, start_ns: int, v: float, w: float) -> Tuple[int, cogmap.SampleBody]:
        duration_s = (stamp_ns - start_ns) * 1e-9
        return stamp_ns, cogmap.Velocity((v, 0.0, 0.0), (0.0, 0.0, w), duration_s)

    def seen(stamp_ns: int, target: cogmap.Target, r: float, b: float) -> Tuple[int, object]:
        return stamp_ns, cogmap.Sighting(target, cogmap.RangeBearing(r, b, 0.15, 0.025))

    samples = stream(directory, 1)
    assert [(sample.stamp_ns, sample.body) for sample in samples[1:]] == [
        moved(101 * S, 100_500_000_000, 1.0, 0.5),
        moved(101_250_000_000, 101 * S, 3.0, -0.5),
        seen(101_250_000_000, cogmap.LandmarkTarget("landmark-20"), 3.0, 0.3),
        moved(101_500_000_000, 101_250_000_000, 3.0, -0.5),
        seen(101_500_000_000, cogmap.LandmarkTarget("landmark-6"), 2.0, 0.2),
        seen(101_500_000_000, cogmap.AgentTarget("robot2"), 2.5, -0.2),
        moved(103_500_000_000, 101_500_000_000, 3.0, -0.5),
    ]


def test_the_start_pose_lies_between_two_truths_and_turns_the_shorter_way(directory: Path) -> None:
    first = stream(directory, 1)[0]
    assert first.stamp_ns == 100_500_000_000
    assert isinstance(first.body, cogmap.StartPose)
    assert first.body.translation_m == pytest.approx((0.5, 1.0, 0.0))
    x, y, z, w = first.body.rotation_xyzw
    assert (x, y) == (0.0, 0.0)
    assert math.cos(2 * math.atan2(z, w)) == pytest.approx(-1.0), "half-way from 3 to -3 is pi"


def test_a_last_command_holds_for_a_second(directory: Path) -> None:
    moved = list(mrclam.motion([(0, [1.0, 0.0]), (2 * S, [2.0, 0.0])], [], S, 9 * S))
    assert [sample.stamp_ns for sample in moved] == [2 * S, 3 * S]


def test_times_are_exact() -> None:
    assert mrclam.parse_ns("1248444187.156") == 1_248_444_187_156_000_000
    assert mrclam.parse_ns("1.248444187156789123e9") == 1_248_444_187_156_789_123
    assert mrclam.parse_ns("0.0000000015") == 2


def test_the_team_is_merged_by_stamp_and_then_by_number(directory: Path) -> None:
    merged = mrclam.merged({robot: stream(directory, robot) for robot in (2, 1)})
    order = [(sample.stamp_ns, robot) for robot, sample in merged]
    assert order == sorted(order)
    at_start = [robot for robot, sample in merged if isinstance(sample.body, cogmap.StartPose)]
    assert at_start == [1, 2]
    robot1 = [sample for robot, sample in merged if robot == 1]
    assert robot1 == stream(directory, 1), "merging keeps each robot's own order"


def test_a_robot_is_published_whole(
    directory: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with StandIn(agent="robot1") as service:
        mrclam.main(
            [str(directory), "--space", "lab", "--connect", service.endpoint, "--robots", "1"]
        )
    assert service.journal == stream(directory, 1)
    report = json.loads(capsys.readouterr().out)
    assert (report["robot1"]["durable"], report["robot1"]["rejected"]) == (8, 0)
