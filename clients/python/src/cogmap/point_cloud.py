"""The places of a space as points: the binary PLY that the service exports."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Dict, List, Tuple

from .errors import WireError
from .vector import Vec3

#: A vertex: id, x, y, z, strength, visits, first and last stamp.
_VERTEX = struct.Struct("<I3ffI2d")
_NUMBER = struct.Struct("<I")
#: The header's lines about one vertex and one forgotten place.
_PROPERTIES = [
    "uint id",
    "float x",
    "float y",
    "float z",
    "float strength",
    "uint visits",
    "double first_s",
    "double last_s",
]


@dataclass(frozen=True)
class CloudPlace:
    """A place, in short."""

    #: Position in `map` [m], in single precision.
    position_m: Vec3
    #: How much it has been used, fading with time.
    strength: float
    visits: int
    #: Stamp of its founding and of its latest visit [s].
    first_s: float
    last_s: float


@dataclass(frozen=True)
class PointCloud:
    """Places by number: all of a space, or what changed since a revision."""

    #: Number of records that it includes.
    revision: int
    #: It has what changed after this revision, and perhaps more; 0 where it has all places.
    since_revision: int
    places: Dict[int, CloudPlace]
    #: Numbers of places that have been forgotten.
    forgotten: Tuple[int, ...]

    @classmethod
    def read(cls, ply: bytes) -> PointCloud:
        """Reads what the service exports; `WireError` if it is something else."""
        head, separator, body = ply.partition(b"end_header\n")
        try:
            lines = head.decode("ascii").splitlines()
            known = lines[:2] == ["ply", "format binary_little_endian 1.0"]
            properties = [line[9:] for line in lines if line.startswith("property ")]
            if not known or not separator or properties[: len(_PROPERTIES)] != _PROPERTIES:
                raise WireError("not a point cloud of a space")
            n_places = _number(lines, "element vertex ")
            n_forgotten = _number(lines, "element forgotten ", 0)
            at = n_places * _VERTEX.size
            if len(body) != at + n_forgotten * _NUMBER.size:
                raise WireError("a point cloud that is cut off, or goes on after its end")
            places = {
                number: CloudPlace((x, y, z), strength, visits, first_s, last_s)
                for number, x, y, z, strength, visits, first_s, last_s in _VERTEX.iter_unpack(
                    body[:at]
                )
            }
            return cls(
                _number(lines, "comment revision "),
                _number(lines, "comment since_revision "),
                places,
                tuple(number for (number,) in _NUMBER.iter_unpack(body[at:])),
            )
        except ValueError as error:
            raise WireError(f"not a point cloud: {error}") from error

    def update(self, changed: PointCloud) -> PointCloud:
        """This cloud with what changed since it; `changed` alone where that has all places."""
        if changed.since_revision == 0:
            return changed
        if changed.since_revision > self.revision:
            raise WireError(
                f"what changed after revision {changed.since_revision} cannot update a cloud of "
                f"revision {self.revision}"
            )
        gone = frozenset(changed.forgotten)
        kept = {number: place for number, place in self.places.items() if number not in gone}
        return PointCloud(changed.revision, self.since_revision, {**kept, **changed.places}, ())


def _number(lines: List[str], name: str, default: int = -1) -> int:
    """The number after a name at the beginning of a line."""
    found = [line[len(name) :] for line in lines if line.startswith(name)]
    if not found and default < 0:
        raise WireError(f"a point cloud without {name.strip()!r}")
    return int(found[0]) if found else default
