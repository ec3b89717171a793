"""Publishes a recorded team of robots: one or all of a data set in the MRCLAM text format.

    python mrclam.py DIR --space lab                  # the whole team, in the order of its stamps
    python mrclam.py DIR --space lab --robots 3       # one robot

Files in DIR (times in seconds of the Unix clock, SI units, radians; `#` begins a comment):

    Barcodes.dat               subject, barcode      (subjects 1-5 robots, 6-20 landmarks)
    Robot<r>_Odometry.dat      t, forward velocity, turn rate; a command holds until the next row
    Robot<r>_Measurement.dat   t, barcode, range, bearing (left positive)
    Robot<r>_Groundtruth.dat   t, x, y, heading; only the start pose is taken from it

The stream of a robot covers the span t0 to t1 that all odometry and truth tables have in common. It
begins with the true pose at t0; each command becomes velocity samples, cut where a sighting falls,
so that motion and sightings are in their exact order.
"""

from __future__ import annotations

import argparse
import bisect
import json
import math
import sys
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal
from pathlib import Path
from typing import Dict, Iterable, Iterator, List, Optional, Sequence, Tuple

import cogmap

#: Subjects below this number are robots.
FIRST_LANDMARK = 6
#: A last command holds no longer than this.
LAST_COMMAND_NS = 1_000_000_000
#: Noise of the sightings [m, rad].
RANGE_SD_M = 0.15
BEARING_SD_RAD = 0.025

#: A time [ns] and the columns behind it.
Row = Tuple[int, List[float]]


@dataclass(frozen=True)
class Recording:
    """The tables of one robot, by time."""

    odometry: List[Row]
    #: Rows of subject, range, bearing; subject 0 where the barcode is in no table.
    sightings: List[Row]
    truth: List[Row]


def parse_ns(text: str) -> int:
    """Seconds as decimal text to whole nanoseconds. Not by way of a float: at Unix times its steps
    are 200 ns wide."""
    return int((Decimal(text) * 1_000_000_000).to_integral_value(ROUND_HALF_EVEN))


def lines(path: Path) -> Iterator[List[str]]:
    """The columns of each line that has any."""
    for line in path.read_text().splitlines():
        columns = line.split("#")[0].split()
        if columns:
            yield columns


def table(path: Path) -> List[Row]:
    """The rows of a file by time; rows of the same time stay in the order of the file."""
    rows = [(parse_ns(columns[0]), [float(x) for x in columns[1:]]) for columns in lines(path)]
    return sorted(rows, key=lambda row: row[0])


def load(directory: Path) -> Dict[int, Recording]:
    """The recordings by robot number. A robot without odometry or truth is left out."""
    barcodes = lines(directory / "Barcodes.dat")
    subject_of = {int(barcode): int(subject) for subject, barcode in barcodes}
    recordings = {}
    for robot in range(1, FIRST_LANDMARK):
        odometry = directory / f"Robot{robot}_Odometry.dat"
        truth = directory / f"Robot{robot}_Groundtruth.dat"
        if not (odometry.exists() and truth.exists()):
            continue
        measurements = directory / f"Robot{robot}_Measurement.dat"
        seen = table(measurements) if measurements.exists() else []
        recordings[robot] = Recording(
            odometry=table(odometry),
            sightings=[(t, [subject_of.get(int(code), 0), *rest]) for t, (code, *rest) in seen],
            truth=table(truth),
        )
    return recordings


def common_span(recordings: Dict[int, Recording]) -> Tuple[int, int]:
    """The span [ns] that the odometry and the truth of every robot cover."""
    tables = [rows for one in recordings.values() for rows in (one.odometry, one.truth)]
    return max(rows[0][0] for rows in tables), min(rows[-1][0] for rows in tables)


def start_pose(truth: List[Row], at_ns: int) -> cogmap.StartPose:
    """The true pose, between two rows in proportion to time, the heading by the shorter way."""
    after = bisect.bisect_right([t for t, _ in truth], at_ns)
    (t0, a), (t1, b) = truth[max(0, after - 1)], truth[min(after, len(truth) - 1)]
    share = (at_ns - t0) / (t1 - t0) if t1 > t0 else 0.0
    x, y = (a[i] + share * (b[i] - a[i]) for i in (0, 1))
    turn = b[2] - a[2]
    if abs(turn) > math.pi:
        turn = (turn + math.pi) % (2 * math.pi) - math.pi
    heading = a[2] + share * turn
    rotation = (0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2))
    return cogmap.StartPose((x, y, 0.0), rotation)


def sightings(
    robot: int, team: Iterable[int], rows: List[Row], t0: int, t1: int
) -> List[cogmap.Sample]:
    """The usable sightings strictly within the span: landmarks, and other robots of the team."""
    unusable = set(range(FIRST_LANDMARK)) - (set(team) - {robot})
    samples = []
    for t, (subject, range_m, bearing_rad) in rows:
        if not t0 < t < t1 or subject in unusable:
            continue
        target: cogmap.Target = (
            cogmap.AgentTarget(f"robot{int(subject)}")
            if subject < FIRST_LANDMARK
            else cogmap.LandmarkTarget(f"landmark-{int(subject)}")
        )
        relation = cogmap.RangeBearing(range_m, bearing_rad, RANGE_SD_M, BEARING_SD_RAD)
        samples.append(cogmap.Sample(t, cogmap.Sighting(target, relation)))
    return samples


