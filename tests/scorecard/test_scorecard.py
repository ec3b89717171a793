"""The program, with a stand-in for the binary that prints what it is told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Dict, List

import pytest

from card import Card
from figure import CardError
from scorecard import main


def _card(directory: Path, **changes: Any) -> Path:
    figure: Dict[str, Any] = {
        "id": "error",
        "pointer": "/error_m",
        "unit": "m",
        "better": "lower",
        "tolerance": {"relative": 0.1},
        "class": "accuracy",
        "value": 0.5,
    }
    fast = {
        **figure,
        "id": "ratio",
        "pointer": "/ratio",
        "unit": "",
        "class": "speed",
        "value": 2.0,
    }
    runs: List[Dict[str, Any]] = [
        {
            "id": "walk",
            "command": "cogmap-lab walk --json",
            "quick": True,
            "figures": [{**figure, **changes}, fast],
        },
        {"id": "set", "command": "cogmap-lab replay DATA/set --json", "figures": [figure]},
    ]
    path = directory / "card.json"
    path.write_text(json.dumps({"runs": runs}))
    return path


def _binary(directory: Path, prints: str, code: int = 0) -> Path:
    path = directory / "cogmap-lab"
    path.write_text(
        f"#!/bin/sh\necho \"$@\" >> '{directory}/called'\necho '{prints}'\nexit {code}\n"
    )
    path.chmod(0o755)
    return path


def _run(directory: Path, *arguments: str) -> int:
    card, binary = directory / "card.json", directory / "cogmap-lab"
    return main(["--card", str(card), "--binary", str(binary), *arguments])


GOOD = '{"error_m": 0.51, "ratio": 1.9}'


def test_figures_within_their_tolerances_pass(tmp_path: Path, capsys: Any) -> None:
    _card(tmp_path)
    _binary(tmp_path, GOOD)
    (tmp_path / "set").mkdir()
    assert _run(tmp_path, "--data", str(tmp_path)) == 0
    out = json.loads(capsys.readouterr().out)
    assert [figure["id"] for figure in out["figures"]] == ["walk.error", "walk.ratio", "set.error"]
    assert out["failures"] == []
    assert (tmp_path / "called").read_text().split("\n")[1] == f"replay {tmp_path}/set --json"


@pytest.mark.parametrize(
    ("prints", "code", "named"),
    [
        ('{"error_m": 0.6, "ratio": 2}', 0, "walk.error: measured 0.6 m, committed 0.5 m"),
        ('{"ratio": 2}', 0, "walk.error: measured not told"),
        ("no JSON", 0, "printed no JSON"),
        (GOOD, 3, "ended with 3"),
    ],
)
def test_a_figure_that_is_worse_or_not_told_fails(
    tmp_path: Path, capsys: Any, prints: str, code: int, named: str
) -> None:
    _card(tmp_path)
    _binary(tmp_path, prints, code)
    assert _run(tmp_path, "--only", "walk") == 1
    captured = capsys.readouterr()
    assert any(named in failure for failure in json.loads(captured.out)["failures"])
    assert named in captured.err


def test_without_data_sets_theirs_are_left_out(tmp_path: Path, capsys: Any) -> None:
    _card(tmp_path)
    _binary(tmp_path, GOOD)
    assert _run(tmp_path) == 0
    assert json.loads(capsys.readouterr().out)["skipped"] == ["set.error"]


def test_a_part_of_the_card_can_be_asked_for(tmp_path: Path, capsys: Any) -> None:
    _card(tmp_path)
    _binary(tmp_path, GOOD)
    for arguments, ids in (
        (("--quick",), ["walk.error", "walk.ratio"]),
        (("--kind", "speed"), ["walk.ratio"]),
        (("--only", "walk.error"), ["walk.error"]),
        (("--docs-only",), []),
    ):
        assert _run(tmp_path, *arguments) == 0
        assert [figure["id"] for figure in json.loads(capsys.readouterr().out)["figures"]] == ids
    assert _run(tmp_path, "--only", "nothing") == 2


def test_an_update_writes_the_card_and_passes_from_then_on(tmp_path: Path) -> None:
    path = _card(tmp_path)
    _binary(tmp_path, '{"error_m": 0.7123456789012, "ratio": 2}')
    assert _run(tmp_path) == 1
    assert _run(tmp_path, "--update") == 0
    assert {figure.id: figure.value for figure in Card(path).figures} == {
        "walk.error": 0.7123456789,
        "walk.ratio": 2.0,
        "set.error": 0.5,
    }
    assert _run(tmp_path) == 0


def test_a_card_that_makes_no_sense_is_refused(tmp_path: Path) -> None:
    _binary(tmp_path, GOOD)
    for changes in ({"unit": "s"}, {"id": "ratio"}, {"value": "much"}, {"tolerance": {"much": 1}}):
        path = _card(tmp_path, **changes)
        with pytest.raises(CardError):
            Card(path)
        assert _run(tmp_path) == 2
