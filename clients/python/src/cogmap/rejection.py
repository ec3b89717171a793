"""Refused samples of a session: kept as ranges, and told in ranges."""

from __future__ import annotations

from dataclasses import replace
from typing import Dict, List, Optional, Sequence, Tuple

from .answer import Rejection, SeqRange, SkipReason

#: Ranges remembered, the latest ones.
_RANGES_MAX = 1024
#: Refusals are told when none has come for this long [s] …
_QUIET_S = 0.25
#: … or the first that is not told is this old [s]. Doubled while more and more are refused …
_GATHER_S = 1.0
#: … up to this.
_GATHER_MAX_S = 60.0


class Rejections:
    """The refused ranges of a session.

    Watermarks name the latest few again and again, the last of them growing. Each sample is told
    once here, together with its neighbours. Pure logic: times come in as arguments.
    """

    def __init__(self) -> None:
        # Disjoint, by their starts.
        self._known: List[Rejection] = []
        self._untold: List[Rejection] = []
        self._latest: Tuple[Rejection, ...] = ()
        self._first_at = 0.0
        self._last_at = 0.0
        self._gather_s = _GATHER_S

    @property
    def ranges(self) -> Tuple[Rejection, ...]:
        """All that are remembered, by number."""
        return tuple(self._known)

    def reason_of(self, seq: int) -> Optional[SkipReason]:
        """Why a sample was refused, if it was."""
        at = _first_behind(self._known, seq) - 1
        if at >= 0 and seq < self._known[at].range.stop:
            return self._known[at].reason
        return None

    def take(self, rejected: Tuple[Rejection, ...], now: float) -> None:
        """Takes in what a watermark says."""
        if rejected == self._latest:
            return
        self._latest = rejected
        for rejection in rejected:
            for start, stop in self._unknown(rejection.range):
                fresh = replace(rejection, range=SeqRange(start, stop))
                if not self._untold:
                    self._first_at = now
                self._last_at = now
                _insert(self._known, fresh)
                _insert(self._untold, fresh)
        del self._known[:-_RANGES_MAX]

    def tell_at(self) -> Optional[float]:
        """When `tell` next has something to say by itself."""
        if not self._untold:
            return None
        return min(self._last_at + _QUIET_S, self._first_at + self._gather_s)

    def tell(self, now: float, at_once: bool = False) -> Tuple[Rejection, ...]:
        """The ranges to tell now; each sample is in one of them once."""
        at = self.tell_at()
        if at is None or (now < at and not at_once):
            return ()
        quiet = now >= self._last_at + _QUIET_S
        self._gather_s = _GATHER_S if quiet else min(2 * self._gather_s, _GATHER_MAX_S)
        told, self._untold = tuple(self._untold), []
        return told

    def _unknown(self, wanted: SeqRange) -> List[Tuple[int, int]]:
        """The parts of a range that are not known yet."""
        parts = []
        start = wanted.start
        for rejection in self._known[max(0, _first_behind(self._known, start) - 1) :]:
            if rejection.range.start >= wanted.stop:
                break
            if rejection.range.start > start:
                parts.append((start, rejection.range.start))
            start = max(start, rejection.range.stop)
        if start < wanted.stop:
            parts.append((start, wanted.stop))
        return parts


def sentences(told: Sequence[Rejection], stamps: Dict[int, str]) -> List[str]:
    """One sentence for each reason. `stamps` says of some samples how their stamps run
    backwards."""
    by_reason: Dict[SkipReason, List[SeqRange]] = {}
    for rejection in told:
        by_reason.setdefault(rejection.reason, []).append(rejection.range)
    lines = []
    for reason, ranges in by_reason.items():
        count = sum(one.stop - one.start for one in ranges)
        first, last = ranges[0].start, ranges[-1].stop - 1
        if count == 1:
            which = f"sample {first}"
        elif len(ranges) == 1:
            which = f"samples {first} to {last}"
        else:
            which = f"{count} samples from {first} to {last}"
        why = next(
            (stamps[seq] for one in ranges for seq in stamps if one.start <= seq < one.stop), ""
        )
        detail = f" ({why})" if why and reason is SkipReason.TIME_BACKWARDS else ""
        lines.append(f"{which} refused: {reason.value}{detail}")
    return lines


def _first_behind(ranges: List[Rejection], seq: int) -> int:
    """Index of the first range that starts behind a number."""
    low, high = 0, len(ranges)
    while low < high:
        middle = (low + high) // 2
        if ranges[middle].range.start <= seq:
            low = middle + 1
        else:
            high = middle
    return low


def _insert(ranges: List[Rejection], fresh: Rejection) -> None:
    """Inserts a range that overlaps none, as one with the neighbours that it continues."""
    at = _first_behind(ranges, fresh.range.start)
    if at < len(ranges):
        behind = ranges[at]
        if behind.reason is fresh.reason and behind.range.start == fresh.range.stop:
            fresh = replace(fresh, range=SeqRange(fresh.range.start, behind.range.stop))
            del ranges[at]
    if at > 0:
        before = ranges[at - 1]
        if before.reason is fresh.reason and before.range.stop == fresh.range.start:
            at -= 1
            fresh = replace(fresh, range=SeqRange(before.range.start, fresh.range.stop))
            del ranges[at]
    ranges.insert(at, fresh)
