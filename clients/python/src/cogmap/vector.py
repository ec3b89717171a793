"""Vectors as they cross the wire: tuples of floats. Any iterable of numbers is accepted, a numpy
array included."""

from __future__ import annotations

from array import array
from typing import Iterable, Tuple, cast

from .errors import WireError

Vec3 = Tuple[float, float, float]
#: Unit quaternion `[x, y, z, w]`, as in ROS.
Quaternion = Tuple[float, float, float, float]

#: The rotation that changes nothing.
IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)


def floats(name: str, values: Iterable[float], length: int) -> Tuple[float, ...]:
    """`values` as a tuple of `length` floats."""
    try:
        numbers = tuple(float(value) for value in values)
    except (TypeError, ValueError) as error:
        raise WireError(f"{name}: expected {length} numbers, not {values!r}") from error
    if len(numbers) != length:
        raise WireError(f"{name}: expected {length} numbers, not {len(numbers)}")
    return numbers


def vec3(name: str, values: Iterable[float]) -> Vec3:
    """`values` as three floats."""
    return cast(Vec3, floats(name, values, 3))


def quaternion(name: str, values: Iterable[float]) -> Quaternion:
    """`values` as a quaternion `[x, y, z, w]`. Its norm is left to the service to judge."""
    return cast(Quaternion, floats(name, values, 4))


def single_precision(name: str, values: Iterable[float]) -> Tuple[float, ...]:
    """`values` rounded to 32-bit floats, which is what the wire carries."""
    try:
        return tuple(array("f", (float(value) for value in values)))
    except (TypeError, ValueError) as error:
        raise WireError(f"{name}: expected 32-bit numbers: {error}") from error
