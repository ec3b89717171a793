"""Figures of the drills: printed, and kept in a file that the caller names."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any, Dict, Sequence

#: Rounds of the drills that repeat something.
ROUNDS = int(os.environ.get("COGMAP_DRILL_ROUNDS", "20"))


def quantile(values: Sequence[float], share: float) -> float:
    """The smallest value that at least a share of all does not exceed (nearest rank)."""
    ranked = sorted(values)
    return ranked[max(math.ceil(share * len(ranked)), 1) - 1]


def report(name: str, figures: Dict[str, Any]) -> None:
    """Prints figures as a table, and adds them to the JSON object in the file that
    `COGMAP_DRILL_FIGURES` names, if it names one."""
    print(f"\n| {name} | |\n|---|---|")
    for key, value in figures.items():
        print(f"| {key} | {value} |")
    file = os.environ.get("COGMAP_DRILL_FIGURES")
    if file:
        path = Path(file)
        kept = json.loads(path.read_text()) if path.exists() else {}
        kept[name] = figures
        path.write_text(json.dumps(kept, indent=2) + "\n")
