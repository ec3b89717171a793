"""The Python programs of the documents run as they stand, one after the other, as if pasted by a
newcomer."""

from __future__ import annotations

import re
import signal
import warnings
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Dict, Iterator, List, Tuple

import pytest

from server import Server

ROOT = Path(__file__).parents[2]
#: Addresses of a service with default settings.
DEFAULT_ZENOH = "tcp/127.0.0.1:7447"
DEFAULT_HTTP = "http://127.0.0.1:8080"
#: What a program says that it prints.
_PRINTS = re.compile(r"^ *print\(.*\)  # (.*)$", re.MULTILINE)


def programs(document: str) -> List[Tuple[str, List[str]]]:
    """The Python programs of a document, each with what it prints by the text behind it and by its
    comments."""
    found = []
    for part in (ROOT / document).read_text().split("```python\n")[1:]:
        program, behind = part.split("```", 1)
        lines: List[str] = _PRINTS.findall(program)
        if behind.startswith("\n\n```text\n"):
            lines += behind.split("```")[1].splitlines()[1:]
        found.append((program, lines))
    return found


@contextmanager
def as_a_program() -> Iterator[None]:
    """Takes back what a program does to its process, and turns what it is warned of into errors."""
    handler = signal.getsignal(signal.SIGTERM)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            yield
    finally:
        signal.signal(signal.SIGTERM, handler)


@pytest.mark.parametrize("document, count", [("README.md", 3), ("clients/python/README.md", 8)])
def test_the_programs_of_a_document_do_what_they_say(
    service: Server, document: str, count: int, capsys: pytest.CaptureFixture[str]
) -> None:
    names: Dict[str, Any] = {}
    found = programs(document)
    assert len(found) >= count
    for program, expected in found:
        here = program.replace(DEFAULT_ZENOH, service.endpoint).replace(DEFAULT_HTTP, service.url)
        with as_a_program():
            exec(compile(here, document, "exec"), names)
        printed = capsys.readouterr().out.splitlines()
        assert not [line for line in printed if len(line) > 400], "what is printed can be read"
        for line in expected:
            assert line in printed, f"{program}\nprinted {printed}"
