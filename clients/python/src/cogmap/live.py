"""Ticks of a live stream: what changed in a space since the tick before."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from .estimate import Status
from .event import EventRecord, MissedEvents
from .sample import Target
from .vector import Quaternion, Vec3


@dataclass(frozen=True)
class LiveAgent:
    """Where an agent is, in short."""

    name: str
    session: int
    #: Sequence number of the latest sample that the estimate includes.
    seq: int
    #: Stamp of that sample [ns].
    stamp_ns: int
    status: Status
    #: Frame of the pose: `map`; or `unplaced` while the agent is lost and nothing ties it to the
    #: map.
    frame: str
    #: Position in that frame [m].
    translation_m: Vec3
    #: Orientation in that frame, unit quaternion `[x, y, z, w]`.
    rotation_xyzw: Quaternion
    #: Upper triangle, row by row, of the covariance of the position along its axes [m^2].
    position_covariance_m2: Tuple[float, float, float, float, float, float]
    #: Standard deviation of the orientation about them [rad].
    rotation_sd_rad: Vec3
    #: The place cell that answers strongest, if any does.
    place: Optional[int]
    #: Its confidence, in [0, 1]; 0 without a place.
    confidence: float
    #: Samples that are not durable yet, and those that wait for earlier ones.
    lag_samples: int
    #: Contacts of the episode with an object that is under way; `None` where there is none.
    contacts: Optional[int] = None
    #: Whether the latest sample of its session ended it.
    session_ended: bool = False
    #: How long before the tick the service received a message of it [s]; `None` before the first
    #: one since the service started.
    heard_ago_s: Optional[float] = None


@dataclass(frozen=True)
class LiveSighting:
    """A sighting that was applied, as the line of sight in `map`."""

    #: The agent that saw.
    agent: str
    #: Stamp of the sighting [ns].
    stamp_ns: int
    #: Position of the agent in `map` once the sighting was applied [m].
    from_m: Vec3
    #: Where the target is in `map` by the agent's pose and what was measured [m].
    to_m: Vec3
    #: What was seen: a landmark or an agent.
    target: Target


@dataclass(frozen=True)
class LiveCounts:
    """Sizes of a space."""

    agents: int
    places: int
    trips: int
    landmarks: int
    objects: int


@dataclass(frozen=True)
class LiveHealth:
    """How the service keeps up with what is sent to a space. Totals are since its start."""

    #: Samples applied in a second, over about the last one; `None` in the first tick.
    samples_per_s: Optional[float]
    #: Samples that wait for earlier ones, of all agents.
    waiting_samples: int
    #: Samples that are applied and not durable yet, of all agents.
    not_durable_samples: int
    #: Messages for the space that were dropped whole.
    dropped_messages: int
    #: Samples skipped for good.
    skipped_samples: int
    #: Samples received again.
    duplicate_samples: int
    #: Memory of the process that is in use [bytes]; `None` where the system does not tell.
    resident_bytes: Optional[int] = None


@dataclass(frozen=True)
class LiveTick:
    """What changed in a space since the tick before of the same stream; all of it in the first."""

    #: Number of records that all of this includes; some of it may include more.
    map_revision: int
    #: Agents of which the estimate or the lag changed, by name.
    agents: Tuple[LiveAgent, ...]
    #: Names of agents that are gone.
    removed: Tuple[str, ...]
    #: What happened, oldest first.
    events: Tuple[EventRecord, ...]
    #: That events were missed before these.
    missed: Optional[MissedEvents]
    #: The latest sightings that were applied, at most 64, oldest first.
    sightings: Tuple[LiveSighting, ...]
    counts: LiveCounts
    health: LiveHealth


@dataclass(frozen=True)
class LaggedTicks:
    """Ticks that were left out because this program was too slow for them."""

    #: How many.
    ticks: int
