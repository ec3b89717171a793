"""A made-up recording of a team of robots, in the text format of UTIAS MRCLAM."""

from __future__ import annotations

import math
import random
from pathlib import Path
from typing import Dict, List, Tuple

ROBOTS = (1, 2, 3)
#: Positions of the landmarks [m], by subject; subjects below 6 are robots.
LANDMARKS: Dict[int, Tuple[float, float]] = {6: (2, 2), 7: (-2, 2), 8: (-2, -2), 9: (2, -2)}
_STEPS = 600
_STEP_S = 0.05
#: As large as the times of real recordings, to have their rounding.
_START_S = 1_248_272_272


def write_recording(directory: Path, seed: int) -> None:
    """Half a minute of robots on arcs that differ in speed and turn, with noisy odometry, sightings
    of landmarks and of one another, and now and then a barcode that nobody has."""
    chance = random.Random(seed)
    code = {subject: 10 * subject + 5 for subject in (*ROBOTS, *LANDMARKS)}
    _write(directory / "Barcodes.dat", [f"{subject} {code[subject]}" for subject in code])
    surveyed = [f"{subject} {x} {y} 0.001 0.001" for subject, (x, y) in LANDMARKS.items()]
    _write(directory / "Landmark_Groundtruth.dat", surveyed)
    for robot in ROBOTS:
        speed_m_s, turn_rad_s = 0.1 + 0.05 * robot, 0.2 - 0.05 * robot
        x, y, heading = robot - 2.0, 0.0, 0.3 * robot
        odometry: List[str] = []
        truth: List[str] = []
        seen: List[str] = []
        for step in range(_STEPS):
            # The robots' clocks do not tick together.
            time_ms = round(1000 * step * _STEP_S) + 7 * robot
            stamp = f"{_START_S + time_ms // 1000}.{time_ms % 1000:03}"
            noise = chance.uniform(-0.02, 0.02)
            odometry.append(f"{stamp} {speed_m_s + noise:.4f} {turn_rad_s + noise:.4f}")
            truth.append(f"{stamp} {x:.5f} {y:.5f} {_wrapped(heading):.5f}")
            if step % 15 == robot:
                barcode = code[chance.choice([*LANDMARKS, *set(ROBOTS) - {robot}])]
                if step % 60 == robot:
                    barcode = 99
                distance_m, azimuth_rad = chance.uniform(0.5, 4.0), chance.uniform(-1.0, 1.0)
                seen.append(f"{stamp} {barcode} {distance_m:.4f} {azimuth_rad:.4f}")
            x += _STEP_S * speed_m_s * math.cos(heading)
            y += _STEP_S * speed_m_s * math.sin(heading)
            heading += _STEP_S * turn_rad_s
        tables = {"Odometry": odometry, "Groundtruth": truth, "Measurement": seen}
        for table, rows in tables.items():
            _write(directory / f"Robot{robot}_{table}.dat", rows)


def _write(file: Path, rows: List[str]) -> None:
    file.write_text("\n".join(["# made up", *rows, ""]))


def _wrapped(angle_rad: float) -> float:
    return math.atan2(math.sin(angle_rad), math.cos(angle_rad))
