"""Whole numbers and texts as they cross the wire.

They are checked when a message is made: one sample that the service cannot decode would make it refuse
the whole batch, again and again.
"""

from __future__ import annotations

import operator
from typing import Tuple

from .errors import WireError

STAMP_RANGE = (-(1 << 63), (1 << 63) - 1)
COUNT_RANGE = (0, (1 << 64) - 1)


def whole(name: str, value: int, bounds: Tuple[int, int]) -> int:
    """`value` as an integer within the bounds; a numpy integer is one too."""
    try:
        number = operator.index(value)
    except TypeError as error:
        raise WireError(f"{name}: expected an integer, not {value!r}") from error
    if not bounds[0] <= number <= bounds[1]:
        raise WireError(f"{name}: {number} is beyond 64 bits")
    return number


def text(name: str, value: str) -> str:
    """`value`, if it is a text that UTF-8 can carry."""
    if not isinstance(value, str):
        raise WireError(f"{name}: expected a text, not {value!r}")
    try:
        value.encode()
    except UnicodeEncodeError as error:
        raise WireError(f"{name}: {error}") from error
    return value


def one_of(name: str, value: object, kinds: Tuple[type, ...]) -> None:
    """Raises unless `value` is one of `kinds`."""
    if not isinstance(value, kinds):
        expected = ", ".join(kind.__name__ for kind in kinds)
        raise WireError(f"{name}: expected {expected}, not {value!r}")
