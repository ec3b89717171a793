"""Landmarks that a space has learned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from .array import Floats, symmetric
from .pose import root
from .vector import Vec3


@dataclass(frozen=True)
class Landmark:
    """A landmark."""

    #: Label.
    id: str
    translation_m: Vec3
    #: Upper triangle, row by row, of the 3 × 3 covariance of the position: 6 numbers [m²].
    covariance: Tuple[float, ...]
    #: Times it was seen.
    sightings: int
    first_stamp_ns: int
    last_stamp_ns: int

    @property
    def position(self) -> Vec3:
        """Position in `map` [m]."""
        return self.translation_m

    @property
    def sd_m(self) -> float:
        """Standard deviation of the position [m]: the root mean square distance of the true one."""
        return root(self.covariance[0] + self.covariance[3] + self.covariance[5])

    def covariance_matrix(self) -> Floats:
        """The covariance as a symmetric 3 × 3 matrix [m²]: an array where numpy is installed, else
        nested tuples."""
        return symmetric(self.covariance, 3)

    def __str__(self) -> str:
        x, y, z = self.translation_m
        return f"{self.id}: x {x:.3f} y {y:.3f} z {z:.3f} m, sd {self.sd_m:.3f} m"


@dataclass(frozen=True)
class LandmarkPage:
    """One page of landmarks."""

    frame: str
    landmarks: Tuple[Landmark, ...]
    next: Optional[str] = None
