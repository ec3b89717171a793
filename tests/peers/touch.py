#!/usr/bin/env python3
"""Objects by touch: `cogmap-lab replay touch` beside an ideal observer of the same touches.

The observer is told what a recogniser is told: the learned touches, the noise of position and
level, and that the object is moved and not turned. It knows besides that no place is touched twice.
Bayes' rule then says how likely each object is. A hypothesis is an object and the learned place of
every touch so far; the offset between the frames has a flat prior, so given the places it is normal
around the mean difference of touched and learned positions, and each further touch has a
probability in closed form. Hypotheses less likely than the best by a factor of 10^9 are dropped,
and at most 4,000 are kept.
"""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List

import numpy as np

from grid import Floats
from service import BINARY

#: Noise levels of the comparison: position along each axis [mm], level.
_NOISES = [(2.0, 0.5), (5.0, 1.0), (10.0, 1.5)]
#: Touches after which the first choice is compared.
_AFTER = [1, 2, 3, 4, 6, 8, 12]
#: Natural logarithm of the smallest share of the best that a hypothesis keeps, and most hypotheses.
_LOG_LEAST, _MOST = -9.0 * np.log(10.0), 4_000
#: Choices within this of the best are ties.
_TIE = 1e-9


@dataclass(frozen=True)
class Learned:
    """All learned touches, object after object."""

    names: List[str]
    #: Number of the object of each touch.
    objects: "np.ndarray[Any, np.dtype[np.int64]]"
    #: Position in the object's frame [mm], and level, of each.
    places: Floats
    levels: Floats
    #: First touch of each object, and behind all of them.
    first: "np.ndarray[Any, np.dtype[np.int64]]"


@dataclass(frozen=True)
class Trial:
    """One exploration."""

    object: str
    #: Position in the exploration's frame [mm], and level, touch by touch.
    places: Floats
    levels: Floats
    #: What cogmap's first choice was worth after each touch: 1 if right, a share if tied.
    ours: Floats


