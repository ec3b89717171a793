"""The HTTP client against a small server in a thread, with the golden answers of the protocol."""

from __future__ import annotations

import json
from typing import Iterator

import pytest

import cogmap
from cogmap.sse import ServerSentEvent, server_sent_events
from cogmap.wire import JSON, decode, encode
from http_stand_in import Answer, Request, Server, golden


@pytest.fixture
def server() -> Iterator[Server]:
    server = Server()
    yield server
    server.close()


@pytest.fixture
def client(server: Server) -> cogmap.Client:
    return cogmap.Client(server.url, token="secret", timeout_s=5.0)


def test_spaces_are_listed_created_shown_and_deleted(server: Server, client: cogmap.Client) -> None:
    spaces = golden("space_list")
    info = spaces["spaces"][0]
    server.answer("GET /v1/spaces", spaces)
    server.answer("PUT /v1/spaces/lab", info, 201)
    server.answer("GET /v1/spaces/lab", info)
    server.routes["DELETE /v1/spaces/lab"] = lambda _: (204, JSON, None)

    assert [space.name for space in client.spaces()] == ["lab"]
    created = client.create_space("lab", seed=7, recruitment=cogmap.Bernoulli(0.05))
    assert created == client.space("lab")
    assert created.settings.recruitment == cogmap.Novelty()
    client.delete_space("lab")
    server.routes["DELETE /v1/spaces/lab/agents/ada"] = lambda _: (204, JSON, None)
    client.delete_agent("lab", "ada")

    put = server.seen[1]
    assert json.loads(put.body) == {"seed": 7, "recruitment": {"bernoulli": {"probability": 0.05}}}
    assert put.headers["Content-Type"] == "application/json"
    assert {seen.headers["Authorization"] for seen in server.seen} == {"Bearer secret"}


def test_a_space_is_created_with_the_settings_of_another(
    server: Server, client: cogmap.Client
) -> None:
    info = golden("space_list")["spaces"][0]
    server.answer("GET /v1/spaces/lab", info)
    server.answer("PUT /v1/spaces/copy", info)
    client.create_space_from("copy", client.space("lab").settings)
    assert json.loads(server.seen[1].body) == info["settings"]


def test_agents_come_page_by_page(server: Server, client: cogmap.Client) -> None:
    def page(request: Request) -> Answer:
        after = request.query.get("after")
        names = {None: ["a", "b"], "b": ["c"], "c": []}[after]
        following = {None: "b", "b": "c", "c": None}[after]
        agents = [{"name": name, "estimate": None} for name in names]
        return 200, JSON, json.dumps({"agents": agents, "next": following}).encode()

    server.routes["GET /v1/spaces/lab/agents"] = page
    iterator = client.agents("lab")
    assert next(iterator).name == "a"
    assert len(server.seen) == 1, "the second page is asked for when it is needed"
    assert [agent.name for agent in iterator] == ["b", "c"]
    assert len(server.seen) == 3


def test_an_agent_its_grid_and_its_samples(server: Server, client: cogmap.Client) -> None:
    server.answer("GET /v1/spaces/lab/agents/ada", golden("agent_detail"))
    server.answer("GET /v1/spaces/lab/agents/ada/grid", golden("grid_state"))
    server.answer("POST /v1/spaces/lab/agents/ada/samples", golden("ingest_answer"))
    assert client.agent("lab", "ada").watermark.durable > 0
    assert len(client.grid("lab", "ada").modules) > 0
    batch = cogmap.SampleBatch(1, 0, (cogmap.Sample(5, cogmap.Marker("x")),))
    answer = client.post_samples("lab", "ada", batch)
    assert answer == decode(cogmap.IngestAnswer, json.dumps(golden("ingest_answer")).encode(), JSON)
    assert server.seen[-1].headers["Content-Type"] == "application/cbor"
    assert server.seen[-1].body == encode(batch)


