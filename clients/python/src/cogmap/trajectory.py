"""Where an agent was."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Iterator, Optional, Tuple

from .array import Floats, Integers, floats, integers
from .pose import PoseReadings
from .vector import Quaternion, Vec3


@dataclass(frozen=True)
class StampedPose(PoseReadings):
    """A pose at a time."""

    #: Time on the sensor's clock [ns].
    stamp_ns: int
    #: Position [m].
    translation_m: Vec3
    #: Orientation, unit quaternion `[x, y, z, w]`.
    rotation_xyzw: Quaternion

    def __str__(self) -> str:
        return f"{self._pose_text()} at {self.stamp_ns} ns"


@dataclass(frozen=True)
class AgentAt(PoseReadings):
    """Where an agent was at a time."""

    agent: str
    #: Session of the agent.
    session: int
    #: Frame; always `map`.
    frame: str
    #: `causal`: as it was known then. `refined`: by all that has been seen since.
    trajectory: str
    #: The time that was asked about, on the sensor's clock [ns].
    stamp_ns: int
    #: Position [m].
    translation_m: Vec3
    #: Orientation, unit quaternion `[x, y, z, w]`.
    rotation_xyzw: Quaternion
    #: Stamp of the latest known pose that is not after it [ns].
    before_ns: int
    #: Stamp of the earliest known pose that is not before it [ns]. Between the two the agent is
    #: taken to have moved evenly.
    after_ns: int
    #: Number of records that a refined pose takes into account; absent of a causal one.
    map_revision: Optional[int] = None

    def __str__(self) -> str:
        return f"{self._pose_text()} at {self.stamp_ns} ns"


@dataclass(frozen=True)
class Trajectory:
    """A trajectory. `len` and iteration are over its poses."""

    agent: str
    #: Session of the agent.
    session: int
    #: Frame; always `map`.
    frame: str
    #: `causal`: each pose as it was known when its sample was applied. `refined`: by all that has
    #: been seen since.
    kind: str
    #: Poses, oldest first.
    poses: Tuple[StampedPose, ...]
    #: Where the next page begins; absent on the last one.
    next_from_ns: Optional[int] = None
    #: Number of records that a refined trajectory takes into account; absent of a causal one.
    map_revision: Optional[int] = None

    def __len__(self) -> int:
        return len(self.poses)

    def __iter__(self) -> Iterator[StampedPose]:
        return iter(self.poses)

    def __str__(self) -> str:
        return f"{self.kind} trajectory of {self.agent}: {len(self)} poses in {self.frame}"

    def stamps_ns(self) -> Integers:
        """Times on the sensor's clock [ns], of shape (n,): an array where numpy is installed, else
        a tuple."""
        return integers([pose.stamp_ns for pose in self.poses])

    def positions_m(self) -> Floats:
        """Positions [m], of shape (n, 3): an array where numpy is installed, else nested tuples."""
        return floats([pose.translation_m for pose in self.poses], len(self), 3)

    def rotations_xyzw(self) -> Floats:
        """Orientations, unit quaternions `[x, y, z, w]`, of shape (n, 4): an array where numpy is
        installed, else nested tuples."""
        return floats([pose.rotation_xyzw for pose in self.poses], len(self), 4)
