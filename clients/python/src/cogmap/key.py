"""Key expressions and names.

    cogmap/{space}/{agent}/samples     out  SampleBatch
    cogmap/{space}/{agent}/estimate    in   Estimate
    cogmap/{space}/{agent}/durable     in   Watermark
    cogmap/{space}/query/{verb}        queryables
"""

from __future__ import annotations

import re

from .errors import InvalidValue

#: 1 to 64 characters, one chunk of a key and of a URL path without escaping.
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", re.ASCII)


def check_name(what: str, name: str) -> str:
    """`name`, if it may name a space, an agent or a channel; `InvalidValue` otherwise."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        expected = "expected a name: 1 to 64 of A-Z a-z 0-9 _ . -, the first a letter or digit"
        raise InvalidValue(what, name, expected)
    return name


def samples_key(space: str, agent: str) -> str:
    """Where an agent publishes its samples."""
    return f"cogmap/{space}/{agent}/samples"


def estimate_key(space: str, agent: str) -> str:
    """Where an agent's estimates are published."""
    return f"cogmap/{space}/{agent}/estimate"


def durable_key(space: str, agent: str) -> str:
    """Where an agent's watermarks are published."""
    return f"cogmap/{space}/{agent}/durable"


def query_key(space: str, verb: str) -> str:
    """Where a space answers a query."""
    return f"cogmap/{space}/query/{verb}"
