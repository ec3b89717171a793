"""What the card says of one figure, and what a new measurement makes of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Dict, List, Optional

#: Units that the names in a report end or begin with, and what they are called in the card.
_UNITS = {
    "m": "m",
    "mm": "mm",
    "s": "s",
    "ms": "ms",
    "us": "µs",
    "ns": "ns",
    "rad": "rad",
    "deg": "°",
    "bytes": "bytes",
}
#: Names of shares that end like one of a length.
_SHARES = ("beyond_half_m",)
#: What one unit is multiplied by to become another one.
_SCALES = {
    ("ns", "µs"): 1e-3,
    ("µs", "ms"): 1e-3,
    ("ms", "s"): 1e-3,
    ("m", "mm"): 1e3,
    ("rad", "°"): 180.0 / math.pi,
    ("share", "%"): 100.0,
}
_BETTER = ("lower", "higher", "same")
_CLASSES = ("accuracy", "speed")


class CardError(Exception):
    """The card, or what was measured for it, makes no sense; the message names the figure."""


@dataclass(frozen=True)
class Tolerance:
    """How much worse than the card a figure may be: by a share of the card's value, or by an amount
    in the figure's unit."""

    relative: float = 0.0
    absolute: float = 0.0

    def __str__(self) -> str:
        return f"{100 * self.relative:g} %" if self.relative else f"{self.absolute:g}"

    def limits(self, value: float) -> "tuple[float, float]":
        """The least and the largest measured value that are no worse than one of the card."""
        if self.relative:
            bounds = (value / (1 + self.relative), value * (1 + self.relative))
            return (min(bounds), max(bounds))
        return (value - self.absolute, value + self.absolute)


@dataclass(frozen=True)
class Shown:
    """Where a document prints the figure: a table's `row` and `column`, or a sentence's `text`."""

    file: str
    #: First cells of the row, one or more.
    row: Optional[List[str]] = None
    column: Optional[str] = None
    #: First cell of the table's header, where several tables have such a row.
    table: Optional[str] = None
    #: Which number of the cell, from 0.
    number: int = 0
    #: A piece of a sentence with `{}` for this figure and `#` for any other number.
    text: Optional[str] = None
    #: Printed decimals, negative for tens and more; as in the document if absent.
    decimals: Optional[int] = None

    @staticmethod
    def of(raw: Dict[str, Any]) -> "Shown":
        """Reads one from the card."""
        fields = dict(raw)
        row = fields.get("row")
        if isinstance(row, str):
            fields["row"] = [row]
        shown = Shown(**fields)
        if (shown.text is None) == (shown.row is None or shown.column is None):
            raise CardError(f"{raw}: a figure is shown in a `text`, or in a `row` and `column`")
        return shown


@dataclass(frozen=True)
class Figure:
    """A number that the documents claim."""

    #: `run.name`.
    id: str
    #: What anyone can type to get it.
    command: str
    #: JSON pointer into what the command prints.
    pointer: str
    #: JSON pointer to a yardstick from the same output, over which the figure is taken.
    over: Optional[str]
    #: What the number is multiplied by to be in `unit`.
    scale: float
    unit: str
    better: str
    tolerance: Tolerance
    kind: str
    value: float
    shown: List[Shown]

    def check(self) -> None:
        """Refuses what makes no sense, above all a unit that is not that of the output."""

        def require(condition: bool, reason: str) -> None:
            if not condition:
                raise CardError(f"{self.id}: {reason}")

        require(self.better in _BETTER, f"`better` is one of {', '.join(_BETTER)}")
        require(self.kind in _CLASSES, f"`class` is one of {', '.join(_CLASSES)}")
        require(math.isfinite(self.value), "the value is no number")
        tolerance = self.tolerance
        require(tolerance.relative >= 0 and tolerance.absolute >= 0, "a tolerance is negative")
        require(not (tolerance.relative and tolerance.absolute), "two tolerances")
        if self.over is not None:
            units = (unit_of(self.pointer), unit_of(self.over))
            require(units[0] == units[1], f"a ratio of {units[0]} and {units[1]}")
            require(self.unit == "" and self.scale == 1, "a ratio has no unit")
            return
        unit = unit_of(self.pointer)
        if unit is not None and unit != self.unit:
            scale = _SCALES.get((unit, self.unit))
            require(scale is not None, f"the output is in {unit}, the card in {self.unit}")
            assert scale is not None
            require(math.isclose(scale, self.scale), f"{unit} to {self.unit} is times {scale:g}")
        else:
            share = unit is None and (self.scale, self.unit) == (100.0, "%")
            require(self.scale == 1 or share, f"nothing says why the scale is {self.scale:g}")

    def measured(self, report: Any) -> Optional[float]:
        """The figure in what a command printed; none if it is not there or no number."""
        value = at(report, self.pointer)
        if value is None or self.over is None:
            return None if value is None else value * self.scale
        yardstick = at(report, self.over)
        return value / yardstick if yardstick else None


def at(report: Any, pointer: str) -> Optional[float]:
    """The finite number that a JSON pointer (RFC 6901) leads to."""
    for part in pointer.split("/")[1:]:
        name = part.replace("~1", "/").replace("~0", "~")
        if isinstance(report, list):
            report = report[int(name)] if name.isdigit() and int(name) < len(report) else None
        elif isinstance(report, dict):
            report = report.get(name)
        else:
            return None
    if isinstance(report, bool) or not isinstance(report, (int, float)):
        return None
    return float(report) if math.isfinite(report) else None


def unit_of(pointer: str) -> Optional[str]:
    """The unit that the names on the way to a number tell: that of the last one to tell any."""
    for name in reversed(pointer.split("/")):
        if "_per_" in name:
            return None
        if name in _SHARES:
            return "share"
        words = name.split("_")
        for word in (words[-1], words[0], *words[1:-1]):
            if len(words) > 1 and word in _UNITS:
                return _UNITS[word]
    return None