def test_a_trajectory_is_joined_from_its_pages(server: Server, client: cogmap.Client) -> None:
    def page(request: Request) -> Answer:
        start = int(request.query["from_ns"])
        pose = {"stamp_ns": start, "translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1]}
        answer = dict(golden("trajectory"), poses=[pose])
        answer["next_from_ns"] = start + 10 if start < 30 else None
        return 200, JSON, json.dumps(answer).encode()

    server.routes["GET /v1/spaces/lab/agents/ada/trajectory"] = page
    trajectory = client.trajectory("lab", "ada", from_ns=10, to_ns=99)
    assert [pose.stamp_ns for pose in trajectory.poses] == [10, 20, 30]
    assert trajectory.next_from_ns is None
    assert {seen.query["to_ns"] for seen in server.seen} == {"99"}


def test_recall_sends_only_what_was_asked(server: Server, client: cogmap.Client) -> None:
    server.answer("POST /v1/spaces/lab/recall", golden("recall_answer"))
    found = client.recall("lab", position_m=[1, 2, 3], code=[[0.1, 0.2, 0.3], None], limit=5)
    assert found.places[0].confidence is not None
    assert json.loads(server.seen[0].body) == {
        "position_m": [1.0, 2.0, 3.0],
        "code": [[0.1, 0.2, 0.3], None],
        "limit": 5,
    }


def test_a_route_is_asked_for_as_it_is_meant(server: Server, client: cogmap.Client) -> None:
    server.answer("POST /v1/spaces/lab/route", golden("route_answer"))
    found = client.route("lab", cogmap.AtAgent("robot-1"), cogmap.AtPlace(3))
    assert json.loads(server.seen[0].body) == golden("route_query")
    assert [step.way for step in found.steps] == [
        cogmap.RouteWay.TRAVELLED,
        cogmap.RouteWay.APPROACH,
    ]
    assert found.path is not None and found.alternatives[0].path is None
    client.route(
        "lab",
        cogmap.AtPosition((12.5, -7.25, 0.125)),
        cogmap.AtPlace(2**64 - 1),
        cost=cogmap.RouteCost.RECENCY,
        reverse=cogmap.RouteReverse.NEVER,
        avoid_places=[4, 5],
        avoid_boxes=[cogmap.RouteBox((0.0, -1.5, 0.0), (2.0, 1.5, 2.5))],
        shortcuts=True,
        body_radius_m=0.25,
        alternatives=4,
        path_spacing_m=0.5,
    )
    assert json.loads(server.seen[1].body) == golden("route_query_full")


def test_what_was_felt_is_asked_for_as_it_is_meant(server: Server, client: cogmap.Client) -> None:
    server.answer("POST /v1/spaces/lab/felt", golden("felt_answer"))
    answer = client.felt("lab", (1.5, -2, 0))
    assert json.loads(server.seen[0].body) == golden("felt_query")
    assert answer.looked is cogmap.Looked.FELT
    assert [place.looked for place in answer.places] == [
        cogmap.Looked.FELT,
        cogmap.Looked.NOTHING_FELT,
    ]
    since_ns = 1_800_000_000_610_000_000
    names = ["touch", "camera"]
    client.felt("lab", (1.5, -2, 0), radius_m=0.5, since_ns=since_ns, channels=names, limit=3)
    assert json.loads(server.seen[1].body) == golden("felt_query_full")


def test_a_sequence_is_asked_about_as_it_is_meant(server: Server, client: cogmap.Client) -> None:
    server.answer("POST /v1/spaces/lab/sequence", golden("sequence_answer"))
    found = client.sequence("lab", [3, 4])
    assert json.loads(server.seen[0].body) == golden("sequence_query")
    likelihoods = [next.probability for next in found.next]
    assert sum(likelihoods) + found.others + found.none == 1.0
    assert (found.trips[0].trip, found.trips[0].agent, found.trips[0].leg) == (17, "robot-1", 6)
    last = cogmap.AtPlace(2**64 - 1)
    felt = cogmap.Level("touch", 0.75)
    client.sequence("lab", (last, felt), error_rate=0.25, none_prior=0.5, limit=3)
    assert json.loads(server.seen[1].body) == golden("sequence_query_full")


def test_where_an_agent_was_is_asked(server: Server, client: cogmap.Client) -> None:
    server.answer("GET /v1/spaces/lab/agents/ada/at", golden("agent_at"))
    at = client.agent_at("lab", "ada", 1_800_000_000_610_000_000, session=3)
    assert at.position == (12.5, -7.25, 0.125) and at.map_revision is None
    assert server.seen[0].query == {
        "stamp_ns": "1800000000610000000",
        "trajectory": "causal",
        "session": "3",
    }
    client.agent_at("lab", "ada", -5, refined=True)
    assert server.seen[1].query == {"stamp_ns": "-5", "trajectory": "refined"}


def test_samples_are_localised(server: Server, client: cogmap.Client) -> None:
    server.answer("POST /v1/spaces/lab/localize", golden("localization"))
    query = json.dumps(golden("localize_query")).encode()
    samples = decode(cogmap.LocalizeQuery, query, JSON).samples
    found = client.localize("lab", iter(samples))
    assert json.loads(server.seen[0].body) == golden("localize_query")
    assert (found.status, found.found_after) == (cogmap.Status.LOCALIZED, 41)
    assert found.pose is not None and len(found.pose.covariance) == 21
    server.answer("POST /v1/spaces/lab/localize", golden("localization_uncertain"))
    unsure = client.localize("lab", samples)
    assert unsure.pose is None
    assert [guess.probability for guess in unsure.hypotheses] == [0.5, 0.375]


def test_memories_are_iterated_and_shown_one_by_one(server: Server, client: cogmap.Client) -> None:
    places = dict(golden("place_page"), next=None)
    server.answer("GET /v1/spaces/lab/places", places)
    server.answer("GET /v1/spaces/lab/places/3", places["places"][0])
    server.answer("GET /v1/spaces/lab/places/3/percepts", golden("place_percepts"))
    routes = dict(golden("followed_route_page"), next=None)
    server.answer("GET /v1/spaces/lab/routes", routes)
    trips = dict(golden("trip_page"), next=None)
    server.answer("GET /v1/spaces/lab/trips", trips)
    server.answer("GET /v1/spaces/lab/trips/0", golden("trip_detail"))
    landmarks = dict(golden("landmark_page"), next=None)
    server.answer("GET /v1/spaces/lab/landmarks", landmarks)
    server.answer("GET /v1/spaces/lab/landmarks/door%20%2F%20left", landmarks["landmarks"][0])

    assert len(list(client.places("lab", limit=2))) == len(places["places"])
    assert server.seen[0].query == {"limit": "2"}
    assert client.place("lab", 3).id == places["places"][0]["id"]
    remembered = client.place_percepts("lab", 3).percepts
    assert [percept.channel for percept in remembered] == ["touch", "camera"]
    assert [route.steps_left for route in client.followed_routes("lab")] == [9]
    assert [trip.ended for trip in client.trips("lab")][:2] == [
        cogmap.TripEnd.STILLNESS,
        cogmap.TripEnd.GAP,
    ]
    assert client.trip("lab", 0).legs[0].duration_s > 0
    assert len(list(client.landmarks("lab"))) == len(landmarks["landmarks"])
    assert client.landmark("lab", "door / left").sightings > 0


def test_events_are_read_as_they_come(server: Server, client: cogmap.Client) -> None:
    first, second = golden("event_place_entered"), golden("event_trip_ended")
    stream = [
        b": keep-alive\n\n",
        b"event: message\r\nid: 1-0\r\ndata: " + json.dumps(first).encode() + b"\r\n\r\n",
        b"data: " + json.dumps(second).encode()[:40],
        json.dumps(second).encode()[40:] + b"\n\n",
        b"data: cut off",
    ]
    server.routes["GET /v1/spaces/lab/events"] = lambda _: (200, "text/event-stream", stream)
    events = list(client.events("lab", timeout_s=5.0))
    kinds = [type(event.kind) for event in events]
    assert kinds == [cogmap.PlaceEntered, cogmap.TripEnded]
    assert "Last-Event-ID" not in server.seen[0].headers


def test_a_stream_is_taken_up_again_and_says_what_was_missed(
    server: Server, client: cogmap.Client
) -> None:
    event = golden("event_trip_ended")
    stream = [
        b'event: missed\ndata: {"events":3,"next":"9-0"}\n\n',
        b"id: 9-0\nevent: message\ndata: " + json.dumps(event).encode() + b"\n\n",
        b"event: of another version\ndata: x\n\n",
    ]
    server.routes["GET /v1/spaces/lab/events"] = lambda _: (200, "text/event-stream", stream)
    missed, record = client.follow("lab", after="5-1", timeout_s=5.0)
    assert missed == cogmap.MissedEvents(3, "9-0")
    assert isinstance(record, cogmap.EventRecord) and record.id == "9-0"
    assert server.seen[0].headers["Last-Event-ID"] == "5-1"
    assert len(list(client.events("lab", timeout_s=5.0))) == 1, "a miss is no event"
    page = golden("event_page")
    server.answer("GET /v1/spaces/lab/events", page)
    assert client.latest_events("lab", after="5-1", limit=2).next == page["next"]
    assert server.seen[-1].query == {"format": "json", "after": "5-1", "limit": "2"}


def test_a_stream_is_asked_for_as_one(server: Server, client: cogmap.Client) -> None:
    server.routes["GET /v1/spaces/lab/events"] = lambda _: (200, "text/event-stream", [])
    assert list(client.events("lab", timeout_s=5.0)) == []
    assert server.seen[0].headers["Accept"] == "text/event-stream"


def test_an_event_may_have_several_lines() -> None:
    lines = [b"data:{\n", b"data: }\n", b"\n", b"retry: 5\n", b"\n", b"data\n", b"\n"]
    told = list(server_sent_events(lines))
    assert told == [ServerSentEvent("message", data, None) for data in ("{\n}", "")]


def test_export_is_the_file_as_it_came(server: Server, client: cogmap.Client) -> None:
    server.routes["GET /v1/spaces/lab/export"] = lambda request: (
        200,
        "text/plain",
        json.dumps(request.query).encode() + b"\x00",
    )
    assert client.export("lab", "ply") == b'{"format": "ply"}\x00'
    way = client.export("lab", "tum", agent="ada", session=7)
    assert way == b'{"format": "tum", "agent": "ada", "session": "7"}\x00'


def test_health_and_readiness_are_told_apart(server: Server, client: cogmap.Client) -> None:
    server.routes["GET /healthz"] = lambda _: (200, "text/plain", b"ok")
    server.routes["GET /readyz"] = lambda _: (503, "text/plain", b"recovering")
    assert client.health() is True
    assert client.ready() is False


def test_a_refusal_carries_the_problem(server: Server, client: cogmap.Client) -> None:
    with pytest.raises(cogmap.ApiError) as raised:
        client.space("nowhere")
    problem, error = golden("problem"), raised.value
    assert (error.status, error.kind) == (404, problem["type"])
    assert (error.title, error.detail) == (problem["title"], problem["detail"])
    assert error.extra == {}


def test_a_problem_may_say_more(server: Server, client: cogmap.Client) -> None:
    server.answer("GET /v1/spaces", dict(golden("problem"), session=7, expected_seq=40), 409)
    with pytest.raises(cogmap.ApiError) as raised:
        client.spaces()
    assert raised.value.extra == {"session": 7, "expected_seq": 40}


@pytest.mark.parametrize("body", [b"", b"<html>", b"[]", b'"x"', b"null", b"{}", b"\xff"])
def test_a_refusal_by_something_else_is_still_an_api_error(
    server: Server, client: cogmap.Client, body: bytes
) -> None:
    server.routes["GET /v1/spaces"] = lambda _: (502, "text/html", body)
    with pytest.raises(cogmap.ApiError) as raised:
        client.spaces()
    assert raised.value.status == 502


def test_an_answer_that_is_not_one_is_a_wire_error(server: Server, client: cogmap.Client) -> None:
    server.routes["GET /v1/spaces"] = lambda _: (200, "text/html", b"<html>")
    with pytest.raises(cogmap.WireError):
        client.spaces()


def test_without_a_token_none_is_sent(server: Server) -> None:
    server.answer("GET /v1/spaces", {"spaces": []})
    assert cogmap.Client(server.url + "/").spaces() == []
    assert "Authorization" not in server.seen[0].headers


def test_a_service_out_of_reach_is_an_os_error() -> None:
    with pytest.raises(OSError):
        cogmap.Client("http://127.0.0.1:1", timeout_s=1.0).health()
    with pytest.raises(ValueError):
        cogmap.Client("ftp://example.org")
