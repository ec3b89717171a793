"""The samples of `proto/validity.json`: those that the service refuses, and those at its limits."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Tuple

_FILE = Path(__file__).resolve().parents[3] / "proto" / "validity.json"
_NUMBERS = {name: float(name) for name in ("NaN", "Infinity", "-Infinity")}


@dataclass(frozen=True)
class Refused:
    """A body that is refused."""

    #: The field that is wrong.
    field: str
    #: Why the service refuses it.
    reason: str
    #: The body, as plain data.
    body: Any


def refused() -> Tuple[Refused, ...]:
    """The bodies that are refused."""
    entries = json.loads(_FILE.read_text())["refused"]
    return tuple(Refused(one["field"], one["reason"], _expanded(one["body"])) for one in entries)


def accepted() -> Tuple[Any, ...]:
    """The bodies at the limits."""
    return tuple(_expanded(body) for body in json.loads(_FILE.read_text())["accepted"])


def _expanded(value: Any) -> Any:
    if isinstance(value, str):
        return _NUMBERS.get(value, value)
    if isinstance(value, list):
        return [_expanded(item) for item in value]
    if isinstance(value, dict) and value.keys() == {"first", "zeros"}:
        return [value["first"], *[0] * value["zeros"]]
    if isinstance(value, dict):
        return {name: _expanded(item) for name, item in value.items()}
    return value
