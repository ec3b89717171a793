"""The part of the HTTP interface that tells robots and routes what to heed."""

from __future__ import annotations

from typing import Iterable, Iterator, Tuple

from .guidance import (
    Blockage,
    BlockageList,
    BlockageRequest,
    FollowedRoute,
    FollowedRoutePage,
    FollowedRouteSummary,
    FollowRequest,
)
from .http_service import HttpService, Query
from .request import id_of, json_of, path_of
from .route import RouteAvoid, RouteBox, RouteCost, RouteEnd, RouteReverse
from .scalar import listed, one_of
from .wire import JSON


class GuidanceClient(HttpService):
    """Blockages, routes that agents follow, and pinned trips."""

    def follow_route(
        self,
        space: str,
        agent: str,
        goal: RouteEnd,
        *,
        cost: RouteCost = RouteCost.LENGTH,
        reverse: RouteReverse = RouteReverse.ALLOWED,
        avoid_places: Iterable[int] = (),
        avoid_boxes: Iterable[RouteBox] = (),
    ) -> FollowedRoute:
        """Lets an agent follow a route to `goal` from where it is, in place of any that it follows.
        Events tell its progress; when it leaves the route, or a blockage comes onto it, it gets
        another one."""
        avoid = RouteAvoid(listed("avoid_places", avoid_places), listed("avoid_boxes", avoid_boxes))
        request = FollowRequest(goal, cost, reverse, avoid)
        path = path_of(space, "agents", agent, "route")
        return self._send(FollowedRoute, "PUT", path, JSON, json_of("request", request))

    def followed_route(self, space: str, agent: str) -> FollowedRoute:
        """What is left of the route that an agent follows."""
        return self._get(FollowedRoute, path_of(space, "agents", agent, "route"))

    def followed_routes(self, space: str) -> Iterator[FollowedRouteSummary]:
        """What is left of the routes that agents follow, without the steps, by agent."""
        query: Query = {}
        while True:
            page = self._get(FollowedRoutePage, path_of(space, "routes"), query)
            yield from page.routes
            if page.next is None:
                return
            query["after"] = page.next

    def stop_following(self, space: str, agent: str) -> None:
        """Lets an agent follow its route no more."""
        self._request("DELETE", path_of(space, "agents", agent, "route"))

    def blockages(self, space: str) -> Tuple[Blockage, ...]:
        """The blockages of a space, by number."""
        return self._get(BlockageList, path_of(space, "blockages")).blockages

    def block(self, space: str, request: BlockageRequest) -> Blockage:
        """Says where nobody gets through: no route leads there until that is taken back, its time
        has come, or somebody travels there."""
        one_of("request", request, (BlockageRequest,))
        path = path_of(space, "blockages")
        return self._send(Blockage, "POST", path, JSON, json_of("request", request))

    def unblock(self, space: str, blockage: int) -> None:
        """Ends a blockage."""
        self._request("DELETE", path_of(space, "blockages", id_of("blockage", blockage)))

    def pin_trip(self, space: str, trip: int) -> None:
        """Pins a trip, which then is never forgotten."""
        self._request("PUT", path_of(space, "trips", id_of("trip", trip), "pin"))

    def unpin_trip(self, space: str, trip: int) -> None:
        """Lets a trip be forgotten like others."""
        self._request("DELETE", path_of(space, "trips", id_of("trip", trip), "pin"))
