"""How much waits in a run of a robot, how long the run waits, and what it says then."""

from __future__ import annotations

from typing import Optional

from .answer import SeqRange
from .window import Window

#: Estimates that wait for the callback; beyond it the oldest are dropped.
ESTIMATES_WAITING_MAX = 4096
#: Watermarks and refusals that wait; a later one says all that an earlier one did.
ANSWERS_WAITING_MAX = 256
#: How long a full batch waits for its turn on the caller's thread [s]: longer than a put takes, and
#: far less than one on a congested network.
TURN_S = 0.1
#: How often the arrival of the service is looked for [s].
MATCH_POLL_S = 0.01
#: How long a robot waits at its start for the watermark that the service has of it, and again
#: before the first batch if none came [s].
FIRST_ANSWER_S = 0.5
SECOND_ANSWER_S = 0.2
#: How often is asked whether a problem is over [s].
PROBLEM_S = 1.0
#: Why no estimate comes of a robot that has said nothing.
NOTHING_SENT = ": the robot has sent no sample yet"
#: What may be wrong when nothing is acknowledged: Zenoh tells nobody what its rules drop.
UNHEARD = (
    ", and the service has acknowledged none: the access rules of Zenoh may not let this user "
    "publish under the agent's name, or hear of it"
)


def silence(window: Window, gap: Optional[SeqRange], is_unheard: bool) -> str:
    """Why a service that is there may not acknowledge; empty if nothing is known of it."""
    if not window.next_seq:
        return NOTHING_SENT
    if gap is not None:
        last = gap.stop - 1
        which = f"sample {last}" if gap.start == last else f"samples {gap.start} to {last}"
        then = "which are sent again"
        if gap.start < window.durable:
            # A space that was deleted and made anew, or a store from a backup.
            then = "which this robot no longer has, and gives them up after a while"
        return f": the service waits for {which}, {then}"
    return UNHEARD if is_unheard and window.sent else ""
