"""The address of a service."""

from __future__ import annotations

import urllib.parse

from .errors import InvalidValue


def checked_url(url: str) -> str:
    """`url` without a slash at its end, if requests can go there."""
    expected = "expected an address such as http://127.0.0.1:8080"
    try:
        parts = urllib.parse.urlsplit(url)
        usable = parts.scheme in ("http", "https") and parts.hostname and parts.port != 0
    except (ValueError, TypeError, AttributeError):
        usable = False
    if not usable:
        raise InvalidValue("url", url, expected)
    return url.rstrip("/")
