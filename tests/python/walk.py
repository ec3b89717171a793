"""A reader who goes through a document and runs its blocks one after the other, as they stand."""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any, Dict, Iterator, List

from binary import binary, environment
from document import Block, blocks_of
from server import Server
from wait import LONG_S

#: Addresses of a service with default settings.
_ZENOH = "tcp/127.0.0.1:7447"
_HTTP = "http://127.0.0.1:8080"
#: Longest line that a program of a document prints.
_COLUMNS_MAX = 400
#: What a program says that it prints.
_PRINTS = re.compile(r"^ *print\(.*\)  # (.*)$", re.MULTILINE)
#: Languages of blocks that a reader runs.
RUN = frozenset(("python", "rust", "sh"))
#: Languages of blocks that show what the block above prints.
SHOWN = frozenset(("json", "jsonc", "text"))


def is_walked(block: Block) -> bool:
    """Whether a reader runs a block."""
    return block.language in RUN and block.reason is None and not is_documentation(block)


def is_documentation(block: Block) -> bool:
    """Whether a block is of a crate's documentation, whose programs `cargo test --doc` runs."""
    return block.language == "rust" and block.document.startswith("service/core/")


class Walk:
    """Runs the blocks of a document against a service, in a directory in which its store is
    `./cogmap-data`, as it is for somebody who has started the service there."""

    def __init__(self, service: Server, directory: Path) -> None:
        self._service = service
        self._directory = directory
        self._names: Dict[str, Any] = {"__name__": "__main__"}
        (directory / "cogmap-data").symlink_to(service.data)
        commands = directory / "bin"
        commands.mkdir()
        for name in ("cogmap", "cogmap-lab"):
            (commands / name).symlink_to(Path(binary()).with_name(name))
        # An answer with an error ends the block.
        (directory / ".curlrc").write_text("fail-with-body\nshow-error\n")

    def through(self, document: str) -> None:
        """Runs all blocks of a document, and compares what they print with what is said."""
        printed = ""
        for block in blocks_of(document):
            if is_walked(block):
                run = {"python": self._python, "rust": self._rust, "sh": self._sh}[block.language]
                with as_at_home(self._directory):
                    printed = run(block)
            elif is_output(block):
                self._compare(block, printed)

    def _here(self, text: str) -> str:
        """A text with this service's addresses."""
        return text.replace(_ZENOH, self._service.endpoint).replace(_HTTP, self._service.url)

    def _python(self, block: Block) -> str:
        with as_a_program(), contextlib.redirect_stdout(io.StringIO()) as printed:
            exec(compile(self._here(block.text), str(block), "exec"), self._names)
        lines = printed.getvalue().splitlines()
        assert not [line for line in lines if len(line) > _COLUMNS_MAX], f"{block} can be read"
        for line in _PRINTS.findall(block.text):
            assert line in lines, f"{block} prints {lines}"
        return printed.getvalue()

    def _rust(self, block: Block) -> str:
        program = compiled(block, self._here(block.text), self._directory)
        return self._finish(block, [str(program)])

    def _sh(self, block: Block) -> str:
        return self._finish(block, ["bash", "-euo", "pipefail", "-c", self._here(block.text)])

    def _finish(self, block: Block, command: List[str]) -> str:
        python = Path(sys.executable).parent
        paths = f"{self._directory / 'bin'}:{python}:{os.environ['PATH']}"
        done = subprocess.run(
            command,
            cwd=self._directory,
            env={**environment(), "PATH": paths, "CURL_HOME": str(self._directory)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            timeout=LONG_S,
        )
        told = done.stdout + done.stderr
        assert done.returncode == 0, f"{block} ends with {done.returncode}: {told}"
        return done.stdout

    @staticmethod
    def _compare(block: Block, printed: str) -> None:
        if block.language == "text":
            lines = [line.rstrip() for line in printed.splitlines()]
            for line in block.text.splitlines():
                assert line in lines, f"{block}: not {line!r} is printed, but {printed}"
        else:
            differences = list(other_than_shown(read_json(block.text), json.loads(printed)))
            assert not differences, f"{block}: {differences} of {printed}"


def compiled(block: Block, text: str, directory: Path) -> Path:
    """Compiles a Rust program against the client that was built with the service. Statements alone
    are those of a `main` that returns errors."""
    if "fn main()" not in text:
        text = (
            "fn main() -> Result<(), Box<dyn std::error::Error>> {\n"
            f"{text}\nOk(())\n}}\n"
        )
    source = directory / f"line_{block.line}.rs"
    source.write_text(text)
    built = Path(binary()).parent
    compiler = ["rustc", "--edition", "2024", "-C", "debuginfo=0", "-D", "warnings"]
    compiler += ["-A", "unused_variables", "-L", f"dependency={built / 'deps'}"]
    compiler += ["--extern", f"cogmap_client={built / 'libcogmap_client.rlib'}"]
    program = source.with_suffix("")
    done = subprocess.run(
        [*compiler, "-o", str(program), str(source)],
        stderr=subprocess.PIPE,
        text=True,
        timeout=LONG_S,
    )
    # A client that is absent, or older than what it is made of, is no crate to the compiler.
    advice = "cargo build --workspace --all-targets, if it finds no crate"
    assert done.returncode == 0, f"{block}: {done.stderr}\n{advice}"
    return program


def is_output(block: Block) -> bool:
    """Whether a block shows what the one above prints."""
    if block.language not in SHOWN or block.reason is not None or not block.is_below_a_block:
        return False
    above = [each for each in blocks_of(block.document) if each.line < block.line]
    return is_walked(above[-1])


def read_json(text: str) -> Any:
    """JSON with comments, in whose lists something may be left out."""
    without = re.sub(r"/\*[^*]*\*/|(?<![:\"\w])//[^\n]*", "", text)
    return json.loads(re.sub(r",(\s*[\]}])", r"\1", without))


def other_than_shown(shown: Any, printed: Any, at: str = "$") -> Iterator[str]:
    """Where an answer is not as a document shows it. Numbers are compared as far as they are shown,
    lists as far as they go on; stamps, which are never the same, only in their kind."""
    if isinstance(shown, dict) and isinstance(printed, dict):
        if shown.keys() != printed.keys():
            yield f"{at} has {sorted(printed)}, shown are {sorted(shown)}"
        for key in shown.keys() & printed.keys():
            if key.endswith("_ns") or key in ("session", "map_revision"):
                if type(shown[key]) is not type(printed[key]):
                    yield f"{at}.{key} is {printed[key]!r}"
            else:
                yield from other_than_shown(shown[key], printed[key], f"{at}.{key}")
    elif isinstance(shown, list) and isinstance(printed, list):
        if len(shown) > len(printed):
            yield f"{at} has {len(printed)} items, shown are {len(shown)}"
        for index, (one, other) in enumerate(zip(shown, printed)):
            yield from other_than_shown(one, other, f"{at}[{index}]")
    elif isinstance(shown, float) and isinstance(printed, (int, float)):
        decimals = len(repr(shown).partition(".")[2])
        if abs(shown - printed) > 0.501 * 10**-decimals:
            yield f"{at} is {printed}, shown is {shown}"
    elif shown != printed:
        yield f"{at} is {printed!r}, shown is {shown!r}"


@contextlib.contextmanager
def as_a_program() -> Iterator[None]:
    """Takes back what a program does to its process, and turns what it is warned of into errors."""
    handler = signal.getsignal(signal.SIGTERM)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            yield
    finally:
        signal.signal(signal.SIGTERM, handler)


@contextlib.contextmanager
def as_at_home(directory: Path) -> Iterator[None]:
    """Goes into a directory for a while."""
    before = Path.cwd()
    os.chdir(directory)
    try:
        yield
    finally:
        os.chdir(before)
