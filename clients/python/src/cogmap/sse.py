"""Server-sent events (HTML standard, section 9.2): the events of a stream of lines."""

from __future__ import annotations

from typing import Iterable, Iterator, List, NamedTuple, Optional


class ServerSentEvent(NamedTuple):
    """One event of a stream."""

    #: What sort of event it is.
    event: str
    data: str
    #: The last id that the stream has named.
    id: Optional[str]


def server_sent_events(lines: Iterable[bytes]) -> Iterator[ServerSentEvent]:
    """The events of a stream. Comments (keep-alives) and other fields are passed over, and so are
    events without data and one that the end of the stream cuts off."""
    data: List[str] = []
    event, last_id = "message", None
    for raw in lines:
        line = raw.decode("utf-8", "replace").rstrip("\r\n")
        if not line:
            if data:
                yield ServerSentEvent(event, "\n".join(data), last_id)
            data, event = [], "message"
            continue
        name, _, value = line.partition(":")
        value = value[1:] if value.startswith(" ") else value
        if name == "data":
            data.append(value)
        elif name == "event":
            event = value or "message"
        elif name == "id":
            last_id = value
