"""What a pose says in the terms of whoever drives by it."""

from __future__ import annotations

import math
from typing import Tuple

from .array import Floats, floats, symmetric
from .vector import Quaternion, Vec3

#: Where the variances stand in the upper triangle of a 6 × 6 covariance.
_VARIANCES = (0, 6, 11, 15, 18, 20)


class PoseReadings:
    """Readings of a pose in `map`; for classes with `translation_m` and `rotation_xyzw`."""

    translation_m: Vec3
    rotation_xyzw: Quaternion

    @property
    def position(self) -> Vec3:
        """Position [m]: x, y, z along the axes of `map`."""
        return self.translation_m

    @property
    def yaw_rad(self) -> float:
        """Heading in the x-y plane of `map`, left positive, in (-π, π] [rad]: the yaw of REP
        103."""
        x, y, z, w = self.rotation_xyzw
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    def transform(self) -> Floats:
        """The 4 × 4 homogeneous transform from the body frame into `map` [m]: an array where numpy
        is installed, else nested tuples."""
        x, y, z, w = self.rotation_xyzw
        px, py, pz = self.translation_m
        rows = (
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), px),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), py),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), pz),
            (0.0, 0.0, 0.0, 1.0),
        )
        return floats(rows, 4, 4)

    def _pose_text(self) -> str:
        x, y, z = self.translation_m
        return f"x {x:.3f} y {y:.3f} z {z:.3f} m, yaw {self.yaw_rad:.3f} rad"


class UncertainPoseReadings(PoseReadings):
    """The same of a pose with a `covariance`: the upper triangle, row by row, of the 6 × 6
    covariance of (x, y, z, rotation about x, y, z) along the axes of `map` [m², m·rad, rad²]."""

    covariance: Tuple[float, ...]

    @property
    def sd_m(self) -> float:
        """Standard deviation of the position [m]: the root mean square distance of the true
        position, by which the service tells the status."""
        return root(sum(self.covariance[at] for at in _VARIANCES[:3]))

    @property
    def yaw_sd_rad(self) -> float:
        """Standard deviation of the rotation about the z axis of `map` [rad]."""
        return root(self.covariance[_VARIANCES[5]])

    def covariance_matrix(self) -> Floats:
        """The covariance as a symmetric 6 × 6 matrix: an array where numpy is installed, else
        nested tuples."""
        return symmetric(self.covariance, 6)

    def _uncertain_pose_text(self) -> str:
        return f"{self._pose_text()}, sd {self.sd_m:.3f} m {self.yaw_sd_rad:.3f} rad"


def root(variance: float) -> float:
    """The standard deviation; rounding may have left a variance a little below zero."""
    return 0.0 if variance < 0 else math.sqrt(variance)
