"""Messages of HTTP/1.1 as bytes, as far as a relay has to know them (RFC 9112)."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import Dict, Optional

#: Longest head of a message [bytes].
HEAD_BYTES_MAX = 1 << 16
#: Answers without a body, beside those to HEAD.
_BODILESS = frozenset((204, 304))


@dataclass(frozen=True)
class Message:
    """A request or an answer."""

    #: First word of the first line: of a request its method.
    word: str
    #: All of it.
    raw: bytes
    #: Whether no message follows on its connection.
    is_last: bool


async def read_request(reader: asyncio.StreamReader) -> Optional[Message]:
    """The next request of a connection; `None` when its client has closed it."""
    try:
        head = await reader.readuntil(b"\r\n\r\n")
    except asyncio.IncompleteReadError as error:
        if error.partial:
            raise
        return None
    headers = _headers(head)
    body = await _body(reader, headers) or b""
    return Message(_word(head), head + body, _closes(headers))


async def read_answer(reader: asyncio.StreamReader, method: str) -> Message:
    """The answer to a request of a method."""
    while True:
        head = await reader.readuntil(b"\r\n\r\n")
        status = int(head.split(b" ", 2)[1])
        if status >= 200:
            break
    headers = _headers(head)
    if method == "HEAD" or status in _BODILESS:
        return Message(_word(head), head, _closes(headers))
    body = await _body(reader, headers)
    if body is None:
        return Message(_word(head), head + await reader.read(), True)
    return Message(_word(head), head + body, _closes(headers))


def _word(head: bytes) -> str:
    return head.split(b" ", 1)[0].decode("ascii")


def _headers(head: bytes) -> Dict[str, str]:
    headers: Dict[str, str] = {}
    for line in head.decode("latin-1").split("\r\n")[1:]:
        name, _, value = line.partition(":")
        headers[name.strip().lower()] = value.strip()
    return headers


def _closes(headers: Dict[str, str]) -> bool:
    return headers.get("connection", "").lower() == "close"


async def _body(reader: asyncio.StreamReader, headers: Dict[str, str]) -> Optional[bytes]:
    """The body as it is on the wire; `None` where nothing says how long it is."""
    if headers.get("transfer-encoding", "").lower() == "chunked":
        return await _chunks(reader)
    length = headers.get("content-length")
    return None if length is None else await reader.readexactly(int(length))


async def _chunks(reader: asyncio.StreamReader) -> bytes:
    parts = []
    while True:
        line = await reader.readline()
        length = int(line.split(b";")[0], 16)
        parts.append(line)
        if length == 0:
            break
        parts.append(await reader.readexactly(length + 2))
    while True:
        line = await reader.readline()
        parts.append(line)
        if line in (b"\r\n", b""):
            return b"".join(parts)
