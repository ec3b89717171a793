"""How much waits in a run of a robot, how long the run waits, and what it says then."""

from __future__ import annotations

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
#: What may be wrong when nothing is acknowledged: Zenoh tells nobody what its rules drop.
UNHEARD = (
    ", and the service has acknowledged none: the access rules of Zenoh may not let this user "
    "publish under the agent's name, or hear of it"
)
