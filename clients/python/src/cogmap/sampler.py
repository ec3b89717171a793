"""The methods by which a robot says what it did, felt and saw."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Iterable, Optional, Tuple, Union, cast

from .sample import (
    Descriptor,
    EndObject,
    IdentifyObject,
    Increment,
    LandmarkTarget,
    LearnObject,
    Level,
    Marker,
    MotionNoise,
    NoTurn,
    ObjectMark,
    Orientation,
    Relation,
    SampleBody,
    Sighting,
    StartPose,
    Target,
    TouchNoise,
    Velocity,
)
from .vector import IDENTITY, Quaternion, Vec3


class Sampler(ABC):
    """One method for each kind of sample.

    Each returns the sample's sequence number. `stamp_ns` is the time on the sensor's clock; without it,
    the time of the call, though never before an earlier stamp of the session.

    Any iterable of numbers is a vector, a numpy array included; the messages turn it into a tuple of
    floats. A value that the service would refuse for good raises `InvalidValue`, and no sample is made.
    """

    def __init__(self, motion_noise: Optional[MotionNoise]) -> None:
        self._motion_noise = motion_noise

    @abstractmethod
    def _send(self, body: SampleBody, stamp_ns: Optional[int]) -> int:
        """Takes a sample on its way and returns its number."""

    def increment(
        self,
        translation_m: Iterable[float],
        rotation_xyzw: Iterable[float] = IDENTITY,
        *,
        stamp_ns: Optional[int] = None,
        noise: Optional[MotionNoise] = None,
    ) -> int:
        """Motion as a displacement since the previous motion sample, in the body frame at its start."""
        body = Increment(
            cast(Vec3, translation_m),
            cast(Quaternion, rotation_xyzw),
            noise if noise is not None else self._motion_noise,
        )
        return self._send(body, stamp_ns)

    def velocity(
        self,
        linear_m_s: Iterable[float],
        angular_rad_s: Iterable[float],
        duration_s: float,
        *,
        stamp_ns: Optional[int] = None,
        noise: Optional[MotionNoise] = None,
    ) -> int:
        """Motion as a body twist held over the `duration_s` that end at the stamp."""
        body = Velocity(
            cast(Vec3, linear_m_s),
            cast(Vec3, angular_rad_s),
            duration_s,
            noise if noise is not None else self._motion_noise,
        )
        return self._send(body, stamp_ns)

    def level(
        self,
        channel: str,
        value: float,
        *,
        offset_m: Iterable[float] = (0.0, 0.0, 0.0),
        normal: Optional[Iterable[float]] = None,
        stamp_ns: Optional[int] = None,
    ) -> int:
        """A scalar felt on a channel, by a sensor at `offset_m` in the body frame."""
        body = Level(
            channel,
            value,
            cast(Vec3, offset_m),
            None if normal is None else cast(Vec3, normal),
        )
        return self._send(body, stamp_ns)

    def descriptor(
        self, channel: str, vector: Iterable[float], *, stamp_ns: Optional[int] = None
    ) -> int:
        """A direction in descriptor space seen on a channel: 8 to 4096 numbers."""
        return self._send(Descriptor(channel, cast(Tuple[float, ...], vector)), stamp_ns)

    def sighting(
        self, target: Union[str, Target], relation: Relation, *, stamp_ns: Optional[int] = None
    ) -> int:
        """A target seen from the body: a landmark by its label, an `AgentTarget`, or an
        `OwnSampleTarget`; at a `Position`, a `RangeBearing` or a `RelativePose`."""
        if isinstance(target, str):
            target = LandmarkTarget(target)
        return self._send(Sighting(target, relation), stamp_ns)

    def start_pose(
        self,
        translation_m: Iterable[float],
        rotation_xyzw: Iterable[float] = IDENTITY,
        *,
        stamp_ns: Optional[int] = None,
        noise: Optional[MotionNoise] = None,
    ) -> int:
        """Where the agent stands in `map`, told from outside; exact unless `noise` is given."""
        body = StartPose(cast(Vec3, translation_m), cast(Quaternion, rotation_xyzw), noise)
        return self._send(body, stamp_ns)

    def marker(self, label: str, *, ends_trip: bool = False, stamp_ns: Optional[int] = None) -> int:
        """A named moment; may end the trip under way."""
        return self._send(Marker(label, ends_trip), stamp_ns)

    def learn_object(
        self,
        name: Optional[str] = None,
        *,
        spacing_m: float = 0.004,
        orientation: Orientation = NoTurn(),
        noise: TouchNoise = TouchNoise(),
        stamp_ns: Optional[int] = None,
    ) -> int:
        """What is felt from here on teaches an object, until `end_object`."""
        return self._send(ObjectMark(LearnObject(name, spacing_m, orientation, noise)), stamp_ns)

    def identify_object(
        self,
        *,
        orientation: Orientation = NoTurn(),
        noise: TouchNoise = TouchNoise(),
        stamp_ns: Optional[int] = None,
    ) -> int:
        """What is felt from here on is to be recognised, until `end_object`."""
        return self._send(ObjectMark(IdentifyObject(orientation, noise)), stamp_ns)

    def end_object(self, *, stamp_ns: Optional[int] = None) -> int:
        """The episode with an object ends."""
        return self._send(ObjectMark(EndObject()), stamp_ns)
