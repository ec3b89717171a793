"""Numbers and texts as they cross the wire.

They are checked when a message is made: the caller's own line is in the traceback then. A sample
that the service could not even decode would besides make it refuse the whole batch, again and
again.
"""

from __future__ import annotations

import operator
import unicodedata
from typing import Any, Iterable, Mapping, Tuple, TypeVar

from .errors import InvalidValue
from .limits import LABEL_BYTES_MAX

_T = TypeVar("_T")

STAMP_RANGE = (-(1 << 63), (1 << 63) - 1)
COUNT_RANGE = (0, (1 << 64) - 1)


def whole(name: str, value: int, bounds: Tuple[int, int]) -> int:
    """`value` as an integer within the bounds; a numpy integer is one too."""
    try:
        number = operator.index(value)
    except TypeError as error:
        raise InvalidValue(name, value, "expected an integer") from error
    if not bounds[0] <= number <= bounds[1]:
        raise InvalidValue(name, value, f"expected {bounds[0]} to {bounds[1]}")
    return number


def number(name: str, value: float) -> float:
    """`value` as a finite float."""
    return within(name, value, -_LARGEST, _LARGEST)


_LARGEST = 1.7976931348623157e308


def within(name: str, value: float, low: float, high: float) -> float:
    """`value` as a finite float from `low` to `high`. Neither a text nor a truth value is one."""
    if isinstance(value, (str, bytes, bool)):
        raise InvalidValue(name, value, "expected a number")
    try:
        result = float(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidValue(name, value, "expected a number") from error
    # NaN fails both comparisons.
    if low <= result <= high:
        return result
    finite = -_LARGEST <= result <= _LARGEST
    raise InvalidValue(
        name, value, f"expected {low:g} to {high:g}" if finite else "expected a finite number"
    )


def seconds(name: str, value: float) -> float:
    """`value` as a time to wait [s]. What would never end is none, nor is what locks cannot wait
    for."""
    return within(name, value, 0.0, _SECONDS_MAX)


def positive_seconds(name: str, value: float) -> float:
    """The same, and more than none at all."""
    if not seconds(name, value) > 0:
        raise InvalidValue(name, value, "expected more than zero seconds")
    return float(value)


#: Some thirty years.
_SECONDS_MAX = 1e9


def text(name: str, value: str) -> str:
    """`value`, if it is a text that UTF-8 can carry."""
    if not isinstance(value, str):
        raise InvalidValue(name, value, "expected a text")
    try:
        value.encode()
    except UnicodeEncodeError as error:
        raise InvalidValue(name, value, "expected a text that UTF-8 can carry") from error
    return value


def label(name: str, value: str) -> str:
    """`value`, if it may name a landmark, a marker or an object."""
    size = len(text(name, value).encode())
    if not 1 <= size <= LABEL_BYTES_MAX:
        expected = f"expected 1 to {LABEL_BYTES_MAX} bytes of UTF-8"
        raise InvalidValue(name, value, expected, f"{value!r} of {size} bytes")
    if any(unicodedata.category(character) == "Cc" for character in value):
        raise InvalidValue(name, value, "expected a text without control characters")
    return value


def counted(name: str, items: Tuple[_T, ...], most: int) -> Tuple[_T, ...]:
    """`items`, if there is one at least, and not more than `most`."""
    if not 1 <= len(items) <= most:
        raise InvalidValue(name, items, f"expected 1 to {most} of them", str(len(items)))
    return items


def listed(name: str, items: Iterable[_T]) -> Tuple[_T, ...]:
    """`items` as a tuple, if they are a list of some kind; a text and a mapping are none."""
    if isinstance(items, (str, bytes, Mapping)) or not isinstance(items, Iterable):
        raise InvalidValue(name, items, "expected a list")
    return tuple(items)


def all_of(name: str, items: Iterable[object], kinds: Tuple[type, ...]) -> Tuple[Any, ...]:
    """`items` as a tuple, if each is one of `kinds`."""
    try:
        taken = tuple(items)
    except TypeError as error:
        expected = " or ".join(kind.__name__ for kind in kinds)
        raise InvalidValue(name, items, f"expected several {expected}") from error
    for index, item in enumerate(taken):
        one_of(f"{name}[{index}]", item, kinds)
    return taken


def one_of(name: str, value: object, kinds: Tuple[type, ...]) -> None:
    """Raises unless `value` is one of `kinds`."""
    if not isinstance(value, kinds):
        expected = ", ".join(kind.__name__ for kind in kinds)
        raise InvalidValue(name, value, f"expected {expected}")
