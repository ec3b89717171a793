"""The HTTP side of the Python client against the service: a drive whose every pose is known, and
what the service refuses."""

from __future__ import annotations

import dataclasses
import math
import threading
import time
import urllib.request
from typing import List, Tuple, Union

import pytest

import cogmap
from server import Server
from wait import LONG_S, eventually

AGENT = "ada"
SESSION = 7
START_NS = 1_700_000_000_000_000_000
#: A circle of 1 m to the left of the start, in steps of 20 ms.
STEPS = 400
STEP_NS = 20_000_000
TURN_RAD_S = 2 * math.pi / (STEPS * STEP_NS * 1e-9)
#: Rounding of some hundred steps [m].
EXACT = 1e-9


def circle() -> cogmap.SampleBatch:
    """A start pose, a sighting of the circle's centre, a round, and a marker that ends the trip."""
    position = cogmap.Position((0, 1, 0), (0.01, 0.01, 0.01))
    sighting = cogmap.Sighting(cogmap.LandmarkTarget("the centre"), position)
    turn = cogmap.Velocity((TURN_RAD_S, 0, 0), (0, 0, TURN_RAD_S), STEP_NS * 1e-9)
    bodies: List[Tuple[int, cogmap.SampleBody]] = [
        (0, cogmap.StartPose((0, 0, 0))),
        (0, sighting),
        *((step, turn) for step in range(1, STEPS + 1)),
        (STEPS, cogmap.Marker("round", ends_trip=True)),
    ]
    samples = tuple(cogmap.Sample(START_NS + step * STEP_NS, body) for step, body in bodies)
    return cogmap.SampleBatch(SESSION, 0, samples)


def where(step: int) -> Tuple[float, float, float]:
    """The position after a step, in closed form [m]."""
    angle = 2 * math.pi * step / STEPS
    return (math.sin(angle), 1 - math.cos(angle), 0.0)


@pytest.fixture
def client(service: Server) -> cogmap.Client:
    """A client of a service on which the circle has been driven."""
    client = service.client()
    answer = client.post_samples("default", AGENT, circle())
    assert (answer.watermark.durable, answer.duplicates) == (STEPS + 3, 0)
    return client


def test_a_removed_agent_leaves_its_past_and_its_name(client: cogmap.Client) -> None:
    places, trips = list(client.places("default")), list(client.trips("default"))
    client.delete_agent("default", AGENT)
    assert list(client.agents("default")) == []
    with pytest.raises(cogmap.ApiError, match="removed") as refused:
        client.agent("default", AGENT)
    assert (refused.value.status, refused.value.kind) == (410, "/problems/removed-agent")
    assert [place.id for place in client.places("default")] == [place.id for place in places]
    assert [trip.agent for trip in client.trips("default")] == [AGENT] * len(trips)
    assert client.export("default", "tum", agent=AGENT, session=SESSION).count(b"\n") > STEPS / 2
    later = cogmap.SampleBatch(SESSION - 1, 0, circle().samples)
    assert client.post_samples("default", AGENT, later).watermark.session == SESSION - 1


def test_a_session_of_the_future_is_refused_by_name(client: cogmap.Client) -> None:
    with pytest.raises(cogmap.ApiError, match="future") as refused:
        client.post_samples("default", "bob", cogmap.SampleBatch(1 << 63, 0, circle().samples))
    assert (refused.value.status, refused.value.kind) == (422, "/problems/session-in-future")


def test_samples_sent_again_are_told_as_duplicates(client: cogmap.Client) -> None:
    answer = client.post_samples("default", AGENT, circle())
    assert answer.duplicates == STEPS + 3
    assert client.space("default").map_revision == STEPS + 3 + 1


