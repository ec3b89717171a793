"""Where an agent was."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from .vector import Quaternion, Vec3


@dataclass(frozen=True)
class StampedPose:
    """A pose at a time."""

    stamp_ns: int
    translation_m: Vec3
    rotation_xyzw: Quaternion


@dataclass(frozen=True)
class Trajectory:
    """A trajectory."""

    agent: str
    #: Session of the agent.
    session: int
    #: Frame; always `map`.
    frame: str
    #: `causal`: each pose as it was known when its sample was applied. `refined`: by all that has been
    #: seen since.
    kind: str
    #: Poses, oldest first.
    poses: Tuple[StampedPose, ...]
    #: Where the next page begins; absent on the last one.
    next_from_ns: Optional[int] = None
    #: Number of records that a refined trajectory takes into account; absent of a causal one.
    map_revision: Optional[int] = None
