"""The binary under test."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Dict, Sequence

#: What the workspace built last in the dev profile.
_BUILT = Path(__file__).resolve().parents[2] / "target" / "debug" / "cogmap"
#: Longest run of a command, on a machine that is busy with other tests [s].
_COMMAND_S = 300.0


def binary() -> str:
    """The binary `cogmap`: `COGMAP_BIN`, or what the workspace built last."""
    path = Path(os.environ.get("COGMAP_BIN", _BUILT))
    if not path.is_file():
        raise FileNotFoundError(
            f"there is no binary at {path}: run `cargo build --workspace --all-targets` first, or "
            "name one in COGMAP_BIN"
        )
    return str(path)


def environment() -> Dict[str, str]:
    """The caller's environment without the settings of the service."""
    return {name: value for name, value in os.environ.items() if not name.startswith("COGMAP_")}


def run(*arguments: object) -> str:
    """Runs a command of `cogmap` to its end, a good one, and returns what it printed."""
    return _finish(binary(), arguments)


def lab(*arguments: object) -> str:
    """The same with `cogmap-lab`, which lies beside `cogmap`."""
    return _finish(str(Path(binary()).with_name("cogmap-lab")), arguments)


def _finish(program: str, arguments: Sequence[object]) -> str:
    done = subprocess.run(
        [program, *map(str, arguments)],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        timeout=_COMMAND_S,
    )
    assert done.returncode == 0, f"{done.args} ended with {done.returncode}: {done.stderr}"
    return done.stdout
