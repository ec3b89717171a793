"""Poses as programs read them: positions, angles, deviations, matrices, one line of text."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import cogmap
from cogmap import array
from cogmap.wire import decode

GOLDEN = Path(__file__).resolve().parents[3] / "proto" / "golden"


def estimate(**changes: Any) -> cogmap.Estimate:
    """An estimate with variances of 1, 4 and 4 square metres, and a yaw's of 0.01."""
    variances = {0: 1.0, 6: 4.0, 11: 4.0, 15: 0.04, 18: 0.09, 20: 0.01}
    plain = cogmap.Estimate(
        space="lab",
        agent="ada",
        session=1,
        seq=12,
        stamp_ns=5,
        frame="map",
        map_revision=3,
        status=cogmap.Status.UNCERTAIN,
        translation_m=(1.0, -2.0, 0.5),
        rotation_xyzw=(0.0, 0.0, math.sin(0.6), math.cos(0.6)),
        covariance=tuple(variances.get(at, 0.0) for at in range(21)),
    )
    return replace(plain, **changes)


def test_a_pose_is_read_without_arithmetic() -> None:
    one = estimate()
    assert one.position == (1.0, -2.0, 0.5)
    assert one.yaw_rad == pytest.approx(1.2)
    assert one.sd_m == pytest.approx(3.0)
    assert one.yaw_sd_rad == pytest.approx(0.1)


@pytest.mark.parametrize("yaw", [0.0, 0.3, -0.3, 3.0, -3.0, math.pi])
@pytest.mark.parametrize("pitch, roll", [(0.0, 0.0), (0.4, -0.2), (-1.2, 2.0)])
def test_the_yaw_is_that_of_the_usual_order_of_turns(yaw: float, pitch: float, roll: float) -> None:
    quaternion = (0.0, 0.0, 0.0, 1.0)
    for axis, angle in ((2, yaw), (1, pitch), (0, roll)):
        turn = [0.0, 0.0, 0.0, math.cos(angle / 2)]
        turn[axis] = math.sin(angle / 2)
        quaternion = product(quaternion, (turn[0], turn[1], turn[2], turn[3]))
    one = estimate(rotation_xyzw=quaternion)
    assert math.cos(one.yaw_rad - yaw) == pytest.approx(1)
    forward = [row[0] for row in one.transform()][:2]
    assert math.atan2(forward[1], forward[0]) == pytest.approx(one.yaw_rad)


@pytest.mark.parametrize("yaw", [0.0, 0.3, -3.0, math.pi / 2, 7.0])
def test_a_yaw_makes_a_rotation_and_a_rotation_a_yaw(yaw: float) -> None:
    one = estimate(rotation_xyzw=cogmap.quaternion_from_yaw(yaw))
    assert math.cos(one.yaw_rad - yaw) == pytest.approx(1)
    with pytest.raises(cogmap.InvalidValue, match="^yaw_rad: "):
        cogmap.quaternion_from_yaw(math.nan)


def product(a: Any, b: Any) -> Any:
    """The product of two quaternions `[x, y, z, w]`."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def test_an_estimate_is_one_line() -> None:
    text = "ada uncertain in lab: x 1.000 y -2.000 z 0.500 m, yaw 1.200 rad, sd 3.000 m 0.100 rad"
    assert str(estimate()) == f"{text}, sample 12"
    assert str(estimate(place=4, confidence=0.75)) == f"{text}, place 4 (0.75), sample 12"
    # How sure it is where it woke up says nothing of where it is in the map.
    lost = str(estimate(frame="unplaced", status=cogmap.Status.LOST))
    assert lost == (
        "ada lost in lab, unplaced: x 1.000 y -2.000 z 0.500 m, yaw 1.200 rad, sample 12"
    )


@pytest.mark.parametrize("name", ["estimate_localized", "estimate_uncertain", "estimate_lost"])
def test_every_estimate_is_one_line(name: str) -> None:
    text = str(decode(cogmap.Estimate, (GOLDEN / f"{name}.cbor").read_bytes()))
    assert "\n" not in text and len(text) < 200


def test_a_variance_that_rounding_left_below_zero_is_none() -> None:
    assert estimate(covariance=(-1e-30,) + (0.0,) * 20).sd_m == 0.0


def way() -> cogmap.Trajectory:
    poses = tuple(
        cogmap.StampedPose(10 * step, (float(step), 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
        for step in range(3)
    )
    return cogmap.Trajectory("ada", 1, "map", "causal", poses)


def test_matrices_and_trajectories_are_arrays() -> None:
    numpy = pytest.importorskip("numpy")
    matrix = estimate().covariance_matrix()
    assert isinstance(matrix, numpy.ndarray) and matrix.shape == (6, 6)
    assert (matrix == matrix.T).all() and list(numpy.diag(matrix)) == [1, 4, 4, 0.04, 0.09, 0.01]
    transform = estimate().transform()
    assert transform[:3, 3].tolist() == [1.0, -2.0, 0.5]
    assert numpy.allclose(transform[:3, :3] @ transform[:3, :3].T, numpy.eye(3))
    landmark = cogmap.Landmark("door", (1.0, 2.0, 0.0), (4.0, 0.5, 0.0, 4.0, 0.0, 1.0), 3, 0, 1)
    assert landmark.covariance_matrix().tolist() == [[4, 0.5, 0], [0.5, 4, 0], [0, 0, 1]]
    assert landmark.sd_m == 3.0 and landmark.position == (1.0, 2.0, 0.0)
    assert way().positions_m().shape == (3, 3) and way().rotations_xyzw().shape == (3, 4)
    assert way().stamps_ns().tolist() == [0, 10, 20] and way().stamps_ns().dtype == numpy.int64
    empty = replace(way(), poses=())
    assert empty.positions_m().shape == (0, 3) and empty.stamps_ns().shape == (0,)


def test_without_numpy_they_are_tuples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numpy", None)
    matrix: Any = estimate().covariance_matrix()
    assert matrix[0] == (1.0, 0.0, 0.0, 0.0, 0.0, 0.0) and len(matrix) == 6
    positions: Any = way().positions_m()
    assert positions == ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0))
    stamps: Any = way().stamps_ns()
    assert stamps == (0, 10, 20)
    assert array.symmetric((1.0, 2.0, 3.0), 2) == ((1.0, 2.0), (2.0, 3.0))


def test_a_trajectory_is_a_sequence_of_poses() -> None:
    assert len(way()) == 3 and [pose.stamp_ns for pose in way()] == [0, 10, 20]
    assert str(way()) == "causal trajectory of ada: 3 poses in map"
    assert str(way().poses[1]) == "x 1.000 y 0.000 z 0.000 m, yaw 0.000 rad at 10 ns"
