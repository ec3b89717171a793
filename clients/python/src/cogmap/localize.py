"""Where samples were taken that belong to no agent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from .estimate import Status
from .limits import BATCH_SAMPLES_MAX
from .pose import UncertainPoseReadings
from .sample import Sample
from .scalar import all_of, counted
from .vector import Quaternion, Vec3


@dataclass(frozen=True)
class LocalizeQuery:
    """Asks where a sequence of samples was taken."""

    #: The samples of one robot, in order; 1 to 4096, without start poses and episodes with objects.
    samples: Tuple[Sample, ...]

    def __post_init__(self) -> None:
        samples = all_of("samples", self.samples, (Sample,))
        object.__setattr__(self, "samples", counted("samples", samples, BATCH_SAMPLES_MAX))


@dataclass(frozen=True)
class LocalizedPose(UncertainPoseReadings):
    """A pose of the body in the map."""

    #: Position [m].
    translation_m: Vec3
    #: Orientation, unit quaternion `[x, y, z, w]`.
    rotation_xyzw: Quaternion
    #: Upper triangle, row by row, of the 6 × 6 covariance of (x, y, z, rotation about x, y, z)
    #: along the axes of `map`: 21 numbers [m², m·rad, rad²].
    covariance: Tuple[float, ...]

    def __str__(self) -> str:
        return self._uncertain_pose_text()


@dataclass(frozen=True)
class LocalizationHypothesis:
    """A place where the body may have been."""

    #: Where, at the latest sample that tells of places.
    pose: LocalizedPose
    #: Its share of the evidence; all other places, and those that nobody has seen, have the rest.
    probability: float
    #: How many of the samples can be judged by what is remembered there.
    looks: int


@dataclass(frozen=True)
class Localization:
    """Where a sequence of samples was taken, by what the map knows."""

    space: str
    #: Frame of the poses; always `map`.
    frame: str
    map_revision: int
    #: How well it is known where the body was at the last sample.
    status: Status
    #: Where it was then; absent while that is not known.
    pose: Optional[LocalizedPose]
    #: Index of the sample with which it became known.
    found_after: Optional[int]
    #: Where it may have been, most probable first, while that is not known.
    hypotheses: Tuple[LocalizationHypothesis, ...]
