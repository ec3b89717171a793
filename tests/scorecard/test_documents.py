"""The figures in tables and sentences; and whether the project's own documents print the card's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from card import ROOT, Card
from documents import Document, differences, rewrite, style
from figure import CardError, Figure, Shown
from test_verdict import _FIGURE

_TEXT = """# Figures

| error [m] | causal | refined |
|---|---|---|
| robots | 0.107 (0.097 to 0.120) | 0.060 |

| graph | by | causal |
|---|---|---|
| robots | cogmap | 0.2 |
| | GTSAM | 0.3 |

| other | causal |
|---|---|
| robots | 173, 0, 99.5, 100 and 100 % |

In a walk of 50,000 steps the place is 0.136 and
0.107 m off, at −0.4 °.
"""


@pytest.fixture
def document(tmp_path: Path) -> Document:
    path = tmp_path / "figures.md"
    path.write_text(_TEXT)
    return Document(path)


def _shown(**fields: Any) -> Shown:
    return Shown.of({"file": "figures.md", **fields})


def test_numbers_are_found_in_tables_and_sentences(document: Document) -> None:
    table = {"row": "robots", "column": "causal", "table": "error [m]"}
    assert document.printed(_shown(**table)) == "0.107"
    assert document.printed(_shown(**table, number=2)) == "0.120"
    assert document.printed(_shown(row="robots", column="refined")) == "0.060"
    assert document.printed(_shown(row=["robots", "cogmap"], column="causal")) == "0.2"
    assert document.printed(_shown(row=["robots", "GTSAM"], column="causal")) == "0.3"
    assert document.printed(_shown(row="robots", column="causal", table="other", number=3)) == "100"
    assert document.printed(_shown(text="the place is # and {} m off")) == "0.107"
    assert document.printed(_shown(text="a walk of {} steps")) == "50,000"


@pytest.mark.parametrize(
    "fields",
    [
        {"row": "robots", "column": "causal"},
        {"row": "nobody", "column": "causal"},
        {"row": "robots", "column": "refined", "number": 1},
        {"text": "the place was {}"},
    ],
)
def test_a_place_that_is_absent_or_not_the_only_one_is_an_error(
    document: Document, fields: Any
) -> None:
    with pytest.raises(CardError, match="figures.md"):
        document.printed(_shown(**fields))


def test_a_figure_is_shown_in_a_table_or_in_a_sentence() -> None:
    for fields in ({}, {"row": "robots"}, {"row": "robots", "column": "causal", "text": "{}"}):
        with pytest.raises(CardError):
            _shown(**fields)


@pytest.mark.parametrize(
    ("value", "printed", "decimals", "styled"),
    [
        (0.28249, "0.282", None, "0.282"),
        (0.2826, "0.282", None, "0.283"),
        (1.0, "1.0000", None, "1.0000"),
        (598_321.0, "1,000", -3, "598,000"),
        (12117.6369, "1.0000", None, "12,117.6369"),
        (12117.6369, "12117.0000", None, "12117.6369"),
        (1954.0, "173", None, "1954"),
        (785.0, "9", None, "785"),
        (-0.38, "−0.4", None, "−0.4"),
        (0.04, "−0.4", None, "0.0"),
        (-0.04, "0.4", None, "0.0"),
    ],
)
def test_values_take_the_style_of_what_is_printed(
    value: float, printed: str, decimals: Any, styled: str
) -> None:
    assert style(value, printed, decimals) == styled


def test_documents_that_differ_from_the_card_are_named_and_rewritten(document: Document) -> None:
    root = document.path.parent
    figures: "list[Figure]" = [
        replace(
            _FIGURE, value=0.1074, shown=[_shown(row="robots", column="causal", table="error [m]")]
        ),
        replace(_FIGURE, value=51_234.0, shown=[_shown(text="a walk of {} steps", decimals=-3)]),
    ]
    (difference,) = differences(figures, root)
    assert "prints 50,000, the card has 51,000" in difference
    assert rewrite(figures, root) == ["figures.md"]
    assert differences(figures, root) == []
    assert document.path.read_text() == _TEXT.replace("50,000", "51,000")
    assert rewrite(figures, root) == []
    with_others = [replace(_FIGURE, shown=[_shown(text="no such {}")]), *figures]
    document.path.write_text(_TEXT)
    assert rewrite(with_others, root) == ["figures.md"]
    gone = replace(_FIGURE, shown=[_shown(text="no such {}")])
    assert "0 times" in differences([gone], root)[0]


def test_the_documents_print_the_figures_of_the_card() -> None:
    assert differences(Card().figures, ROOT) == []
