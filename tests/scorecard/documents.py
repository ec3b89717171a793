"""The figures that the documents print: whether they are the card's, and how they become so."""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Iterator, List, Optional, Tuple

from figure import CardError, Figure, Shown

#: A number as it is printed.
_NUMBER = r"[-−]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d+)?"
Span = Tuple[int, int]


@dataclass(frozen=True)
class Row:
    """A row of a table: its header and its cells, each with where its text is."""

    header: List[str]
    cells: List[Tuple[str, Span]]


class Document:
    """A document in memory."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.text = path.read_text()

    def printed(self, shown: Shown) -> str:
        """The number that is printed for a figure."""
        begin, end = self._span(shown)
        return self.text[begin:end]

    def print(self, shown: Shown, value: float) -> None:
        """Prints a value in the style of what is there."""
        begin, end = self._span(shown)
        styled = style(value, self.text[begin:end], shown.decimals)
        self.text = self.text[:begin] + styled + self.text[end:]

    def _span(self, shown: Shown) -> Span:
        if shown.text is not None:
            return self._span_in_sentence(shown.text)
        cell, (begin, _) = self._cell(shown)
        numbers = list(re.finditer(_NUMBER, cell))
        if len(numbers) <= shown.number:
            raise CardError(f"{self._where(shown)}: no number {shown.number} in {cell!r}")
        found = numbers[shown.number]
        return (begin + found.start(), begin + found.end())

    def _span_in_sentence(self, text: str) -> Span:
        before, after = (self._pattern(part) for part in text.split("{}"))
        found = list(re.finditer(f"{before}({_NUMBER}){after}", self.text))
        if len(found) != 1:
            raise CardError(f"{self.path.name}: {len(found)} times {text!r}")
        return found[0].span(1)

    @staticmethod
    def _pattern(text: str) -> str:
        """Spaces may be line breaks, and `#` is any number."""
        words = [re.escape(word).replace(r"\#", _NUMBER) for word in re.split(r"\s+", text)]
        return r"\s+".join(words)

    def _cell(self, shown: Shown) -> Tuple[str, Span]:
        assert shown.row is not None and shown.column is not None
        found = []
        for row in self._rows():
            names = [cell for cell, _ in row.cells[: len(shown.row)]]
            is_table = shown.table is None or row.header[0] == shown.table
            if names == shown.row and is_table and shown.column in row.header:
                found.append(row.cells[row.header.index(shown.column)])
        if len(found) != 1:
            raise CardError(f"{self._where(shown)}: {len(found)} such cells")
        return found[0]

    def _where(self, shown: Shown) -> str:
        return f"{self.path.name}, row {shown.row}, column {shown.column!r}"

    def _rows(self) -> Iterator[Row]:
        """The rows of all tables; a row without a first cell is one more of the row above it."""
        header: Optional[List[str]] = None
        last = ""
        begin = 0
        for line in self.text.splitlines(keepends=True):
            cells = _cells(line, begin)
            begin += len(line)
            if not cells:
                header, last = None, ""
            elif header is None:
                header = [cell for cell, _ in cells]
            elif not all(re.fullmatch(r":?-+:?", cell) for cell, _ in cells):
                last = cells[0][0] or last
                yield Row(header, [(last, cells[0][1]), *cells[1:]])


def _cells(line: str, begin: int) -> List[Tuple[str, Span]]:
    """The cells of a line of a table; none of any other line."""
    if not line.startswith("|"):
        return []
    bars = [found.start() for found in re.finditer(r"(?<!\\)\|", line)]
    cells = []
    for left, right in zip(bars, bars[1:]):
        raw = line[left + 1 : right]
        text = raw.strip()
        start = begin + left + 1 + (len(raw) - len(raw.lstrip()) if text else 0)
        cells.append((text, (start, start + len(text))))
    return cells


def style(value: float, printed: str, decimals: Optional[int] = None) -> str:
    """A value with the decimals, the grouping and the minus sign of a printed number."""
    if decimals is None:
        decimals = len(printed.partition(".")[2])
    rounded = round(value, decimals)
    text = f"{rounded:,.{max(decimals, 0)}f}"
    if float(text.replace(",", "")) == 0:
        text = text.lstrip("-")
    whole = printed.partition(".")[0].strip("-−")
    is_grouped = "," in printed or (len(whole) < 4 and abs(rounded) >= 10_000)
    if not is_grouped:
        text = text.replace(",", "")
    return text.replace("-", "−") if "−" in printed else text


def differences(figures: List[Figure], root: Path) -> List[str]:
    """What the documents print otherwise than the card has it."""
    found = []
    for figure in figures:
        for shown in figure.shown:
            try:
                printed = Document(root / shown.file).printed(shown)
            except CardError as error:
                found.append(f"{figure.id}: {error}")
                continue
            wanted = style(figure.value, printed, shown.decimals)
            if printed != wanted:
                found.append(f"{figure.id}: {shown.file} prints {printed}, the card has {wanted}")
    return found


def rewrite(figures: List[Figure], root: Path) -> List[str]:
    """Prints the card's figures in the documents; names the files that changed. Places that are not
    there are left to `differences`."""
    changed = []
    for file in sorted({shown.file for figure in figures for shown in figure.shown}):
        document = Document(root / file)
        before = document.text
        for figure in figures:
            for shown in figure.shown:
                if shown.file == file:
                    with contextlib.suppress(CardError):
                        document.print(shown, figure.value)
        if document.text != before:
            document.path.write_text(document.text)
            changed.append(file)
    return changed