def test_agents_and_their_way(client: cogmap.Client) -> None:
    detail = client.agent("default", AGENT)
    assert detail.estimate is not None
    assert detail.estimate.translation_m == pytest.approx(where(STEPS), abs=EXACT)
    chord_m = 2 * math.sin(math.pi / STEPS)
    assert detail.travelled_m == pytest.approx(STEPS * chord_m, abs=EXACT)
    assert detail.heard_ago_s is not None and detail.heard_ago_s >= 0
    [listed] = client.agents("default")
    assert (listed.name, listed.estimate) == (AGENT, detail.estimate)
    assert not listed.session_ended and not detail.session_ended
    assert listed.heard_ago_s is not None and listed.heard_ago_s >= detail.heard_ago_s
    way = client.trajectory("default", AGENT)
    assert (way.session, way.frame, way.kind) == (SESSION, "map", "causal")
    assert [pose.stamp_ns for pose in way.poses] == [
        START_NS + step * STEP_NS for step in range(STEPS + 1)
    ]
    for step, pose in enumerate(way.poses):
        assert pose.translation_m == pytest.approx(where(step), abs=EXACT)
    span = client.trajectory("default", AGENT, way.poses[100].stamp_ns, way.poses[110].stamp_ns)
    assert span.poses == way.poses[100:110]
    grid = client.grid("default", AGENT)
    assert len(grid.modules) == client.space("default").settings.grid_modules
    assert grid.heading_rad == pytest.approx(0, abs=EXACT)
    past = client.trajectory("default", AGENT, kind="refined")
    assert (past.kind, past.map_revision) == ("refined", client.space("default").map_revision)
    assert [pose.stamp_ns for pose in past.poses] == sorted(pose.stamp_ns for pose in past.poses)
    assert past.poses[-1].stamp_ns == way.poses[-1].stamp_ns


def test_lists_longer_than_a_page_come_whole(client: cogmap.Client) -> None:
    names = [f"robot-{number:03}" for number in range(250)]
    batch = cogmap.SampleBatch(1, 0, (cogmap.Sample(0, cogmap.StartPose((0, 0, 0))),))
    for name in names:
        client.post_samples("default", name, batch)
    assert [agent.name for agent in client.agents("default")] == [AGENT, *names]
    places = list(client.places("default"))
    assert list(client.places("default", limit=3)) == places


def test_places_and_their_recall(client: cogmap.Client) -> None:
    places = list(client.places("default"))
    assert [place.id for place in places] == list(range(client.space("default").places))
    assert len(places) > 10
    for place in places:
        assert client.place("default", place.id) == place
        x, y, z = place.translation_m
        assert (math.hypot(x, y - 1), z) == pytest.approx((1, 0), abs=EXACT)
        by_position = client.recall("default", position_m=place.translation_m, limit=3).places
        assert by_position[0].place == place
        assert by_position[0].confidence == pytest.approx(1)
        assert by_position[0].distance_m == pytest.approx(0, abs=EXACT)
        confidences = [found.confidence or 0 for found in by_position]
        assert confidences == sorted(confidences, reverse=True)
        by_code = client.recall("default", code=place.code, limit=1).places
        assert by_code[0].place == place
    near = client.recall("default", position_m=where(0), radius_m=0.6).places
    inside = {place.id for place in places if math.dist(place.translation_m, where(0)) <= 0.6}
    assert {found.place.id for found in near} == inside


def test_samples_of_nobody_are_localised(client: cogmap.Client) -> None:
    nothing_known = [cogmap.Sample(0, cogmap.Increment((0.1, 0, 0)))]
    lost = client.localize("default", nothing_known)
    assert (lost.status, lost.pose, lost.found_after) == (cogmap.Status.LOST, None, None)
    assert lost.map_revision == client.space("default").map_revision
    with pytest.raises(cogmap.ApiError) as raised:
        client.localize("default", [cogmap.Sample(0, cogmap.StartPose((0, 0, 0)))])
    assert (raised.value.status, raised.value.kind) == (422, "/problems/invalid-query")
    assert raised.value.detail.startswith("samples[0]: ")


def test_trips_and_landmarks(client: cogmap.Client) -> None:
    (trip,) = client.trips("default", agent=AGENT)
    assert (trip.agent, trip.session, trip.ended) == (AGENT, SESSION, cogmap.TripEnd.MARKER)
    detail = client.trip("default", trip.id)
    assert (detail.trip, len(detail.legs)) == (trip, trip.leg_count)
    for earlier, later in zip(detail.legs, detail.legs[1:]):
        assert earlier.end == later.start
    assert sum(leg.length_m for leg in detail.legs) == pytest.approx(trip.length_m)
    (landmark,) = client.landmarks("default")
    assert landmark == client.landmark("default", "the centre")
    assert landmark.translation_m == pytest.approx((0, 1, 0), abs=EXACT)
    assert landmark.sightings == 1


def test_the_export_holds_the_map(client: cogmap.Client) -> None:
    assert client.export("default", "ply").startswith(b"ply\n")
    text = client.export("default")
    assert client.space("default").digest.encode() in text
    way = client.export("default", "tum", agent=AGENT)
    assert len(way.splitlines()) == len(client.trajectory("default", AGENT).poses)


