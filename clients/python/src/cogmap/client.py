"""The HTTP interface: spaces, agents, memories, events."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any, Iterable, Iterator, List, Optional, Tuple, Union, cast

from .answer import (
    AgentDetail,
    AgentPage,
    AgentSummary,
    GridState,
    IngestAnswer,
    Place,
    PlacePage,
    PlacePercepts,
    PredictAnswer,
    RecallAnswer,
    SpaceInfo,
    SpaceList,
    Trip,
    TripDetail,
    TripPage,
)
from .channel import Channel, ChannelList
from .errors import ApiError, InvalidValue
from .event import Event, EventPage, EventRecord, MissedEvents
from .guidance_client import GuidanceClient
from .http_service import Query
from .landmark import Landmark, LandmarkPage
from .live import LaggedTicks, LiveTick
from .object import (
    AgentObject,
    Contact,
    Identification,
    IdentifyQuery,
    ObjectDetail,
    ObjectLesson,
    ObjectPage,
    ObjectSummary,
)
from .point_cloud import PointCloud
from .query import MotionBody, PerceptCue, PredictQuery, RecallQuery
from .questions import Questions
from .request import id_of, json_of, path_of
from .retry import RETRY_TIMEOUT_S
from .route import RouteReverse
from .sample import NoTurn, Orientation, SampleBatch, TouchNoise
from .scalar import listed, one_of
from .settings import SpaceSettings
from .sse import ServerSentEvent
from .trajectory import StampedPose, Trajectory
from .vector import vec3
from .wire import CBOR, JSON, decode, encode, to_wire

_log = logging.getLogger("cogmap")


class Client(Questions, GuidanceClient):
    """Asks a cogmap service over HTTP.

    Holds no connection between calls, so it may be shared by threads. Lists that the service
    answers in pages are iterated to the end, page by page as they are consumed.

    Args:
        url: Address of the service, for example `http://127.0.0.1:8080`, or several, as those of
            the nodes of a cluster: when nothing listens at one the next is asked, and stays in use;
            for questions by GET and for samples also when the connection breaks.
        token: Bearer token, if the service asks for one.
        timeout_s: Longest silence of a connection [s].
        ca_file: File (PEM) with the authority that has signed the certificate of an `https://`
            service; the system's authorities when absent.
        retry_timeout_s: How long a request is sent again while its space moves to another owner
            (`/problems/moving`), with the pauses that the service asks for [s]; not at all with 0.
            Questions by GET and samples, which are applied once however often they come, are sent
            again also when the owner did not answer (`/problems/owner-lost`). What the service says
            after that time is raised.

    Raises (all methods, each with the address in its message):
        InvalidValue: An argument makes no sense; nothing was asked.
        ApiError: The service refused the request.
        WireError: The answer is not what the interface promises.
        Unreachable: Nothing answers at the address, or the connection broke.
        Timeout: The service fell silent.
    """

    def __init__(
        self,
        url: Union[str, Iterable[str]],
        token: Optional[str] = None,
        timeout_s: float = 10.0,
        ca_file: Optional[str] = None,
        retry_timeout_s: float = RETRY_TIMEOUT_S,
    ) -> None:
        super().__init__(url, token, timeout_s, ca_file, retry_timeout_s)

    def __repr__(self) -> str:
        return f"Client({self._url!r}{'' if self._token is None else ', token=...'})"

    # Spaces

    def spaces(self) -> List[SpaceInfo]:
        """All spaces, by name."""
        return list(self._get(SpaceList, path_of()).spaces)

    def create_space(self, space: str, **settings: Any) -> SpaceInfo:
        """Creates a space. Settings that are not given take the service's defaults; their values
        are plain data or messages (`recruitment=Bernoulli(0.05)`)."""
        for name, value in settings.items():
            json_of(name, value)  # The setting that cannot be written is named.
        return self._send(SpaceInfo, "PUT", path_of(space), JSON, json_of("settings", settings))

    def create_space_from(self, space: str, settings: SpaceSettings) -> SpaceInfo:
        """Creates a space with all settings given, for example those of another space."""
        return self.create_space(space, **to_wire(settings))

    def space(self, space: str) -> SpaceInfo:
        """A space, its settings and the size of its memory."""
        return self._get(SpaceInfo, path_of(space))

    def delete_space(self, space: str) -> None:
        """Deletes a space and everything in it."""
        self._request("DELETE", path_of(space))

    # Agents

    def agents(self, space: str) -> Iterator[AgentSummary]:
        """All agents of a space, by name."""
        query: Query = {}
        while True:
            page = self._get(AgentPage, path_of(space, "agents"), query)
            yield from page.agents
            if page.next is None:
                return
            query = {"after": page.next}

    def agent(self, space: str, agent: str) -> AgentDetail:
        """Where an agent is, how sure that is, and how far its samples have come."""
        return self._get(AgentDetail, path_of(space, "agents", agent))

    def delete_agent(self, space: str, agent: str) -> None:
        """Removes an agent; returns when that is on the service's disk.

        Its name is free, and what it did in the map stays: places, trips, landmarks and the causal
        trajectories of its sessions. A robot that goes on sending under the name comes back as a
        new agent.
        """
        self._request("DELETE", path_of(space, "agents", agent))

    def grid(self, space: str, agent: str) -> GridState:
        """Grid-cell state of an agent."""
        return self._get(GridState, path_of(space, "agents", agent, "grid"))

    def trajectory(
        self,
        space: str,
        agent: str,
        from_ns: Optional[int] = None,
        to_ns: Optional[int] = None,
        kind: str = "causal",
    ) -> Trajectory:
        """The poses of an agent within a span of stamps, all pages in one.

        Args:
            kind: `causal`, each pose as it was known when its sample was applied, or `refined`, by
                all that has been seen since.
        """
        path = path_of(space, "agents", agent, "trajectory")
        poses: List[StampedPose] = []
        while True:
            query: Query = {"kind": kind, "from_ns": from_ns, "to_ns": to_ns}
            page = self._get(Trajectory, path, query)
            poses.extend(page.poses)
            if page.next_from_ns is None:
                return replace(page, poses=tuple(poses))
            from_ns = page.next_from_ns

    def post_samples(self, space: str, agent: str, batch: SampleBatch) -> IngestAnswer:
        """Sends samples without Zenoh; returns when they are on the service's disk."""
        one_of("batch", batch, (SampleBatch,))
        path = path_of(space, "agents", agent, "samples")
        return self._send(IngestAnswer, "POST", path, CBOR, encode(batch), repeatable=True)

    # Memories

    def recall(
        self,
        space: str,
        *,
        position_m: Optional[Iterable[float]] = None,
        code: Optional[Iterable[Optional[Iterable[float]]]] = None,
        radius_m: Optional[float] = None,
        agent: Optional[str] = None,
        since_ns: Optional[int] = None,
        until_ns: Optional[int] = None,
        limit: Optional[int] = None,
        percept: Optional[PerceptCue] = None,
    ) -> RecallAnswer:
        """Places that answer a cue, best first: a position [m], a grid code (a phase per module,
        `None` for an erased one), a percept (`Level` or `Descriptor`), or several of them. The
        other arguments filter: places within `radius_m` of the position, founded by `agent`,
        visited from `since_ns` on, founded before `until_ns`."""
        query = RecallQuery(
            position_m=None if position_m is None else vec3("position_m", position_m),
            code=None
            if code is None
            else tuple(
                None if phase is None else vec3("code", phase) for phase in listed("code", code)
            ),
            radius_m=radius_m,
            agent=agent,
            since_ns=since_ns,
            until_ns=until_ns,
            limit=limit,
            percept=percept,
        )
        body = {name: value for name, value in to_wire(query).items() if value is not None}
        path = path_of(space, "recall")
        return self._send(RecallAnswer, "POST", path, JSON, json_of("query", body))

    def predict(
        self,
        space: str,
        agent: str,
        motion: MotionBody,
        *,
        offset_m: Iterable[float] = (0.0, 0.0, 0.0),
        channel: Optional[str] = None,
    ) -> PredictAnswer:
        """What an agent would feel after a motion (`Increment` or `Velocity`) from where it is now.
        Levels are those of a sensor at `offset_m` in the body frame [m]. With `channel` only what
        is felt on that one."""
        query = PredictQuery(None, motion, vec3("offset_m", offset_m), channel)
        path = path_of(space, "agents", agent, "predict")
        return self._send(PredictAnswer, "POST", path, JSON, json_of("query", query))

    def places(self, space: str, **filters: Union[None, str, int, float]) -> Iterator[Place]:
        """All places of a space, by id. `filters` are passed on as query parameters."""
        query: Query = dict(filters)
        while True:
            page = self._get(PlacePage, path_of(space, "places"), query)
            yield from page.places
            if page.next is None:
                return
            query["after"] = page.next

    def place(self, space: str, place: int) -> Place:
        """A place."""
        return self._get(Place, path_of(space, "places", id_of("place", place)))

    def place_percepts(self, space: str, place: int) -> PlacePercepts:
        """What a place remembers of what was felt and seen there."""
        return self._get(PlacePercepts, path_of(space, "places", id_of("place", place), "percepts"))

    def trips(self, space: str, **filters: Union[None, str, int, float]) -> Iterator[Trip]:
        """All trips of a space, by id. `filters` are passed on as query parameters."""
        query: Query = dict(filters)
        while True:
            page = self._get(TripPage, path_of(space, "trips"), query)
            yield from page.trips
            if page.next is None:
                return
            query["after"] = page.next

    def trip(self, space: str, trip: int) -> TripDetail:
        """A trip with its legs."""
        return self._get(TripDetail, path_of(space, "trips", id_of("trip", trip)))

    def landmarks(self, space: str, **filters: Union[None, str, int, float]) -> Iterator[Landmark]:
        """All landmarks of a space, by label. `filters` are passed on as query parameters."""
        query: Query = dict(filters)
        while True:
            page = self._get(LandmarkPage, path_of(space, "landmarks"), query)
            yield from page.landmarks
            if page.next is None:
                return
            query["after"] = page.next

    def landmark(self, space: str, label: str) -> Landmark:
        """A landmark, by its label."""
        return self._get(Landmark, path_of(space, "landmarks", label))

    def channels(self, space: str) -> Tuple[Channel, ...]:
        """The channels of percepts of a space, and what was learned of their views."""
        return self._get(ChannelList, path_of(space, "channels")).channels

    # Objects

    def objects(
        self, space: str, **filters: Union[None, str, int, float]
    ) -> Iterator[ObjectSummary]:
        """All objects of a space, by name. `filters` are passed on as query parameters."""
        query: Query = dict(filters)
        while True:
            page = self._get(ObjectPage, path_of(space, "objects"), query)
            yield from page.objects
            if page.next is None:
                return
            query["after"] = page.next

    def object(self, space: str, name: str) -> ObjectDetail:
        """An object with its places."""
        return self._get(ObjectDetail, path_of(space, "objects", name))

    def teach_object(
        self,
        space: str,
        name: str,
        contacts: Iterable[Contact],
        *,
        spacing_m: float = 0.004,
        noise: TouchNoise = TouchNoise(),
        alike: bool = False,
    ) -> ObjectSummary:
        """Teaches an object at once, by contacts in its own frame, in place of what was known of
        it; returns when that is on the service's disk. With `alike` it is compared with all other
        objects, which takes as long as `identify`."""
        lesson = ObjectLesson(spacing_m, noise, cast(Tuple[Contact, ...], contacts))
        path = path_of(space, "objects", name) + ("?alike=true" if alike else "")
        return self._send(ObjectSummary, "PUT", path, JSON, json_of("lesson", lesson))

    def forget_object(self, space: str, name: str) -> None:
        """Forgets an object."""
        self._request("DELETE", path_of(space, "objects", name))

    def identify(
        self,
        space: str,
        contacts: Iterable[Contact],
        *,
        orientation: Orientation = NoTurn(),
        noise: TouchNoise = TouchNoise(),
    ) -> Identification:
        """Which object a sequence of contacts is of, in which pose, and where the next touch would
        tell most."""
        query = IdentifyQuery(orientation, noise, cast(Tuple[Contact, ...], contacts))
        path = path_of(space, "objects", "identify")
        return self._send(Identification, "POST", path, JSON, json_of("query", query))

    def agent_object(self, space: str, agent: str) -> AgentObject:
        """What an agent's episode with an object says so far, and what its latest one said."""
        return self._get(AgentObject, path_of(space, "agents", agent, "object"))

    # Streams and files

    def events(self, space: str, timeout_s: Optional[float] = None) -> Iterator[Event]:
        """What happens in a space from now on. Ends when the service ends the stream; close the
        generator to end it here. A silence longer than `timeout_s`, if given, raises
        `TimeoutError`. Missed events are logged; `follow` hands them over.
        """
        for told in self.follow(space, timeout_s=timeout_s):
            if isinstance(told, MissedEvents):
                how_many = told.events or "unknown how many"
                _log.warning("events of %s were missed: %s", space, how_many)
            else:
                yield told.event

    def follow(
        self, space: str, *, after: Optional[str] = None, timeout_s: Optional[float] = None
    ) -> Iterator[Union[EventRecord, MissedEvents]]:
        """The events of a space with their ids, from the one after `after` on, or from now on;
        `0-0` is before all that the service keeps. `MissedEvents` stands where some were missed,
        because this program was too slow or came back too late. Otherwise as `events`.
        """
        path = path_of(space, "events")
        return self._stream(path, _event_of, timeout_s=timeout_s, last_event_id=after)

    def live(
        self, space: str, *, rate_hz: Optional[float] = None, timeout_s: Optional[float] = None
    ) -> Iterator[Union[LiveTick, LaggedTicks]]:
        """What changes in a space, tick by tick: `rate_hz` of them in a second, 10 when absent. The
        first one has all agents, each later one what changed since. `LaggedTicks` stands where this
        program was too slow for some; the next tick has all that changed. Ends as `events` does.
        """
        query: Query = {"rate_hz": rate_hz}
        return self._stream(path_of(space, "live"), _tick_of, query=query, timeout_s=timeout_s)

    def latest_events(
        self,
        space: str,
        *,
        after: Optional[str] = None,
        agent: Optional[str] = None,
        limit: Optional[int] = None,
    ) -> EventPage:
        """One page of the events that the service keeps, oldest first. Ask again with its `next` as
        `after` for what comes later."""
        query: Query = {"format": "json", "after": after, "agent": agent, "limit": limit}
        return self._get(EventPage, path_of(space, "events"), query)

    def export(
        self,
        space: str,
        format: str = "json",
        *,
        agent: Optional[str] = None,
        session: Optional[int] = None,
        tolerance_m: Optional[float] = None,
        reverse: Optional[RouteReverse] = None,
    ) -> bytes:
        """A space as a file.

        Args:
            space: Name of the space.
            format: `json` (the whole map), `ply` (the places as a point cloud), `tum` (the causal
                trajectory of an agent), `g2o` (what agents did and saw as a graph of poses and
                landmarks, relaxed), `graphml` or `nav2` (the ways as a graph: in GraphML, and in
                the GeoJSON of Nav2's Route Server).
            agent: Whose trajectory; `tum` needs it.
            session: Which run of the agent; the current one when absent.
            tolerance_m: How far places may lie from the edge that stands for a chain of ways, in
                `graphml` and `nav2` [m]; 0.1 when absent.
            reverse: With `NEVER` only directions in which somebody travelled are in these.
        """
        query: Query = {
            "format": format,
            "agent": agent,
            "session": session,
            "tolerance_m": tolerance_m,
            "reverse": None if reverse is None else reverse.value,
        }
        return self._request("GET", path_of(space, "export"), query, accept="*/*")

    def point_cloud(self, space: str, *, since_revision: Optional[int] = None) -> PointCloud:
        """The places of a space as points, with strength, visits and stamps. With the `revision` of
        an earlier cloud as `since_revision` only what changed since: `PointCloud.update` takes it
        in."""
        query: Query = {
            "format": "ply",
            "encoding": "binary",
            "since_revision": since_revision,
        }
        path = path_of(space, "export")
        return PointCloud.read(self._request("GET", path, query, accept="*/*"))

    # The service itself

    def health(self) -> bool:
        """Whether the service is alive."""
        return self._answers("/healthz")

    def ready(self) -> bool:
        """Whether the service takes samples and answers queries; False while it recovers."""
        return self._answers("/readyz")

    def _answers(self, path: str) -> bool:
        try:
            self._request("GET", path, accept="*/*")
        except ApiError as error:
            if error.status == 503:
                return False
            raise
        return True


def _event_of(told: ServerSentEvent) -> Optional[Union[EventRecord, MissedEvents]]:
    """What a stream of events tells; `None` where that is something else."""
    if told.event == "missed":
        return decode(MissedEvents, told.data.encode(), JSON)
    if told.event == "message":
        return EventRecord(told.id or "", decode(Event, told.data.encode(), JSON))
    return None


def _tick_of(told: ServerSentEvent) -> Optional[Union[LiveTick, LaggedTicks]]:
    """What a live stream tells; `None` where that is something else."""
    if told.event == "tick":
        return decode(LiveTick, told.data.encode(), JSON)
    if told.event == "lagged":
        return decode(LaggedTicks, told.data.encode(), JSON)
    return None
