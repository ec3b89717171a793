"""Dataclasses to and from the wire: one place for every message.

The wire form is what the Rust side's serde derives give: fields by name, an enum as a map with one
entry, `{"velocity": {...}}`. A class says with `TAG` that it is such a variant, with `NEWTYPE` that
the variant holds a bare value, with `WIRE_NAMES` and `WIRE_ORDER` where its fields differ from the
wire. `to_wire` and `from_wire` convert to and from plain data; `encode` writes CBOR with each float
in the shortest form that keeps its value, byte for byte as the Rust side does.

Readers are lenient where the protocol evolves by addition: unknown fields are ignored, missing ones
take their default, unknown event kinds become `UnknownKind`.
"""

from __future__ import annotations

import dataclasses
import json
from enum import Enum
from functools import lru_cache
from typing import Any, Dict, List, Optional, Tuple, Type, TypeVar, Union, get_type_hints

import cbor2

from .errors import InvalidValue, WireError
from .event import UnknownKind
from .sample import Sample

CBOR = "application/cbor"
JSON = "application/json"

#: Longest message that the service takes [bytes].
MESSAGE_BYTES_MAX = 1 << 20
#: Room that a batch's own fields need in a message [bytes].
_BATCH_HEAD_BYTES = 64

#: Types that are plain data already.
_PLAIN = frozenset((float, int, str, bool))

T = TypeVar("T")


@dataclasses.dataclass(frozen=True)
class _Field:
    """A field of a message: its name here, its name on the wire, its type."""

    name: str
    wire_name: str
    type: Any
    required: bool


@lru_cache(maxsize=None)
def _fields(cls: type) -> Tuple[_Field, ...]:
    hints = get_type_hints(cls)
    wire_names: Dict[str, str] = getattr(cls, "WIRE_NAMES", {})
    fields = {field.name: field for field in dataclasses.fields(cls)}
    order: Tuple[str, ...] = getattr(cls, "WIRE_ORDER", tuple(fields))
    return tuple(
        _Field(
            name=field.name,
            wire_name=wire_names.get(field.name, field.name),
            type=hints[field.name],
            required=field.default is dataclasses.MISSING
            and field.default_factory is dataclasses.MISSING,
        )
        for field in (fields[name] for name in order)
    )


def to_wire(value: Any) -> Any:
    """A message as plain data: maps, lists, numbers, texts."""
    if value is None or type(value) in _PLAIN:
        return value
    if isinstance(value, tuple):
        return [to_wire(item) for item in value]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, UnknownKind):
        return {value.name: value.fields}
    if not dataclasses.is_dataclass(value):
        return value
    cls: type = type(value)
    tag: Optional[str] = getattr(cls, "TAG", None)
    content: Any
    if getattr(cls, "NEWTYPE", False):
        content = to_wire(getattr(value, _fields(cls)[0].name))
    else:
        content = {field.wire_name: to_wire(getattr(value, field.name)) for field in _fields(cls)}
    return content if tag is None else {tag: content}


def from_wire(cls: Type[T], value: Any) -> T:
    """A message of type `cls` from plain data; `WireError` if it is not one."""
    result: T = _read(cls, value, cls.__name__)
    return result


def _read(kind: Any, value: Any, at: str) -> Any:
    if dataclasses.is_dataclass(kind):
        tag = getattr(kind, "TAG", None)
        return _read_fields(kind, value, at) if tag is None else _read_variant((kind,), value, at)
    origin = getattr(kind, "__origin__", None)
    if origin is Union:
        options = kind.__args__
        if type(None) in options:
            if value is None:
                return None
            options = tuple(option for option in options if option is not type(None))
            if len(options) == 1:
                return _read(options[0], value, at)
        return _read_variant(options, value, at)
    if origin is tuple:
        return _read_tuple(kind.__args__, value, at)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind(value)
    if kind is float and isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    if kind is int and (not isinstance(value, int) or isinstance(value, bool)):
        raise WireError(f"{at}: expected an integer, not {value!r}")
    if not isinstance(value, kind):
        raise WireError(f"{at}: expected {kind.__name__}, not {value!r}")
    return value


def _read_fields(cls: Any, value: Any, at: str) -> Any:
    if not isinstance(value, dict):
        raise WireError(f"{at}: expected a map, not {value!r}")
    arguments: Dict[str, Any] = {}
    for field in _fields(cls):
        if field.wire_name in value:
            arguments[field.name] = _read(
                field.type, value[field.wire_name], f"{at}.{field.wire_name}"
            )
        elif type(None) in getattr(field.type, "__args__", ()):
            arguments[field.name] = None
        elif field.required:
            raise WireError(f"{at}: field {field.wire_name!r} is missing")
    return _make(cls, arguments, at)


