"""The fenced blocks of the project's documents."""

from __future__ import annotations

import os
import re
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import List, Optional

ROOT = Path(__file__).parents[2]
#: Directories that are built or fetched; hidden ones are neither looked into.
_NOT_OURS = frozenset(
    ("target", "node_modules", "__pycache__", "corpus", "artifacts", "cogmap-data")
)
_FENCE = re.compile(r"^(?P<indent> *)```(?P<language>\S*)$")
#: Why the block below is not run.
_REASON = re.compile(r"^ *<!-- not run: (?P<reason>\S.*) -->$")


@dataclass(frozen=True)
class Block:
    """A fenced block."""

    #: Path of the document from the root, and the line of the fence, from 1.
    document: str
    line: int
    #: What stands behind the fence.
    language: str
    #: The lines in between, without the fence's indentation.
    text: str
    #: Why it is not run, from the comment above it; absent where it is.
    reason: Optional[str]
    #: Whether nothing but blank lines stands between the block above and this one, which then
    #: shows what that one prints.
    is_below_a_block: bool

    def __str__(self) -> str:
        return f"{self.document}:{self.line} ({self.language or 'no language'})"


def documents() -> List[str]:
    """The Markdown files of the project, by their paths from the root."""
    found: List[str] = []
    for directory, below, files in os.walk(ROOT):
        below[:] = [name for name in below if name not in _NOT_OURS and name[0] != "."]
        paths = (Path(directory, name) for name in files if name.endswith(".md"))
        found.extend(path.relative_to(ROOT).as_posix() for path in paths)
    return sorted(found)


def text_of(document: str) -> str:
    """The text of a document."""
    return (ROOT / document).read_text()


def blocks_of(document: str) -> List[Block]:
    """The fenced blocks of a document, in order."""
    found: List[Block] = []
    lines = text_of(document).splitlines()
    #: The line below the block above, and the reason in a comment that nothing has followed yet.
    behind, reason = 0, None
    at = 0
    while at < len(lines):
        fence = _FENCE.match(lines[at])
        if fence is None:
            if lines[at].strip():
                comment = _REASON.match(lines[at])
                reason = None if comment is None else comment["reason"]
            at += 1
            continue
        end = at + 1
        while lines[end].strip() != "```":
            end += 1
        found.append(
            Block(
                document,
                at + 1,
                fence["language"],
                textwrap.dedent("\n".join(lines[at + 1 : end])) + "\n",
                reason,
                bool(found) and not "".join(lines[behind:at]).strip(),
            )
        )
        reason = None
        at = behind = end + 1
    return found


def prose_of(document: str) -> str:
    """A document without its fenced blocks."""
    kept: List[str] = []
    is_inside = False
    for line in text_of(document).splitlines():
        is_fence = line.strip().startswith("```")
        if not is_fence and not is_inside:
            kept.append(line)
        is_inside ^= is_fence
    return "\n".join(kept)
