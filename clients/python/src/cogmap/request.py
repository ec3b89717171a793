"""What a request is made of: its path, its body, its token."""

from __future__ import annotations

import json
import ssl
import urllib.parse
from typing import Any, Optional

from .errors import InvalidValue
from .scalar import COUNT_RANGE, STAMP_RANGE, text, whole
from .wire import to_wire


def path_of(*segments: str) -> str:
    """The path of what lies under the spaces."""
    for segment in segments:
        # An empty one would lead to another route.
        if not text("name", segment):
            raise InvalidValue("name", segment, "expected a name")
    quoted = (urllib.parse.quote(segment, safe="") for segment in segments)
    return "/".join(("/v1/spaces", *quoted))


def id_of(name: str, number: int) -> str:
    """The number of a memory, as it is in a path. Which there are, the service says."""
    return str(whole(name, number, (STAMP_RANGE[0], COUNT_RANGE[1])))


def json_of(name: str, value: Any) -> bytes:
    """A message or plain data as JSON; numpy's numbers and arrays too."""
    data = value
    if isinstance(value, dict):
        data = {key: to_wire(part) for key, part in value.items()}
    try:
        return json.dumps(to_wire(data), allow_nan=False, default=_plain).encode()
    except (TypeError, ValueError) as error:
        raise InvalidValue(name, value, f"expected what JSON can carry ({error})") from error


def _plain(value: Any) -> Any:
    if not hasattr(value, "tolist"):
        raise TypeError(f"{type(value).__name__} is no number, text, list or dict")
    return value.tolist()


def checked_token(token: Optional[str]) -> Optional[str]:
    """A token without the line break that a file ends with. It is in no message."""
    if token is None:
        return None
    stripped = token.strip() if isinstance(token, str) else None
    if stripped is None or not all(" " < character <= "~" for character in stripped):
        expected = "expected a text of printable ASCII without blanks"
        raise InvalidValue("token", None, expected, "the one that was given")
    return stripped


def tls_of(ca_file: Optional[str]) -> Optional[ssl.SSLContext]:
    """What a service is checked against whose authority is in a file."""
    if ca_file is None:
        return None
    try:
        return ssl.create_default_context(cafile=ca_file)
    except (OSError, TypeError) as error:
        reason = getattr(error, "strerror", None) or error
        expected = f"expected a file of certificates ({reason})"
        raise InvalidValue("ca_file", ca_file, expected) from error