def _make(cls: Any, arguments: Dict[str, Any], at: str) -> Any:
    try:
        return cls(**arguments)
    except InvalidValue as error:
        raise WireError(f"{at}: {error}") from error


def _read_variant(options: Tuple[Any, ...], value: Any, at: str) -> Any:
    if not isinstance(value, dict) or len(value) != 1:
        raise WireError(f"{at}: expected a map with one entry, not {value!r}")
    ((tag, content),) = value.items()
    for option in options:
        if getattr(option, "TAG", None) == tag:
            if getattr(option, "NEWTYPE", False):
                held = _read(_fields(option)[0].type, content, f"{at}.{tag}")
                return _make(option, {_fields(option)[0].name: held}, at)
            return _read_fields(option, content, f"{at}.{tag}")
    if UnknownKind in options:
        return UnknownKind(name=tag, fields=content if isinstance(content, dict) else {})
    raise WireError(f"{at}: unknown variant {tag!r}")


def _read_tuple(items: Tuple[Any, ...], value: Any, at: str) -> Tuple[Any, ...]:
    if not isinstance(value, (list, tuple)):
        raise WireError(f"{at}: expected a list, not {value!r}")
    if len(items) == 2 and items[1] is Ellipsis:
        return tuple(_read(items[0], item, at) for item in value)
    if len(value) != len(items):
        raise WireError(f"{at}: expected {len(items)} items, not {len(value)}")
    return tuple(_read(item_kind, item, at) for item_kind, item in zip(items, value))


def encode(message: Any) -> bytes:
    """A message as CBOR."""
    return _encode(to_wire(message))


def encode_sample(sample: Sample) -> bytes:
    """One sample as CBOR, to be put into batches by `encode_batch`."""
    try:
        data = encode(sample)
    except (TypeError, ValueError, OverflowError) as error:
        expected = f"expected one that can be written ({error})"
        raise InvalidValue("sample", sample, expected) from error
    if len(data) + _BATCH_HEAD_BYTES > MESSAGE_BYTES_MAX:
        expected = f"expected at most {MESSAGE_BYTES_MAX - _BATCH_HEAD_BYTES} bytes"
        raise InvalidValue("sample", sample, expected, f"{len(data)}")
    return data


def encode_batch(session: int, first_seq: int, samples: Tuple[bytes, ...]) -> bytes:
    """A `SampleBatch` as CBOR from samples that are CBOR already: nothing is encoded twice, however
    often a sample is sent."""
    return b"".join(
        (
            _head(5, 3),
            b"\x67session",
            _head(0, session),
            b"\x69first_seq",
            _head(0, first_seq),
            b"\x67samples",
            _head(4, len(samples)),
            *samples,
        )
    )


def _encode(value: Any) -> bytes:
    # cbor2's canonical mode writes the shortest floats but sorts the keys of maps, and the Rust
    # side keeps the order of the fields: so maps are written here and everything else by cbor2.
    if isinstance(value, dict):
        parts: List[bytes] = [_head(5, len(value))]
        for key, item in value.items():
            parts.append(_key(key))
            parts.append(_encode(item))
        return b"".join(parts)
    if isinstance(value, list) and any(isinstance(item, (dict, list)) for item in value):
        return _head(4, len(value)) + b"".join(map(_encode, value))
    return cbor2.dumps(value, canonical=True)


@lru_cache(maxsize=1024)
def _key(key: str) -> bytes:
    return cbor2.dumps(key)


def _head(major: int, count: int) -> bytes:
    """First bytes of a CBOR item (RFC 8949, section 3)."""
    if count < 24:
        return bytes((major << 5 | count,))
    for extra, size in ((24, 1), (25, 2), (26, 4), (27, 8)):
        if count < 1 << 8 * size:
            return bytes((major << 5 | extra,)) + count.to_bytes(size, "big")
    raise WireError(f"{count} does not fit 64 bits")


def decode(cls: Type[T], data: bytes, encoding: str = CBOR) -> T:
    """A message from its bytes; `encoding` is a Zenoh encoding or an HTTP content type."""
    essence = encoding.split(";")[0].strip().lower()
    value: Any
    try:
        if essence == CBOR:
            value = cbor2.loads(data)
        elif essence == JSON:
            value = json.loads(data)
        else:
            raise WireError(f"unknown encoding {encoding!r}")
    except WireError:
        raise
    except Exception as error:  # Any failure of a parser on foreign bytes is one to the caller.
        raise WireError(f"malformed {essence}: {error}") from error
    return from_wire(cls, value)
