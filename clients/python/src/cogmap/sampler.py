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
    RecogniseObject,
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

    Each returns the sample's sequence number. `stamp_ns` is the time on the sensor's clock; without
    it, the time of the call, though never before an earlier stamp of the session.

    Any iterable of numbers is a vector, a numpy array included; the messages turn it into a tuple
    of floats. A value that the service would refuse for good raises `InvalidValue`, and no sample
    is made.
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
        """Motion as a displacement since the previous motion sample.

        Args:
            translation_m: Displacement [m] in the body frame at its start: x forward, y left, z up.
            rotation_xyzw: Rotation, unit quaternion `[x, y, z, w]`.
            stamp_ns: When the displacement ended, on the sensor's clock [ns].
            noise: Its standard deviations; the robot's `motion_noise`, or else the space's, when
                absent.
        """
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
        """Motion as a body twist held over the `duration_s` that end at the stamp.

        Args:
            linear_m_s: Linear velocity [m/s] in the body frame: x forward, y left, z up.
            angular_rad_s: Angular velocity about the body axes [rad/s]; z is positive to the left.
            duration_s: How long the twist was held, 0 to 3600 [s].
            stamp_ns: When it ended, on the sensor's clock [ns].
            noise: Standard deviations of the resulting increment; the robot's `motion_noise`, or
                else the space's, when absent.
        """
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
        """A scalar felt on a channel.

        Args:
            channel: Name of the channel: 1 to 64 of `A-Z a-z 0-9 _ . -`, the first a letter or a
                digit.
            value: The value, in the channel's own unit.
            offset_m: Where the sensor sits in the body frame [m].
            normal: Outward normal of the touched surface in the body frame, a unit vector.
            stamp_ns: When it was felt, on the sensor's clock [ns].
        """
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
        """What an image or a scan looks like, as a direction in descriptor space.

        Args:
            channel: Name of the channel; all its descriptors have one length.
            vector: 8 to 4096 numbers, taken in single precision; its length means nothing.
            stamp_ns: When it was seen, on the sensor's clock [ns].
        """
        return self._send(Descriptor(channel, cast(Tuple[float, ...], vector)), stamp_ns)

    def sighting(
        self, target: Union[str, Target], relation: Relation, *, stamp_ns: Optional[int] = None
    ) -> int:
        """A target seen from the body.

        Args:
            target: A landmark by its label, an `AgentTarget` by its name, or an `OwnSampleTarget`:
                where this agent was at an earlier sample, a loop closure found outside.
            relation: Where it was seen in the body frame, and how exactly: a `Position` [m], a
                `RangeBearing` [m, rad], a `RelativePose`, or a `Range` [m] alone.
            stamp_ns: When it was seen, on the sensor's clock [ns].
        """
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
        """Where the agent stands, told from outside.

        Args:
            translation_m: Position in `map` [m].
            rotation_xyzw: Orientation in `map`, unit quaternion `[x, y, z, w]`.
            stamp_ns: When it stood there, on the sensor's clock [ns].
            noise: How well it is known, along and about the body axes; exact when absent.
        """
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
        """What is felt from here on teaches an object, until `end_object`.

        Args:
            name: Its name; without one it is the object that is recognised, or a new one.
            spacing_m: Contacts within this distance are of one place of the object [m].
            orientation: How the body's frame may be turned against that of an object known before.
            noise: How exactly is felt.
            stamp_ns: When it begins, on the sensor's clock [ns].
        """
        return self._send(ObjectMark(LearnObject(name, spacing_m, orientation, noise)), stamp_ns)

    def identify_object(
        self,
        *,
        orientation: Orientation = NoTurn(),
        noise: TouchNoise = TouchNoise(),
        learns: bool = True,
        stamp_ns: Optional[int] = None,
    ) -> int:
        """What is felt from here on is to be recognised, until `end_object`.

        Args:
            orientation: How the body's frame may be turned against an object's.
            noise: How exactly is felt.
            learns: Whether an object that turns out to be unknown is learned, where the space does.
            stamp_ns: When it begins, on the sensor's clock [ns].
        """
        mark = IdentifyObject if learns else RecogniseObject
        return self._send(ObjectMark(mark(orientation, noise)), stamp_ns)

    def end_object(self, *, stamp_ns: Optional[int] = None) -> int:
        """The episode with an object ends."""
        return self._send(ObjectMark(EndObject()), stamp_ns)
