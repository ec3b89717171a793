"""Server-sent events (HTML standard, section 9.2): the data of each event of a stream of lines."""

from __future__ import annotations

from typing import Iterable, Iterator, List


def data_fields(lines: Iterable[bytes]) -> Iterator[str]:
    """The `data` of each event. Comments (keep-alives) and other fields are passed over, and so is an
    event that the end of the stream cuts off."""
    data: List[str] = []
    for raw in lines:
        line = raw.decode("utf-8", "replace").rstrip("\r\n")
        if not line:
            if data:
                yield "\n".join(data)
            data = []
            continue
        name, _, value = line.partition(":")
        if name == "data":
            data.append(value[1:] if value.startswith(" ") else value)