def main() -> int:
    """Runs the comparison that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("directory", type=Path, help="a set as `cogmap-lab replay touch` reads it")
    parser.add_argument("--trials", type=int, default=20, help="of each object")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--noise", type=_noise, action="append", help="MM/LEVEL; three when absent")
    parser.add_argument("--binary", type=Path, default=BINARY.with_name("cogmap-lab"), help="the program cogmap-lab")
    written = "trials that were written before, instead of running cogmap"
    parser.add_argument("--trials-file", type=Path, help=written)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    args = parser.parse_args()
    learned = _learned(args.directory)
    rows = []
    for noise_mm, noise_level in args.noise or _NOISES:
        file = args.trials_file
        with tempfile.TemporaryDirectory() as out:
            if file is None:
                _cogmap(args, noise_mm, noise_level, Path(out))
                file = Path(out) / "trials.csv"
            trials = _trials(file)
        rows.append(_row(learned, trials, noise_mm, noise_level))
        print(_line(rows[-1]), file=sys.stderr)
    if args.json:
        print(json.dumps({"directory": str(args.directory), "seed": args.seed, "rows": rows}))
    else:
        print("\n".join(_line(row) for row in rows))
    return 0


def _noise(text: str) -> "tuple[float, float]":
    millimetres, level = text.split("/")
    return float(millimetres), float(level)


def _cogmap(args: argparse.Namespace, noise_mm: float, noise_level: float, out: Path) -> None:
    # Both know that touches are drawn from the whole object.
    command = [args.binary, "replay", "touch", args.directory, "--told", "--out", out, "--json"]
    command += ["--noise-mm", str(noise_mm), "--noise-level", str(noise_level)]
    command += ["--trials", str(args.trials), "--max-touches", str(max(_AFTER))]
    command += ["--seed", str(args.seed)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _learned(directory: Path) -> Learned:
    names, objects, rows = [], [], []
    for number, file in enumerate(sorted(directory.glob("*.csv"))):
        touches = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
        names.append(file.stem)
        objects += [number] * len(touches)
        rows.append(touches)
    touches = np.concatenate(rows)
    counts = [len(object_rows) for object_rows in rows]
    first = np.concatenate([[0], np.cumsum(counts)])
    return Learned(names, np.array(objects), touches[:, :3], touches[:, 3], first)


def _trials(file: Path) -> List[Trial]:
    """The trials that `cogmap-lab replay touch --out` wrote."""
    grouped: Dict[str, List[Dict[str, str]]] = {}
    with file.open(newline="") as lines:
        for row in csv.DictReader(lines):
            grouped.setdefault(row["trial"], []).append(row)
    trials = []
    for rows in grouped.values():
        column = {
            name: np.array([float(row[name]) for row in rows])
            for name in ("x_mm", "y_mm", "z_mm", "level", "right")
        }
        places = np.stack([column["x_mm"], column["y_mm"], column["z_mm"]], axis=1)
        trials.append(Trial(rows[0]["object"], places, column["level"], column["right"]))
    return trials


def _row(
    learned: Learned, trials: List[Trial], noise_mm: float, noise_level: float
) -> Dict[str, Any]:
    """Both answers at one level of noise. A trial that ends before a touch keeps its last answer."""
    ours = np.zeros((len(trials), len(_AFTER)))
    ideal = np.zeros_like(ours)
    for number, trial in enumerate(trials):
        answers = _ideal(learned, trial, noise_mm, noise_level)
        for column, touches in enumerate(_AFTER):
            last = min(touches, len(answers)) - 1
            ideal[number, column] = answers[last]
            ours[number, column] = trial.ours[last]
    apart = ours - ideal
    sd = apart.std(axis=0) / np.sqrt(len(trials))
    return {
        "noise_mm": noise_mm,
        "noise_level": noise_level,
        "trials": len(trials),
        "after": _AFTER,
        "cogmap": ours.mean(axis=0).round(4).tolist(),
        "ideal": ideal.mean(axis=0).round(4).tolist(),
        "difference": apart.mean(axis=0).round(4).tolist(),
        "difference_sd": sd.round(4).tolist(),
    }


def _ideal(learned: Learned, trial: Trial, noise_mm: float, noise_level: float) -> Floats:
    """What the observer's first choice is worth after each touch."""
    truth = learned.names.index(trial.object)
    counts = np.diff(learned.first)
    widest = int(counts.max())
    # Places of each object in a rectangle; those beyond an object's last are masked out.
    slots = np.arange(widest)
    table = np.minimum(learned.first[:-1, None] + slots, len(learned.levels) - 1)
    is_place = slots < counts[:, None]
    worth = []
    # All hypotheses before the first touch: one for each object, about no offset at all.
    objects = np.arange(len(counts))
    offsets = np.zeros((len(counts), 3))
    used = np.zeros((len(counts), widest), dtype=bool)
    logs = np.zeros(len(counts))
    for touch, (place, level) in enumerate(zip(trial.places, trial.levels)):
        index = table[objects]
        free = is_place[objects] & ~used
        apart = place - learned.places[index]
        felt = -0.5 * ((level - learned.levels[index]) / noise_level) ** 2
        left = np.maximum(counts[objects] - touch, 1)
        next_logs = logs[:, None] + felt - np.log(left)[:, None]
        if touch > 0:
            variance = noise_mm**2 * (1.0 + 1.0 / touch)
            squared = ((apart - offsets[:, None, :]) ** 2).sum(axis=2)
            next_logs += -0.5 * squared / variance - 1.5 * np.log(variance)
        next_logs = np.where(free, next_logs, -np.inf)
        best = next_logs.max()
        kept = np.argwhere(next_logs > best + _LOG_LEAST)
        order = np.argsort(-next_logs[kept[:, 0], kept[:, 1]], kind="stable")[:_MOST]
        parents, chosen = kept[order, 0], kept[order, 1]
        logs = next_logs[parents, chosen] - best
        offsets = offsets[parents] + (apart[parents, chosen] - offsets[parents]) / (touch + 1.0)
        objects = objects[parents]
        used = used[parents]
        used[np.arange(len(chosen)), chosen] = True
        shares = np.bincount(objects, weights=np.exp(logs), minlength=len(counts))
        ties = np.flatnonzero(shares >= shares.max() * (1.0 - _TIE))
        worth.append(1.0 / len(ties) if truth in ties else 0.0)
    return np.array(worth)


def _line(row: Dict[str, Any]) -> str:
    """A level of noise as text."""
    columns = zip(row["after"], row["cogmap"], row["ideal"], row["difference_sd"])
    cells = (f"k={k}: {c:.3f} / {i:.3f} ±{s:.3f}" for k, c, i, s in columns)
    noise = f"{row['noise_mm']:g} mm / {row['noise_level']:g}, {row['trials']} trials"
    return f"{noise}; cogmap / ideal after " + ", ".join(cells)


if __name__ == "__main__":
    raise SystemExit(main())
