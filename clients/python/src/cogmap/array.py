"""Numbers as numpy arrays where numpy is installed. The package itself does without it."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Sequence, cast

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

    Floats = NDArray[numpy.float64]
    Integers = NDArray[numpy.int64]
else:
    Floats = Integers = Any


def _numpy() -> Any:
    """The package numpy, if it is installed; imported late, for it takes longer than all of this
    package."""
    try:
        return importlib.import_module("numpy")
    except ImportError:
        return None


def floats(rows: Sequence[Any], *shape: int) -> Floats:
    """`rows` as an array of float64 of a shape; without numpy as nested tuples."""
    numpy = _numpy()
    made: Any = _tuples(rows)
    if numpy is not None:
        made = numpy.array(made, dtype=numpy.float64).reshape(shape)
    return cast(Floats, made)


def integers(numbers: Sequence[int]) -> Integers:
    """`numbers` as an array of int64; without numpy as a tuple."""
    numpy = _numpy()
    made: Any = tuple(numbers)
    if numpy is not None:
        made = numpy.array(made, dtype=numpy.int64)
    return cast(Integers, made)


def symmetric(upper: Sequence[float], size: int) -> Floats:
    """A symmetric matrix from its upper triangle, row by row; without numpy as nested tuples."""
    rows = [[0.0] * size for _ in range(size)]
    entries = iter(upper)
    for row in range(size):
        for column in range(row, size):
            rows[row][column] = rows[column][row] = next(entries)
    return floats(rows, size, size)


def _tuples(rows: Any) -> Any:
    return tuple(_tuples(row) if isinstance(row, (list, tuple)) else row for row in rows)
