"""The address of a service."""

from __future__ import annotations

import urllib.parse
from typing import Iterable, Tuple, Union

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


def checked_urls(url: Union[str, Iterable[str]]) -> Tuple[str, ...]:
    """One address or several, each once and checked."""
    if isinstance(url, str) or not isinstance(url, Iterable):
        return (checked_url(url),)
    urls = tuple(dict.fromkeys(map(checked_url, url)))
    if not urls:
        raise InvalidValue("url", url, "expected an address at least")
    return urls