def test_the_cloud_has_the_places_and_later_what_changed(client: cogmap.Client) -> None:
    cloud = client.point_cloud("default")
    places = {place.id: place for place in client.places("default")}
    assert cloud.places.keys() == places.keys()
    assert (cloud.since_revision, cloud.forgotten) == (0, ())
    for number, place in places.items():
        shown = cloud.places[number]
        assert shown.position_m == pytest.approx(place.translation_m, abs=1e-6)
        assert (shown.visits, shown.first_s) == (place.visits, place.first_stamp_ns / 1e9)
    later = dataclasses.replace(circle(), session=SESSION + 1)
    again = client.post_samples("default", AGENT, later)
    assert again.watermark.durable == STEPS + 3
    changed = client.point_cloud("default", since_revision=cloud.revision)
    assert changed.since_revision == cloud.revision
    assert cloud.update(changed) == client.point_cloud("default")


def test_a_live_stream_shows_the_agent_and_what_it_sees(service: Server) -> None:
    ticks: List[Union[cogmap.LiveTick, cogmap.LaggedTicks]] = []

    def watch() -> None:
        ticks.extend(service.client().live("default", rate_hz=50, timeout_s=LONG_S))

    watcher = threading.Thread(target=watch)
    watcher.start()
    eventually("the first tick", lambda: len(ticks) > 0)
    client = service.client()
    client.post_samples("default", AGENT, circle())
    eventually("the drive", lambda: client.space("default").agents == 1)
    time.sleep(0.2)  # ten ticks, the last of which have nothing new
    service.terminate()
    watcher.join(LONG_S)
    assert not watcher.is_alive()
    shown = [tick for tick in ticks if isinstance(tick, cogmap.LiveTick)]
    latest = [agent for tick in shown for agent in tick.agents][-1]
    assert (latest.name, latest.session, latest.seq) == (AGENT, SESSION, STEPS + 2)
    assert latest.translation_m == pytest.approx(where(STEPS), abs=EXACT)
    (seen,) = (sighting for tick in shown for sighting in tick.sightings)
    assert seen.target == cogmap.LandmarkTarget("the centre")
    assert seen.from_m == pytest.approx((0, 0, 0), abs=EXACT)
    assert seen.to_m == pytest.approx((0, 1, 0), abs=EXACT)
    kinds = [record.event.kind for tick in shown for record in tick.events]
    assert cogmap.MarkerPassed("round") in kinds
    assert shown[-1].counts.landmarks == 1 and shown[-1].health.dropped_messages == 0


def test_events_come_as_things_happen_and_end_with_the_service(service: Server) -> None:
    events: List[cogmap.Event] = []

    def follow() -> None:
        events.extend(service.client().events("default", timeout_s=LONG_S))

    follower = threading.Thread(target=follow)
    follower.start()
    eventually("the stream", lambda: streams(service) == 1)
    service.client().post_samples("default", AGENT, circle())
    places = list(service.client().places("default"))
    service.terminate()
    follower.join(LONG_S)
    assert not follower.is_alive()
    kinds = [event.kind for event in events]
    assert kinds[:2] == [cogmap.AgentEnrolled(), cogmap.SessionStarted(SESSION)]
    assert {(event.space, event.agent) for event in events} == {("default", AGENT)}
    recruited = [kind for kind in kinds if isinstance(kind, cogmap.PlaceRecruited)]
    assert recruited == [cogmap.PlaceRecruited(p.id, p.translation_m) for p in places]
    (learned,) = (kind for kind in kinds if isinstance(kind, cogmap.LandmarkLearned))
    assert learned.landmark == "the centre"
    assert cogmap.MarkerPassed("round") in kinds
    (ended,) = (kind for kind in kinds if isinstance(kind, cogmap.TripEnded))
    assert ended.reason == cogmap.TripEnd.MARKER
    assert not [kind for kind in kinds if isinstance(kind, cogmap.UnknownKind)]


def streams(service: Server) -> int:
    """Open streams of events."""
    with urllib.request.urlopen(f"{service.url}/metrics", timeout=LONG_S) as answer:
        lines = answer.read().decode().splitlines()
    return sum(int(line.split()[-1]) for line in lines if line.startswith("cogmap_http_streams"))
