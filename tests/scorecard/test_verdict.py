"""The comparison of a measurement with the card."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from figure import CardError, Figure, Tolerance, at, unit_of
from verdict import judge

_FIGURE = Figure(
    id="walk.error",
    command="cogmap-lab eval env1 --json",
    pointer="/error_m/mean",
    over=None,
    scale=1.0,
    unit="m",
    better="lower",
    tolerance=Tolerance(relative=0.1),
    kind="accuracy",
    value=0.5,
    shown=[],
)


def _outcome(measured: float, **changes: Any) -> str:
    return judge(replace(_FIGURE, **changes), measured).outcome


def test_a_smaller_error_is_better_and_a_larger_one_worse() -> None:
    assert [_outcome(value) for value in (0.5, 0.549, 0.456)] == ["same"] * 3
    assert _outcome(0.56) == "worse"
    assert _outcome(0.44) == "better"


def test_a_larger_rate_is_better_and_a_smaller_one_worse() -> None:
    rate = {"better": "higher", "tolerance": Tolerance(relative=1.0), "value": 100.0}
    assert _outcome(51.0, **rate) == "same"
    assert _outcome(49.0, **rate) == "worse"
    assert _outcome(201.0, **rate) == "better"


def test_what_has_to_stay_the_same_may_move_in_neither_direction() -> None:
    count = {"better": "same", "tolerance": Tolerance(absolute=2.0), "value": 785.0}
    assert [_outcome(value, **count) for value in (783, 785, 787)] == ["same"] * 3
    assert [_outcome(value, **count) for value in (782, 788)] == ["worse"] * 2


def test_no_tolerance_is_none() -> None:
    nothing = {"tolerance": Tolerance(), "value": 0.0}
    assert _outcome(0.0, **nothing) == "same"
    assert _outcome(1.0, **nothing) == "worse"


def test_negative_values_have_limits_in_order() -> None:
    score = {"better": "same", "value": -1.0}
    assert [_outcome(value, **score) for value in (-1.09, -0.92)] == ["same"] * 2
    assert [_outcome(value, **score) for value in (-1.2, -0.8)] == ["worse"] * 2


@pytest.mark.parametrize(
    "report", [None, {}, {"error_m": {"mean": None}}, {"error_m": {"mean": "0.5"}}, [1]]
)
def test_a_figure_that_is_not_told_fails(report: Any) -> None:
    verdict = judge(_FIGURE, _FIGURE.measured(report))
    assert (verdict.outcome, verdict.is_good) == ("missing", False)
    assert "not told" in verdict.explain()


def test_a_failure_names_figure_values_tolerance_and_command() -> None:
    text = judge(_FIGURE, 0.75).explain()
    for part in ("walk.error", "0.75 m", "0.5 m", "10 %", "cogmap-lab eval env1 --json"):
        assert part in text


def test_a_ratio_is_over_its_yardstick_from_the_same_run() -> None:
    ratio = replace(_FIGURE, pointer="/rows/1/us_p50", over="/rows/0/us_p50", unit="", value=2.0)
    ratio.check()
    assert ratio.measured({"rows": [{"us_p50": 2.0}, {"us_p50": 5.0}]}) == 2.5
    assert ratio.measured({"rows": [{"us_p50": 0.0}, {"us_p50": 5.0}]}) is None
    assert ratio.measured({"rows": [{"us_p50": 2.0}]}) is None


def test_units_are_those_of_the_output() -> None:
    _FIGURE.check()
    replace(_FIGURE, pointer="/ns_p50", unit="µs", scale=1e-3).check()
    replace(_FIGURE, pointer="/accuracy", unit="%", scale=100.0).check()
    for wrong in (
        {"unit": "s"},
        {"unit": "mm"},
        {"pointer": "/ns_p50", "unit": "µs"},
        {"pointer": "/update_ms/p50", "unit": "µs", "scale": 1e-3},
        {"pointer": "/accuracy", "unit": "", "scale": 100.0},
        {"over": "/us_p50", "unit": ""},
        {"over": "/other_m", "unit": "m"},
        {"better": "more"},
        {"tolerance": Tolerance(relative=-0.1)},
    ):
        with pytest.raises(CardError, match="walk.error"):
            replace(_FIGURE, **wrong).check()


@pytest.mark.parametrize(
    ("pointer", "unit"),
    [
        ("/causal_ate_rmse_m", "m"),
        ("/recall_ate_mean_m/mean", "m"),
        ("/update_ms/p99", "ms"),
        ("/rows/0/ns_p50", "ns"),
        ("/rotation_deg/30/p90", "°"),
        ("/rows/0/beyond_half_m", "share"),
        ("/answers_per_s", None),
        ("/ratio", None),
    ],
)
def test_names_tell_units(pointer: str, unit: str) -> None:
    assert unit_of(pointer) == unit


def test_pointers_lead_into_lists_and_escaped_names() -> None:
    report = {"a/b": [{"~": 1}, 2.5], "yes": True, "nan": float("nan")}
    assert at(report, "/a~1b/0/~0") == 1.0
    assert at(report, "/a~1b/1") == 2.5
    assert [at(report, pointer) for pointer in ("/a~1b/2", "/a~1b/x", "/yes", "/nan", "/a~1b")] == [
        None
    ] * 5