def motion(rows: List[Row], cuts: Sequence[int], t0: int, t1: int) -> Iterator[cogmap.Sample]:
    """The commands in force from t0 to t1, cut at the times `cuts`, which ascend."""
    for index, (begin, (v, w)) in enumerate(rows):
        last = index + 1 == len(rows)
        end = min(begin + LAST_COMMAND_NS if last else rows[index + 1][0], t1)
        start = max(begin, t0)
        if end <= start:
            continue
        inner = cuts[bisect.bisect_right(cuts, start) : bisect.bisect_left(cuts, end)]
        for stop in [*inner, end]:
            # Two sightings of the same time cut only once.
            if stop > start:
                duration_s = (stop - start) * 1e-9
                body = cogmap.Velocity((v, 0.0, 0.0), (0.0, 0.0, w), duration_s)
                yield cogmap.Sample(stop, body)
                start = stop


def stream(
    robot: int, recordings: Dict[int, Recording], t0: int, t1: int
) -> List[cogmap.Sample]:
    """All samples of a robot in order: at the same stamp motion comes before the sighting at its
    end."""
    recording = recordings[robot]
    seen = sightings(robot, recordings, recording.sightings, t0, t1)
    moved = motion(recording.odometry, [sample.stamp_ns for sample in seen], t0, t1)
    first = cogmap.Sample(t0, start_pose(recording.truth, t0))
    # The sort keeps the order of equal stamps.
    return [first, *sorted([*moved, *seen], key=lambda sample: sample.stamp_ns)]


def merged(streams: Dict[int, List[cogmap.Sample]]) -> List[Tuple[int, cogmap.Sample]]:
    """The samples of all robots by stamp, then by robot number."""
    tagged = [(robot, sample) for robot in sorted(streams) for sample in streams[robot]]
    return sorted(tagged, key=lambda entry: entry[1].stamp_ns)


def main(arguments: Optional[List[str]] = None) -> None:
    """Publishes, waits until everything is durable, and prints one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("directory", type=Path)
    parser.add_argument("--connect", default=cogmap.DEFAULT_ENDPOINT, help="Zenoh endpoint")
    parser.add_argument("--space", default="default")
    parser.add_argument(
        "--session",
        type=int,
        help="session of every robot; with 1, the map's digest is that of `cogmap-lab replay`",
    )
    parser.add_argument("--robots", type=int, nargs="*", help="numbers; all when absent")
    parser.add_argument("--limit", type=int, help="publish only this many samples")
    parser.add_argument(
        "--window", type=int, default=1024, help="most samples of a robot without acknowledgement"
    )
    args = parser.parse_args(arguments)

    recordings = load(args.directory)
    if not recordings:
        parser.error(f"{args.directory}: no robot has both odometry and truth")
    # The span is that of the whole team, also when only some of it is published.
    t0, t1 = common_span(recordings)
    chosen = sorted(recordings) if args.robots is None else args.robots
    if not set(chosen) <= set(recordings):
        parser.error(f"robots {sorted(recordings)} are there, not {chosen}")
    samples = merged({robot: stream(robot, recordings, t0, t1) for robot in chosen})
    samples = samples[: args.limit]
    print(f"{len(samples)} samples over {(t1 - t0) * 1e-9:.3f} s", file=sys.stderr)

    link = cogmap.open_session(args.connect)
    # Over one link and without batches, the samples of all robots arrive in the order of the calls.
    robots = {
        number: cogmap.Robot(
            args.space,
            f"robot{number}",
            session=link,
            session_id=args.session,
            batch_samples=1,
            window_samples=args.window,
            send_timeout_s=60.0,
            # The recording ends, and its robots drive on.
            ends_session=False,
        )
        for number in chosen
    }
    try:
        for robot in robots.values():
            if not robot.wait_for_service():
                sys.exit(f"nobody listens to {robot.agent} at {args.connect}")
        for number, sample in samples:
            robots[number].send([sample])
        for robot in robots.values():
            robot.flush(120.0)
        print(json.dumps({robot.agent: summary(robot) for robot in robots.values()}))
    finally:
        for robot in robots.values():
            robot.close()
        link.close()  # type: ignore[no-untyped-call]  # zenoh leaves it without a type


def summary(robot: cogmap.Robot) -> Dict[str, object]:
    """How far a robot came, and where it is."""
    watermark, estimate = robot.watermark, robot.estimate()
    return {
        "durable": watermark.durable if watermark is not None else 0,
        "rejected": sum(entry.range.stop - entry.range.start for entry in robot.rejections),
        "stamp_ns": estimate.stamp_ns,
        "status": estimate.status.value,
        "translation_m": estimate.translation_m,
    }


if __name__ == "__main__":
    main()
