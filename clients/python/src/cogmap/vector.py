"""Vectors as they cross the wire: tuples of floats. Any iterable of numbers is accepted, a numpy
array included. What the service would refuse is refused here, by the name of its field."""

from __future__ import annotations

import math
from array import array
from typing import Iterable, Tuple, cast

from .errors import InvalidValue
from .limits import (
    DESCRIPTOR_LEN_MAX,
    DESCRIPTOR_LEN_MIN,
    DESCRIPTOR_NORM_MIN,
    METRES_MAX,
    UNIT_TOLERANCE,
)
from .scalar import number as finite
from .scalar import within

Vec3 = Tuple[float, float, float]
#: Unit quaternion `[x, y, z, w]`, as in ROS.
Quaternion = Tuple[float, float, float, float]

#: The rotation that changes nothing.
IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)


def floats(name: str, values: Iterable[float], length: int) -> Tuple[float, ...]:
    """`values` as a tuple of `length` floats."""
    if isinstance(values, (str, bytes)):
        raise InvalidValue(name, values, f"expected {length} numbers")
    try:
        numbers = tuple(float(value) for value in values)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidValue(name, values, f"expected {length} numbers") from error
    if len(numbers) != length:
        raise InvalidValue(name, values, f"expected {length} numbers", f"{len(numbers)} of them")
    return numbers


def vec3(name: str, values: Iterable[float], limit: float = METRES_MAX) -> Vec3:
    """`values` as three finite floats, none of a larger magnitude than `limit`."""
    numbers = floats(name, values, 3)
    for index, number in enumerate(numbers):
        if not -limit <= number <= limit:
            within(f"{name}[{index}]", number, -limit, limit)
    return cast(Vec3, numbers)


def deviations(name: str, values: Iterable[float]) -> Vec3:
    """`values` as three standard deviations: finite and not negative."""
    numbers = floats(name, values, 3)
    for index, number in enumerate(numbers):
        if not 0.0 <= number <= METRES_MAX:
            within(f"{name}[{index}]", number, 0.0, METRES_MAX)
    return cast(Vec3, numbers)


def unit_vector(name: str, values: Iterable[float]) -> Vec3:
    """`values` as a unit vector, to three digits."""
    numbers = vec3(name, values)
    return cast(Vec3, _of_unit_norm(name, numbers, "unit vector"))


def quaternion(name: str, values: Iterable[float]) -> Quaternion:
    """`values` as a unit quaternion `[x, y, z, w]`, to three digits; the service normalises it."""
    numbers = floats(name, values, 4)
    return cast(Quaternion, _of_unit_norm(name, numbers, "unit quaternion [x, y, z, w]"))


def _of_unit_norm(name: str, numbers: Tuple[float, ...], what: str) -> Tuple[float, ...]:
    norm = math.hypot(*numbers)
    if not abs(norm - 1.0) <= UNIT_TOLERANCE:
        raise InvalidValue(
            name, numbers, f"expected a {what}", f"{numbers}, whose norm is {norm:.6g}"
        )
    return numbers


def quaternion_from_yaw(yaw_rad: float) -> Quaternion:
    """The unit quaternion `[x, y, z, w]` of a turn about the z axis, left positive [rad]: all that
    a robot on a floor needs."""
    half = finite("yaw_rad", yaw_rad) / 2
    return (0.0, 0.0, math.sin(half), math.cos(half))


def single_precision(name: str, values: Iterable[float]) -> Tuple[float, ...]:
    """`values` rounded to 32-bit floats, which is what the wire carries."""
    try:
        return tuple(array("f", (float(value) for value in values)))
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidValue(name, values, "expected 32-bit numbers") from error


def direction(name: str, values: Iterable[float]) -> Tuple[float, ...]:
    """`values` as a descriptor: 8 to 4096 finite 32-bit floats that are not all zero."""
    numbers = single_precision(name, values)
    if not DESCRIPTOR_LEN_MIN <= len(numbers) <= DESCRIPTOR_LEN_MAX:
        expected = f"expected {DESCRIPTOR_LEN_MIN} to {DESCRIPTOR_LEN_MAX} numbers"
        raise InvalidValue(name, values, expected, f"{len(numbers)} of them")
    norm = math.sqrt(math.fsum(number * number for number in numbers))
    if not DESCRIPTOR_NORM_MIN <= norm < math.inf:
        expected = "expected finite numbers that have a direction"
        raise InvalidValue(name, values, expected, f"a vector of norm {norm:.6g}")
    return numbers
