"""Settings of a space, fixed when it is created. The service holds the defaults."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Union

from .scalar import within


@dataclass(frozen=True)
class Novelty:
    """Recruit a place cell where no place answers with a confidence of at least one half."""

    TAG: ClassVar[str] = "novelty"


@dataclass(frozen=True)
class Bernoulli:
    """Recruit a place cell at every motion sample with this probability."""

    TAG: ClassVar[str] = "bernoulli"
    #: Probability, in [0, 1].
    probability: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "probability", within("probability", self.probability, 0.0, 1.0))


Recruitment = Union[Novelty, Bernoulli]


@dataclass(frozen=True)
class NoiseSettings:
    """What odometry gets wrong, as standard deviations: noise of motion that carries none, which
    grows with the square root of the path, and errors that last, which are learned for each
    agent."""

    #: Of the translation, per square root of metre travelled [m/√m].
    translation_sd_per_sqrt_m: float
    #: Of the rotation, per square root of metre travelled [rad/√m].
    rotation_sd_per_sqrt_m: float
    #: Of the rotation, per square root of radian turned [rad/√rad].
    rotation_sd_per_sqrt_rad: float
    #: Of the lasting relative error of lengths, e.g. of a wheel's radius.
    length_error_sd: float = 0.05
    #: Of the lasting relative error of angles, e.g. of a wheel base. 0.3 of it is that of the turn
    #: with each metre [rad/m], e.g. by wheels of different sizes.
    angle_error_sd: float = 0.1
    #: Of the lasting bias about each axis, e.g. of a gyroscope [rad/s]. A robot that stands, and
    #: turns by its odometry more slowly than three of it, reads it.
    bias_sd_rad_s: float = 0.004


@dataclass(frozen=True)
class SpaceSettings:
    """Settings of a space."""

    #: Seed of everything random in the space.
    seed: int
    #: Number of grid modules, 1 to 16.
    grid_modules: int
    #: Spacing of the finest grid module [m].
    grid_spacing_m: float
    #: Ratio of the spacings of neighbouring modules.
    grid_ratio: float
    #: Distance at which a place's confidence has fallen to one half [m].
    field_radius_m: float
    #: When a place cell is recruited.
    recruitment: Recruitment
    #: Noise of motion samples that carry none.
    odometry_noise: NoiseSettings
    #: Part of a distance by which a seen distance may be off again and again.
    lasting_range_error: float
    #: An agent is `localized` up to this standard deviation of position [m].
    localized_sd_m: float
    #: An agent is `lost` beyond this standard deviation of position [m].
    lost_sd_m: float
    #: Standing still for this long ends a trip [s].
    trip_stillness_s: float
    #: No sample for this long, on the sensor's clock, ends a trip [s].
    trip_gap_s: float
    #: Most places: for one more, the weakest is forgotten.
    places_max: int
    #: Most legs of all trips together: for one more, the weakest trip is forgotten.
    legs_max: int
    #: Most keyframes of all agents: moments that are kept, so that the past can be smoothed.
    keyframes_max: int
    #: After this many samples of the space, a use counts half as much for the strength of a place
    #: or trip.
    strength_half_life_samples: int
    #: Closest two poses of a stored trajectory [s].
    trajectory_interval_s: float
    #: Deviation of a component of a sighting from what the estimate expects, in standard
    #: deviations, beyond which the whole sighting is refused.
    sighting_gate_sd: float = 4.0
    #: The same beyond which a component of a sighting loses weight.
    sighting_huber_sd: float = 2.0
    #: Squared Mahalanobis distance up to which a loop closure agrees with the map or with another
    #: closure.
    closure_gate_chi2: float = 11.3
    #: An agent leaves a keyframe after this motion [m] at the latest.
    keyframe_spacing_m: float = 0.1
    #: The same for rotation [rad].
    keyframe_spacing_rad: float = 0.1
    #: Standard deviation of what a robot is moved along each axis between two sessions [m].
    restart_sd_m: float = 1.0
    #: Standard deviation of what it is turned about each axis between them [rad].
    restart_sd_rad: float = 0.5
    #: Probability from which on touches are answered with an object, or with none that is known.
    object_answer_probability: float = 0.995
    #: Most ways between places: for one more, the weakest is forgotten without which no places are
    #: separate.
    ways_max: int = 131_072
    #: Whether an episode that is to recognise an object learns it where it turns out to be unknown.
    learns_unknown_objects: bool = True
