#!/usr/bin/env python3
"""Measures the figures of README and docs anew and compares them with the committed card.

Every figure of `card.json` is a JSON pointer into what a command prints that anyone can type. A
figure that is worse than the card by more than its tolerance fails, and so does one that its
command does not tell, or a document that prints something else than the card. Prints one JSON
object on standard output and a table on standard error; ends with 1 when something failed, with 2
when it was called wrongly.
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

from card import CARD, DATA, ROOT, Card, Run
from documents import differences, rewrite
from figure import CardError
from verdict import Verdict, judge

#: Longest run of a command [s].
_COMMAND_S = 3600.0


class RunError(Exception):
    """A command ended badly or printed no JSON."""


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs the program and returns its exit code."""
    options = _options(argv)
    try:
        card = Card(options.card)
        runs = _chosen(card, options)
    except (CardError, OSError, ValueError) as error:
        print(f"scorecard: {error}", file=sys.stderr)
        return 2
    if options.list:
        for run in runs:
            print(f"{run.id}\t{len(run.figures)}\t{run.command}")
        return 0
    verdicts: List[Verdict] = []
    skipped: List[str] = []
    errors: List[str] = []
    for run in [] if options.docs_only else runs:
        if run.needs_data and options.data is None:
            skipped += [figure.id for figure in run.figures]
            continue
        _say(f"$ {run.command}")
        begin = time.monotonic()
        try:
            report = _report(run, options.binary, options.data)
        except RunError as error:
            errors.append(f"{run.id}: {error}")
            report = None
        verdicts += [judge(figure, figure.measured(report)) for figure in run.figures]
        _say(f"  {time.monotonic() - begin:.0f} s")
    if options.update:
        measured = {v.figure.id: v.measured for v in verdicts if v.measured is not None}
        card.update(measured)
        for file in rewrite(card.figures, ROOT):
            _say(f"{file} prints the new figures")
        failed = [verdict for verdict in verdicts if verdict.measured is None]
    else:
        failed = [verdict for verdict in verdicts if not verdict.is_good]
    errors += differences(card.figures, ROOT)
    _tell(verdicts, skipped, failed, errors)
    return 1 if failed or errors else 0


def _options(argv: Optional[Sequence[str]]) -> argparse.Namespace:
    summary = (__doc__ or "").splitlines()[0]
    parser = argparse.ArgumentParser(prog="scorecard", description=summary)
    parser.add_argument(
        "--data",
        type=Path,
        help="directory with the public data sets; without it theirs are skipped",
    )
    binary = ROOT / "target" / "release" / "cogmap"
    parser.add_argument("--binary", type=Path, default=binary, help="the program cogmap; cogmap-lab lies beside it")
    parser.add_argument("--card", type=Path, default=CARD, help=argparse.SUPPRESS)
    parser.add_argument(
        "--only", metavar="ID,…", help="only runs, or figures of runs, with these names"
    )
    parser.add_argument("--quick", action="store_true", help="only what takes seconds")
    parser.add_argument(
        "--kind", choices=("accuracy", "speed"), help="only runs with figures of this class"
    )
    parser.add_argument(
        "--docs-only",
        action="store_true",
        help="measure nothing: hold the documents against the card",
    )
    parser.add_argument(
        "--list", action="store_true", help="list the runs: name, number of figures, command"
    )
    parser.add_argument(
        "--update", action="store_true", help="write what is measured into card and documents"
    )
    options = parser.parse_args(argv)
    for path in (options.binary,) if options.data is None else (options.binary, options.data):
        if not (options.list or options.docs_only or path.exists()):
            parser.error(f"there is no {path}")
    return options


def _chosen(card: Card, options: argparse.Namespace) -> List[Run]:
    """The runs that are asked for, each with the figures that are."""
    runs = card.runs
    if options.only:
        names = options.only.split(",")
        ids = {run.id for run in runs} | {figure.id for figure in card.figures}
        for name in names:
            if name not in ids:
                raise CardError(f"the card has no {name}")
        runs = [_part(run, lambda f: f.id in names or f.id.split(".")[0] in names) for run in runs]
    if options.quick:
        runs = [run for run in runs if run.is_quick]
    if options.kind:
        runs = [_part(run, lambda f: f.kind == options.kind) for run in runs]
    return [run for run in runs if run.figures]


def _part(run: Run, condition: Any) -> Run:
    return Run(run.id, run.command, run.is_quick, [f for f in run.figures if condition(f)])


def _report(run: Run, binary: Path, data: Optional[Path]) -> Any:
    """What a command prints."""
    words = shlex.split(run.command)
    if data is not None:
        words = [word.replace(DATA, f"{data.resolve()}/") for word in words]
    if words[0] in ("cogmap", "cogmap-lab"):
        words[0] = str(binary.resolve().with_name(words[0]))
    try:
        done = subprocess.run(
            words,
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            timeout=_COMMAND_S,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RunError(str(error)) from error
    if done.returncode != 0:
        raise RunError(f"ended with {done.returncode}: {done.stderr.strip()[-500:]}")
    try:
        return json.loads(done.stdout)
    except ValueError as error:
        raise RunError(f"printed no JSON: {error}") from error


def _tell(
    verdicts: List[Verdict], skipped: List[str], failed: List[Verdict], errors: List[str]
) -> None:
    """The result, for programs and for people."""
    figures: List[Dict[str, Any]] = [
        {
            "id": verdict.figure.id,
            "class": verdict.figure.kind,
            "unit": verdict.figure.unit,
            "better": verdict.figure.better,
            "tolerance": str(verdict.figure.tolerance),
            "committed": verdict.figure.value,
            "measured": verdict.measured,
            "outcome": verdict.outcome,
            "command": verdict.figure.command,
        }
        for verdict in verdicts
    ]
    failures = [verdict.explain() for verdict in failed] + errors
    print(
        json.dumps(
            {"figures": figures, "skipped": skipped, "failures": failures}, ensure_ascii=False
        )
    )
    for verdict in verdicts:
        figure = verdict.figure
        said = "-" if verdict.measured is None else f"{verdict.measured:.6g}"
        row = f"{figure.id:<44} {figure.value:>12.6g} {said:>12} {figure.unit:<8}"
        _say(f"{row} {verdict.outcome}")
    if skipped:
        _say(f"{len(skipped)} figures need data sets and were left out")
    for failure in failures:
        _say(f"FAILED {failure}")


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
