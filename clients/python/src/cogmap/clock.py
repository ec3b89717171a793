"""The stamps of a session: those of the caller's clock, and those of the system's."""

from __future__ import annotations

import math
from typing import Dict, Optional

from .sample import Increment, SampleBody, Velocity
from .scalar import STAMP_RANGE

#: Farthest that stamps of the caller may be from the system's clock when both are used [s].
_CLOCKS_APART_S = 1.0
#: Stamped by the system's clock, velocities may last this much longer than they took to be sent [s]
#: …
_BURST_S = 2.0
#: … and this many times as long.
_BURST_RATIO = 1.5
#: In the same way increments may be this long at once [m] …
_BURST_M = 10.0
#: … and go at the speed of sound, which no robot exceeds [m/s].
_SPEED_M_S = 343.0
#: Samples whose stamps ran backwards that are remembered, the latest ones.
_BACKWARDS_MAX = 256

_ADVICE = "give every sample a stamp_ns of one clock, or none"


class SessionClock:
    """Gives stamps to samples that have none, and notices stamps that cannot be meant. Pure logic:
    the system's clock comes in as an argument [ns]."""

    def __init__(self) -> None:
        self.latest_ns = STAMP_RANGE[0]
        self._own_apart_s: Optional[float] = None
        self._uses_system = False
        self._told_mixed = False
        self._told_fast = False
        self._moving_since_ns: Optional[int] = None
        self._lasted_s = 0.0
        self._went_m = 0.0
        self._backwards: Dict[int, str] = {}
        self._was_backwards = False

    def stamp(self, now_ns: int) -> int:
        """The stamp of a sample that has none. The system's clock may be set back; the stamps of a
        session may not."""
        return max(now_ns, self.latest_ns)

    def take(self, seq: int, stamp_ns: int) -> None:
        """Takes note of the stamp of a sample, in the order of their numbers."""
        if stamp_ns < self.latest_ns:
            if not self._was_backwards:
                self._backwards[seq] = f"stamp {stamp_ns} before {self.latest_ns} [ns]"
                while len(self._backwards) > _BACKWARDS_MAX:
                    del self._backwards[next(iter(self._backwards))]
            self._was_backwards = True
            return
        self._was_backwards = False
        self.latest_ns = stamp_ns

    @property
    def backwards(self) -> Dict[int, str]:
        """How stamps ran backwards, by the first sample of each run of such samples."""
        return dict(self._backwards)

    def oddity(self, body: SampleBody, stamp_ns: Optional[int], now_ns: int) -> Optional[str]:
        """What cannot be meant about a sample that is handed over now, told once."""
        if stamp_ns is None:
            self._uses_system = True
        else:
            self._own_apart_s = (stamp_ns - now_ns) * 1e-9
        if not self._told_mixed and self._uses_system and self._own_apart_s is not None:
            if abs(self._own_apart_s) > _CLOCKS_APART_S:
                self._told_mixed = True
                return (
                    "samples with a stamp_ns and samples without one are mixed, and the given "
                    f"stamps are {self._own_apart_s:+.3g} s from the system's clock: {_ADVICE}"
                )
        if stamp_ns is None and not self._told_fast:
            return self._haste(body, now_ns)
        return None

    def _haste(self, body: SampleBody, now_ns: int) -> Optional[str]:
        if not isinstance(body, (Increment, Velocity)):
            return None
        if self._moving_since_ns is None:
            self._moving_since_ns = now_ns
        took_s = max(0.0, (now_ns - self._moving_since_ns) * 1e-9)
        if isinstance(body, Velocity):
            self._lasted_s += body.duration_s
        else:
            self._went_m += math.hypot(*body.translation_m)
        if self._lasted_s > _BURST_S + _BURST_RATIO * took_s:
            what = f"motion of {self._lasted_s:.3g} s"
        elif self._went_m > _BURST_M + _SPEED_M_S * took_s:
            what = f"motion of {self._went_m:.3g} m"
        else:
            return None
        self._told_fast = True
        return (
            f"{what} without stamp_ns was sent within {took_s:.3g} s, faster than real time: the "
            f"samples get the time of the call as their stamps; {_ADVICE.replace(', or none', '')}"
        )
