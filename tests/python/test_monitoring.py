"""The Grafana board and the alert rules of docker/monitoring ask for metrics that there are, by
labels that they have."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Set, Tuple

import pytest

ROOT = Path(__file__).parents[2]
MONITORING = ROOT / "docker" / "monitoring"
#: Labels that Prometheus adds.
_ADDED = {"job", "instance"}
#: Suffixes of the series of a histogram.
_HISTOGRAM = ("_bucket", "_sum", "_count")
#: A series with its selectors and its window.
_SERIES = re.compile(r"\b((?:cogmap|process)_\w+|up)\b(?:\{([^}]*)\})?(\[[^\]]*\])?")
_GROUPING = re.compile(r"\bby \(([^)]*)\)")


@dataclass(frozen=True)
class Metric:
    """A row of docs/metrics.md."""

    kind: str
    labels: Set[str]


def metrics() -> Dict[str, Metric]:
    """The metrics of docs/metrics.md by name, and `up`, which Prometheus makes."""
    found = {"up": Metric("gauge", set())}
    for line in (ROOT / "docs" / "metrics.md").read_text().splitlines():
        row = re.match(r"\| `(\w+)` \| (\w+) \| (.*?) \| ", line)
        if row:
            # What stands in brackets are values of a label.
            labels = re.findall(r"`(\w+)`", re.sub(r"\([^)]*\)", "", row[3]))
            found[row[1]] = Metric(row[2], set(labels))
    assert len(found) > 30
    return found


def queries() -> List[Tuple[str, str]]:
    """The queries of the board and the expressions of the rules, each with whose it is."""
    board = json.loads((MONITORING / "grafana" / "cogmap.json").read_text())
    found = []
    for panel in board["panels"]:
        for target in panel.get("targets", []):
            found.append((panel["title"], target["expr"]))
    rules = (MONITORING / "alerts.yml").read_text()
    found += re.findall(r"- alert: (\w+)\n +expr: (.*)\n", rules)
    assert len(found) > 30
    return found


@pytest.mark.parametrize("whose, query", queries())
def test_a_query_names_metrics_and_labels_that_there_are(whose: str, query: str) -> None:
    known = metrics()
    series = _SERIES.findall(query)
    assert series, query
    grouped = {label for group in _GROUPING.findall(query) for label in re.split(r",\s*", group)}
    for name, selectors, window in series:
        base = re.sub(f"({'|'.join(_HISTOGRAM)})$", "", name)
        metric = known.get(name) or known.get(base)
        assert metric, f"{whose}: there is no {name}"
        assert (metric.kind == "histogram") == (name != base), f"{whose}: {name}"
        labels = metric.labels | _ADDED | ({"le"} if name.endswith("_bucket") else set())
        asked = set(re.findall(r"(\w+)=", selectors)) | grouped
        assert asked <= labels, f"{whose}: {name} has no {asked - labels}"
        if window and "over_time" not in query:
            assert metric.kind != "gauge", f"{whose}: a gauge has no rate"


def test_the_board_shows_and_a_rule_watches_all_that_is_worth_an_alarm() -> None:
    page = (ROOT / "docs" / "metrics.md").read_text().split("Worth an alarm:")[1]
    worth = set(re.findall(r"`((?:cogmap|process)_\w+)", page))
    assert len(worth) > 5
    text = "\n".join(query for _, query in queries())
    rules = (MONITORING / "alerts.yml").read_text()
    for name in worth:
        assert name in text and name in rules, name


def test_each_panel_says_what_it_shows_and_has_a_place_of_its_own() -> None:
    board = json.loads((MONITORING / "grafana" / "cogmap.json").read_text())
    source = (MONITORING / "grafana" / "source.yml").read_text()
    taken: Set[Tuple[int, int]] = set()
    for panel in board["panels"]:
        place = panel["gridPos"]
        for x in range(place["x"], place["x"] + place["w"]):
            for y in range(place["y"], place["y"] + place["h"]):
                assert (x, y) not in taken and x < 24, panel["title"]
                taken.add((x, y))
        if panel["type"] != "row":
            assert panel["description"].endswith("."), panel["title"]
            assert f"uid: {panel['datasource']['uid']}\n" in source, panel["title"]
