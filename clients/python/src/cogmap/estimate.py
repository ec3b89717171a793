"""Estimates: where agents are.

Positions are in metres; rotations are unit quaternions `[x, y, z, w]`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Optional, Tuple

from .pose import UncertainPoseReadings
from .vector import Quaternion, Vec3


class Status(str, Enum):
    """How an agent is localised."""

    #: Its position is known to within the space's `localized_sd_m`.
    LOCALIZED = "localized"
    #: Less well than that.
    UNCERTAIN = "uncertain"
    #: Less well than the space's `lost_sd_m`.
    LOST = "lost"
    #: A status that this version of the package does not know.
    UNKNOWN = "unknown"

    @classmethod
    def _missing_(cls, value: object) -> Status:
        return cls.UNKNOWN


@dataclass(frozen=True)
class Estimate(UncertainPoseReadings):
    """The pose of an agent as known when its sample was applied (the causal estimate)."""

    space: str
    agent: str
    #: Session of the agent.
    session: int
    #: Sequence number of the latest sample that the estimate includes.
    seq: int
    #: Stamp of that sample [ns].
    stamp_ns: int
    #: Frame of the pose: `map`; or `unplaced` while the agent is lost and nothing ties it to the
    #: map, another frame, which agents that have found one another share.
    frame: str
    #: Number of records that the map includes.
    map_revision: int
    status: Status
    #: Position [m].
    translation_m: Vec3
    #: Orientation, unit quaternion `[x, y, z, w]`.
    rotation_xyzw: Quaternion
    #: Upper triangle, row by row, of the 6 × 6 covariance of (x, y, z, rotation about x, y, z)
    #: along the axes of that frame: 21 numbers [m², m·rad, rad²].
    covariance: Tuple[float, ...]
    #: The place cell that answers strongest, if any does.
    place: Optional[int] = None
    #: Its confidence, in [0, 1]; 0 without a place.
    confidence: float = 0.0
    #: Number of the owner of the space's journal that made it: each later owner has a larger one; 0
    #: on one machine.
    term: int = 0

    def __str__(self) -> str:
        place = "" if self.place is None else f", place {self.place} ({self.confidence:.2f})"
        # How sure it is in another frame says nothing of where it is in the map.
        pose, frame = (
            (self._uncertain_pose_text(), "")
            if self.frame == "map"
            else (self._pose_text(), f", {self.frame}")
        )
        return (
            f"{self.agent} {self.status.value} in {self.space}{frame}: "
            f"{pose}{place}, sample {self.seq}"
        )
