"""What became of an agent's sightings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional


@dataclass(frozen=True)
class Evidence:
    """What became of an agent's sightings of landmarks and of other agents, over all sessions."""

    #: Sightings that corrected the map and its agents.
    accepted: int
    #: Sightings refused, as too far from what the map says.
    refused: int
    #: Of those, how many one after the other up to now, without those of landmarks that no second
    #: sighting has confirmed, or 4 when they have put the agent elsewhere; from 4 on it is not
    #: `localized`.
    refused_in_a_row: int
    #: Mean of the squared error of the accepted ones' components, each over what was expected of
    #: it: 1 where the stated noise is honest, more where it is too small. Absent before the first
    #: one.
    nis_mean: Optional[float]
