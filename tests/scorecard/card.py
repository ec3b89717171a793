"""The committed scorecard: commands, the figures in what they print, and what these were."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Mapping

from figure import CardError, Figure, Shown, Tolerance

#: The card.
CARD = Path(__file__).parent / "card.json"
#: The project, to which documents and commands are relative.
ROOT = Path(__file__).parents[2]
#: What a command begins a path with that is inside the directory of data sets.
DATA = "DATA/"


@dataclass(frozen=True)
class Run:
    """A command and its figures."""

    id: str
    command: str
    #: Whether it is among those that take seconds.
    is_quick: bool
    figures: List[Figure]

    @property
    def needs_data(self) -> bool:
        """Whether it reads a public data set."""
        return DATA in self.command


class Card:
    """The card as it is on disk."""

    def __init__(self, path: Path = CARD) -> None:
        self._path = path
        self._raw: Dict[str, Any] = json.loads(path.read_text())
        self.runs: List[Run] = [_run(raw) for raw in self._raw["runs"]]
        ids = [figure.id for figure in self.figures]
        repeated = sorted({name for name in ids if ids.count(name) > 1})
        if repeated:
            raise CardError(f"figures of one name: {', '.join(repeated)}")

    @property
    def figures(self) -> List[Figure]:
        """All figures, in the order of the runs."""
        return [figure for run in self.runs for figure in run.figures]

    def update(self, measured: Mapping[str, float]) -> None:
        """Writes measured values into the file, to ten digits; other figures stay."""
        for run in self._raw["runs"]:
            for raw in run["figures"]:
                value = measured.get(f"{run['id']}.{raw['id']}")
                if value is not None:
                    raw["value"] = float(f"{value:.10g}")
        self._path.write_text(_text(self._raw))
        self.runs = [_run(raw) for raw in self._raw["runs"]]


def _run(raw: Dict[str, Any]) -> Run:
    figures = [_figure(raw["id"], raw["command"], figure) for figure in raw["figures"]]
    return Run(raw["id"], raw["command"], raw.get("quick", False), figures)


def _figure(run: str, command: str, raw: Dict[str, Any]) -> Figure:
    name = f"{run}.{raw['id']}"
    try:
        figure = Figure(
            id=name,
            command=command,
            pointer=raw["pointer"],
            over=raw.get("over"),
            scale=raw.get("scale", 1),
            unit=raw["unit"],
            better=raw["better"],
            tolerance=Tolerance(**raw["tolerance"]),
            kind=raw["class"],
            value=float(raw["value"]),
            shown=[Shown.of(shown) for shown in raw.get("shown", [])],
        )
    except (KeyError, TypeError, ValueError) as error:
        raise CardError(f"{name}: {error!r}") from error
    figure.check()
    return figure


def _text(raw: Dict[str, Any]) -> str:
    """JSON with a line for each figure, and for each place where one is shown."""

    def line(value: Any) -> str:
        return json.dumps(value, ensure_ascii=False)

    runs = []
    for run in raw["runs"]:
        head = {key: value for key, value in run.items() if key != "figures"}
        figures = []
        for figure in run["figures"]:
            fields = {key: value for key, value in figure.items() if key != "shown"}
            text = line(fields)
            if figure.get("shown"):
                shown = ",\n      ".join(line(place) for place in figure["shown"])
                text = f'{text[:-1]}, "shown": [\n      {shown}]}}'
            figures.append(text)
        body = ",\n    ".join(figures)
        runs.append(f'  {line(head)[:-1]}, "figures": [\n    {body}]}}')
    return '{"runs": [\n' + ",\n".join(runs) + "\n]}\n"
