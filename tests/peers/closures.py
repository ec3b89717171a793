#!/usr/bin/env python3
"""How far closures bring the live pose at best: iSAM2 of GTSAM that is told which matches of a TUC
set are true, and, if so wanted, how the robot stood to where it was.

The figures beside which those of `cogmap-lab replay tuc`, which is told nothing, are to be read.
"""

from __future__ import annotations

import one_thread  # isort: skip  # noqa: F401

import argparse
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Dict, List, Tuple

import gtsam
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Odometry rows between keyframes: half a second.
_ROWS = 5
#: Matches of moments that lie nearer than this are left out, as `replay tuc` does [s].
_GAP_S = 10.0
#: A match is true where the places lie nearer than this, as the set's authors count [m].
_TRUE_M = 2.0
#: Standard deviations of a match [m, m, rad]: of one that says "the same place", as `replay tuc`
#: sends it, and of one that says where the robot is from there.
_SAME = (0.5, 0.5, 0.2)
_TOLD = (0.05, 0.05, 0.02)


@dataclass(frozen=True)
class Row:
    """What one kind of match allows: RMSE of position, aligned [m]."""

    matches: str
    closures: int
    causal_m: float
    refined_m: float


class Recording:
    """A TUC set, at its keyframes."""

    def __init__(self, directory: Path) -> None:
        odometry = _rows(directory, "*_Input.txt", "odom2")
        truth = _rows(directory, "*_GT.txt", "point2")
        heading = _rows(directory, "*_GT.txt", "angle")
        index = np.arange(0, len(odometry), _ROWS)
        self.stamps_s = odometry[index, 0]
        self.truth_m = np.stack(
            [np.interp(self.stamps_s, truth[:, 0], truth[:, axis]) for axis in (1, 2)], axis=1
        )
        self.headings_rad = np.interp(self.stamps_s, heading[:, 0], np.unwrap(heading[:, 1]))
        self.steps = [self._step(odometry[a : b + 1]) for a, b in zip(index, index[1:])]
        #: Standard deviation of a step [m, m, rad]: each row is a rate with a variance.
        period_s = float(np.median(np.diff(odometry[:, 0])))
        self.step_sd = np.sqrt(odometry[1, 4:7] * _ROWS) * period_s
        matches = _rows(directory, "*_Input.txt", "loop")
        matches = matches[matches[:, 0] - matches[:, 1] > _GAP_S]
        pairs = [self._nearest(matches[:, column]) for column in (0, 1)]
        distances_m = np.linalg.norm(self.truth_m[pairs[0]] - self.truth_m[pairs[1]], axis=1)
        #: Earlier keyframes that are the same place, by keyframe.
        self.closures: Dict[int, List[int]] = {}
        for later, earlier, distance_m in zip(*pairs, distances_m):
            if distance_m < _TRUE_M:
                self.closures.setdefault(int(later), []).append(int(earlier))

    def relative(self, earlier: int, later: int) -> Any:
        """How the robot truly stood to where it was."""
        return self._true_pose(earlier).between(self._true_pose(later))

    def _true_pose(self, index: int) -> Any:
        x_m, y_m = self.truth_m[index]
        return gtsam.Pose2(float(x_m), float(y_m), float(self.headings_rad[index]))

    def _step(self, rows: Floats) -> Any:
        step = gtsam.Pose2()
        for before, row in zip(rows, rows[1:]):
            step = step.compose(gtsam.Pose2.Expmap(row[1:4] * (row[0] - before[0])))
        return step

    def _nearest(self, stamps_s: Floats) -> NDArray[np.intp]:
        nearest: NDArray[np.intp] = np.abs(self.stamps_s - stamps_s[:, None]).argmin(axis=1)
        return nearest


def main() -> int:
    """Runs what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("directory", type=Path, help="directory of a TUC set")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    args = parser.parse_args()
    recording = Recording(args.directory)
    rows = [_solve(recording, name) for name in ("same place", "relative pose")]
    if args.json:
        print(json.dumps({"rows": [asdict(row) for row in rows]}))
        return 0
    for row in rows:
        print(
            f"{row.closures} true matches, each as {row.matches}: "
            f"causal {row.causal_m:.3f} m, refined {row.refined_m:.3f} m"
        )
    return 0


def _rows(directory: Path, pattern: str, word: str) -> Floats:
    (path,) = directory.glob(pattern)
    lines = (line.split() for line in path.read_text().splitlines())
    return np.array([[float(number) for number in line[1:]] for line in lines if line[0] == word])


def _solve(recording: Recording, matches: str) -> Row:
    """The recording, keyframe by keyframe."""
    is_told = matches == "relative pose"
    closed = gtsam.noiseModel.Diagonal.Sigmas(np.array(_TOLD if is_told else _SAME))
    stepped = gtsam.noiseModel.Diagonal.Sigmas(recording.step_sd)
    solver, pose = gtsam.ISAM2(), gtsam.Pose2()
    factors, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    factors.addPriorPose2(0, pose, gtsam.noiseModel.Isotropic.Sigma(3, 1e-3))
    values.insert(0, pose)
    solver.update(factors, values)
    causal: List[Tuple[float, float]] = [(0.0, 0.0)]
    closures = 0
    for number, step in enumerate(recording.steps, start=1):
        factors, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        factors.add(gtsam.BetweenFactorPose2(number - 1, number, step, stepped))
        values.insert(number, pose.compose(step))
        for earlier in recording.closures.get(number, []):
            told = recording.relative(earlier, number) if is_told else gtsam.Pose2()
            factors.add(gtsam.BetweenFactorPose2(earlier, number, told, closed))
            closures += 1
        solver.update(factors, values)
        if number in recording.closures:
            # Some more steps of Newton's method, since a loop moves far.
            for _ in range(2):
                solver.update()
        pose = solver.calculateEstimatePose2(number)
        causal.append((pose.x(), pose.y()))
    last = solver.calculateEstimate()
    refined = [last.atPose2(number).translation() for number in range(len(causal))]
    errors = [_aligned_m(np.array(poses), recording.truth_m) for poses in (causal, refined)]
    return Row(matches, closures, *errors)


def _aligned_m(estimate: Floats, truth: Floats) -> float:
    """RMSE of position after the rigid motion that fits best."""
    moved, fixed = estimate - estimate.mean(axis=0), truth - truth.mean(axis=0)
    left, _, right = np.linalg.svd(moved.T @ fixed)
    turn = right.T @ np.diag([1.0, np.sign(np.linalg.det(right.T @ left.T))]) @ left.T
    return float(np.sqrt(((moved @ turn.T - fixed) ** 2).sum(axis=1).mean()))


if __name__ == "__main__":
    sys.exit(main())
