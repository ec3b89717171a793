"""Whether a measured figure is as good as the card says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from figure import Figure


@dataclass(frozen=True)
class Verdict:
    """One figure beside its measurement."""

    figure: Figure
    #: None where the command did not tell it.
    measured: Optional[float]
    #: `same` (within the tolerance), `better` or `worse` (beyond it), `missing`.
    outcome: str

    @property
    def is_good(self) -> bool:
        """Whether the documents may stay as they are."""
        return self.outcome in ("same", "better")

    def explain(self) -> str:
        """Why the figure fails."""
        figure = self.figure
        unit = f" {figure.unit}" if figure.unit else ""
        said = "not told" if self.measured is None else f"{self.measured:.6g}{unit}"
        return (
            f"{figure.id}: measured {said}, committed {figure.value:.6g}{unit} "
            f"({figure.better} is better, tolerance {figure.tolerance}): {figure.command}"
        )


def judge(figure: Figure, measured: Optional[float]) -> Verdict:
    """Compares a measurement with the card."""
    if measured is None:
        return Verdict(figure, None, "missing")
    least, largest = figure.tolerance.limits(figure.value)
    if least <= measured <= largest:
        return Verdict(figure, measured, "same")
    is_lower = measured < least
    if figure.better == "same":
        outcome = "worse"
    else:
        outcome = "better" if is_lower == (figure.better == "lower") else "worse"
    return Verdict(figure, measured, outcome)
