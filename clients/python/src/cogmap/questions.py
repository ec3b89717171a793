"""Questions to a map: where, which way, what next, and where then."""

from __future__ import annotations

from typing import Iterable, Optional, Tuple, cast

from .felt import FeltAnswer, FeltQuery
from .http_service import HttpService, Query
from .localize import Localization, LocalizeQuery
from .request import json_of, path_of
from .route import (
    RouteAnswer,
    RouteAvoid,
    RouteBox,
    RouteCost,
    RouteEnd,
    RouteFormat,
    RouteQuery,
    RouteReverse,
)
from .sample import Sample
from .scalar import listed
from .sequence import AnyElement, SequenceAnswer, SequenceQuery, element
from .trajectory import AgentAt
from .vector import Vec3
from .wire import JSON


class Questions(HttpService):
    """What a map is asked and works out."""

    def localize(self, space: str, samples: Iterable[Sample]) -> Localization:
        """Where a sequence of samples of one robot was taken, 1 to 4096 of them. They need no agent
        and change nothing. Start poses and episodes with objects are refused; a service that is at
        several of these already asks to come back (503)."""
        query = LocalizeQuery(cast(Tuple[Sample, ...], samples))
        path = path_of(space, "localize")
        return self._send(Localization, "POST", path, JSON, json_of("query", query))

    def route(
        self,
        space: str,
        start: RouteEnd,
        goal: RouteEnd,
        *,
        cost: RouteCost = RouteCost.LENGTH,
        reverse: RouteReverse = RouteReverse.ALLOWED,
        avoid_places: Iterable[int] = (),
        avoid_boxes: Iterable[RouteBox] = (),
        shortcuts: bool = False,
        body_radius_m: Optional[float] = None,
        alternatives: int = 0,
        path_spacing_m: Optional[float] = None,
    ) -> RouteAnswer:
        """How one gets from `start` to `goal` (`AtAgent`, `AtPlace`, `AtPosition`, …), by ways that
        the team has gone: the cheapest by `cost`, and up to four `alternatives`. With `shortcuts`
        it cuts corners within `body_radius_m` [m] of ways. With `path_spacing_m` there are poses
        along it, so far apart [m]. A service that is at several of these already asks to come back
        (503)."""
        query = RouteQuery(
            start,
            goal,
            cost=cost,
            reverse=reverse,
            avoid=RouteAvoid(
                listed("avoid_places", avoid_places), listed("avoid_boxes", avoid_boxes)
            ),
            shortcuts=shortcuts,
            body_radius_m=body_radius_m,
            alternatives=alternatives,
            format=RouteFormat.STEPS if path_spacing_m is None else RouteFormat.PATH,
            spacing_m=path_spacing_m,
        )
        path = path_of(space, "route")
        return self._send(RouteAnswer, "POST", path, JSON, json_of("query", query))

    def sequence(
        self,
        space: str,
        cue: Iterable[AnyElement],
        *,
        error_rate: Optional[float] = None,
        none_prior: Optional[float] = None,
        limit: Optional[int] = None,
    ) -> SequenceAnswer:
        """Which trips the last places of somebody look like, and what comes next. `cue` has the
        places by number, or what was sensed there (`Level`, `Descriptor`), oldest first;
        `error_rate` of them are wrong, and `none_prior` says how likely nobody has travelled
        such a sequence. A service that is at several of these already asks to come back (503)."""
        elements = tuple(map(element, listed("cue", cue)))
        query = SequenceQuery(elements, error_rate, none_prior, limit)
        path = path_of(space, "sequence")
        return self._send(SequenceAnswer, "POST", path, JSON, json_of("query", query))

    def felt(
        self,
        space: str,
        position_m: Vec3,
        *,
        radius_m: Optional[float] = None,
        since_ns: Optional[int] = None,
        channels: Optional[Iterable[str]] = None,
        limit: Optional[int] = None,
    ) -> FeltAnswer:
        """What was felt near a point [m] since a stamp, by what the places within `radius_m` of it
        remember, also of some `channels` only. That nobody looked (`Looked.NEVER`) is told from
        that somebody did and felt nothing."""
        names = None if channels is None else listed("channels", channels)
        query = FeltQuery(position_m, radius_m, since_ns, names, limit)
        path = path_of(space, "felt")
        return self._send(FeltAnswer, "POST", path, JSON, json_of("query", query))

    def agent_at(
        self,
        space: str,
        agent: str,
        stamp_ns: int,
        *,
        refined: bool = False,
        session: Optional[int] = None,
    ) -> AgentAt:
        """Where an agent was at a stamp, as it was known then; with `refined` by all that has been
        seen since. Of its current session, or of `session`, which is for causal poses only. A stamp
        that is not known breaks a rule (422)."""
        query: Query = {
            "stamp_ns": stamp_ns,
            "trajectory": "refined" if refined else "causal",
            "session": session,
        }
        return self._get(AgentAt, path_of(space, "agents", agent, "at"), query)
