"""The page as somebody sees it who opens it in a browser."""

from __future__ import annotations

import json
import urllib.request
from typing import List, Optional, Sequence

import cogmap
from arm import FELT, Arm
from driver import Driver, Driving
from conftest import MakeServer, Open
from page import Dashboard, brightness, n_colours
from server import Server
from wait import eventually

#: Steps of a first drive: some six metres, and a place every thirty centimetres or so.
STEPS = 80
#: More colours than the ground and the floor have.
COLOURS = 40


def apart(a: Sequence[float], b: Sequence[float]) -> float:
    """Largest difference of two positions along an axis [m]."""
    return max(abs(x - y) for x, y in zip(a, b))


def all_felt(page: Dashboard, n: int) -> Optional[List[List[float]]]:
    """The contacts that are drawn on the cup, once there are `n`."""
    felt = page.page.evaluate("cogmap.felt()")
    if felt is None or felt["object"] != "cup" or len(felt["contacts"]) != n:
        return None
    contacts: List[List[float]] = felt["contacts"]
    return contacts


def test_a_space_is_drawn_and_nothing_complains(service: Server, open_page: Open) -> None:
    ada = Driver(service, "ada")
    ada.drive(STEPS)
    page = open_page(service)
    stats = page.until_places(10)
    assert stats["connection"] == "live" and stats["agents"] == 1
    page.settle()
    assert n_colours(page.scene()) > COLOURS, "the scene is more than its ground"
    assert "ada" in page.text(".agents") and "±" in page.text(".agents")
    assert page.text("h2") == "ada", "the first agent is chosen"
    eventually("the grid cells", lambda: page.page.locator(".module").count() == 6)
    assert page.complaints == []


def test_the_page_follows_what_happens(service: Server, open_page: Open) -> None:
    ada = Driver(service, "ada")
    ada.drive(STEPS)
    page = open_page(service)
    places = page.until_places(10)["places"]
    before = page.page.evaluate("cogmap.agent('ada')")
    ada.drive(STEPS)
    bob = Driver(service, "bob", x=2.0)
    bob.drive(5)
    page.until_places(places + 5)
    page.until("the second agent", agents=2)
    eventually(
        "the agent moves",
        lambda: apart(before, page.page.evaluate("cogmap.agent('ada')")) > 0.5,
    )
    eventually("the revision", lambda: page.stats()["revision"]
               == str(service.client().space("default").map_revision))
    assert page.complaints == []


def test_stamps_are_shown_with_all_of_their_digits(service: Server, open_page: Open) -> None:
    ada = Driver(service, "ada")
    ada.drive(STEPS)
    page = open_page(service)
    page.until_places(10)
    exact = eventually("the stamp", lambda: page.page.locator(".agent-panel dd[title$=' ns']").first
                       .get_attribute("title"))
    assert exact == f"{ada.stamp_ns} ns"


def test_a_click_tells_about_an_agent_and_a_place(service: Server, open_page: Open) -> None:
    ada = Driver(service, "ada")
    ada.drive(STEPS)
    page = open_page(service)
    page.until_places(10)
    page.settle()
    page.page.keyboard.press("Escape")
    page.until("nothing chosen", selected=None)
    page.page.mouse.click(*page.agent_on_screen("ada"))
    page.until("the agent", selected={"kind": "agent", "name": "ada"})
    page.page.mouse.click(*page.place_on_screen(3))
    page.until("the place", selected={"kind": "place", "id": 3})
    eventually("the founder", lambda: "by ada" in page.text(".place-panel .facts"))
    eventually("the visitors", lambda: "ada" in page.text(".visitors"))
    remembered = [percept.channel for percept
                  in service.client().place_percepts("default", 3).percepts]
    assert remembered == ["light"]
    eventually("what it remembers", lambda: "light" in page.panel(".percepts")
               and "±" in page.panel(".percepts"))
    eventually("what is predicted", lambda: "place would answer" in page.panel(".expected"))
    eventually("what comes next", lambda: "Place 4" in page.panel(".next"))
    page.page.get_by_role("button", name="Look at place 4").click()
    page.until("the next place", selected={"kind": "place", "id": 4})
    assert page.complaints == []


def test_a_position_recalls_places(service: Server, open_page: Open) -> None:
    ada = Driver(service, "ada")
    ada.drive(STEPS)
    page = open_page(service)
    page.until_places(10)
    page.settle()
    page.page.keyboard.press("r")
    page.page.mouse.click(*page.place_on_screen(7))
    best = eventually("places that answer", lambda: page.stats()["recalled"] or None)
    assert best[0] == 7
    assert page.page.locator(".recalled li").count() == len(best)
    expected = service.client().recall("default", position_m=(0, 0, 0.5), limit=1).places[0]
    for axis, value in zip("xyz", ("0", "0", "0.5")):
        page.page.fill(f"input[aria-label='{axis} in metres']", value)
    page.page.click(".cue button")
    eventually("the typed position", lambda: page.stats()["recalled"][:1] == [expected.place.id])
    assert page.complaints == []


def test_routes_and_blockages_are_drawn(service: Server, open_page: Open) -> None:
    ada = Driver(service, "ada")
    ada.drive(STEPS)
    Driver(service, "bob", x=0.5).drive(8)
    page = open_page(service)
    page.until_places(10)
    page.settle()
    client = service.client()
    asked = client.route("default", cogmap.AtAgent("ada"), cogmap.AtPlace(3))
    page.page.mouse.click(*page.place_on_screen(3))
    page.until("the place", selected={"kind": "place", "id": 3})
    page.page.get_by_text("Route here").click()
    page.until("the route", routeSteps=len(asked.steps))
    eventually("its length", lambda: "m from ada" in page.text(".place-panel .way"))
    page.page.select_option(".from", "bob")
    eventually("from another one", lambda: "m from bob" in page.text(".place-panel .way"))
    page.page.keyboard.press("Escape")
    page.until("nothing chosen", routeSteps=None)

    # A robot follows a route, leaves it and gets another one; elsewhere no route leads across.
    # Of an agent that says nothing, and before somebody opens the page: no event tells of it.
    client.follow_route("default", "ada", cogmap.AtPlace(8))
    late = open_page(service)
    late.until("the route that is followed", following=["ada"])
    eventually("what is left", lambda: "left" in late.panel(".agent-panel .facts"))
    client.block("default", cogmap.BlockageRequest(at_m=(50.0, 0.0, 0.5), radius_m=1.0))
    ada.drive(12)
    page.until("the blockage", blockages=1)
    page.until("the route that is followed", following=["ada"])
    assert page.complaints == []


def test_hypotheses_narrow_while_an_arm_touches(service: Server, open_page: Open) -> None:
    arm = Arm(service)
    for name in FELT:
        arm.learn(name)
    page = open_page(service)
    page.until("the arm", agents=1)
    eventually("the objects", lambda: page.page.locator("[data-object]").count() == len(FELT))
    arm.identify()
    arm.touch(FELT["cup"][::-1][:1], -0.02)
    eventually("both in question", lambda: "Recognising by touch" in page.panel(".touch")
               and {"cup", "can"} <= set(page.page.locator(".bars .what").all_inner_texts()))
    arm.touch(FELT["cup"][::-1][1:], -0.02)
    eventually("the verdict", lambda: "It is cup." in page.panel(".touch"))
    felt = eventually("the contacts on the cup", lambda: all_felt(page, len(FELT["cup"])))
    known = service.client().object("default", "cup").places
    # It was felt from its other end.
    for contact, place in zip(felt, known[::-1]):
        assert apart(contact, place.position_m) < 0.002, (felt, known)
    eventually("the event", lambda: "recognised cup" in page.text(".feed"))
    page.page.click("[data-object=can]")
    eventually("the model", lambda: "8 contacts" in page.panel(".object-panel"))
    assert page.complaints == []


def test_an_agent_that_is_lost_is_told_by_word_and_shape(service: Server, open_page: Open) -> None:
    Driver(service, "ada").drive(STEPS)
    Driver(service, "eve", x=None).drive(STEPS)
    page = open_page(service)
    page.until("both agents", agents=2)
    eventually("the word", lambda: "lost" in page.text("[data-agent=eve]"))
    shapes = [page.page.locator(f"[data-agent={name}] path").get_attribute("d")
              for name in ("ada", "eve")]
    assert shapes[0] != shapes[1]
    # Where she is in the map is not known, so she is not drawn anywhere.
    eventually("ada's dart", lambda: page.page.evaluate("cogmap.agent('ada')") is not None)
    assert page.page.evaluate("cogmap.agent('eve')") is None
    page.page.click("[data-agent=eve]")
    eventually("the badge", lambda: page.text(".agent-panel .badge") == "lost")


def test_an_agent_whose_session_has_ended_is_told(service: Server, open_page: Open) -> None:
    ada = Driver(service, "ada")
    ada.drive(STEPS)
    page = open_page(service)
    page.until("the agent", agents=1)
    page.page.click("[data-agent=ada]")
    eventually("when it was heard", lambda: "heard" in page.panel(".agent-panel"))
    assert "ended" not in page.panel(".agent-panel")
    assert "±" in page.text("[data-agent=ada]")
    ada.end()
    eventually("the word", lambda: "ended" in page.text("[data-agent=ada]"))
    eventually("the panel", lambda: "session ended" in page.panel(".agent-panel"))
    assert page.complaints == []


def test_the_past_is_shown_and_left_again(service: Server, open_page: Open) -> None:
    ada = Driver(service, "ada")
    ada.drive(STEPS)
    page = open_page(service)
    page.until_places(10)
    now = page.page.evaluate("cogmap.agent('ada')")
    for _ in range(3):
        page.page.keyboard.press("ArrowLeft")

    def moved() -> float:
        return apart(now, page.page.evaluate("cogmap.agent('ada')"))

    eventually("the agent as it was", lambda: moved() > 0.5)
    assert page.stats()["time"] is not None
    assert "ago" in page.text(".when")
    page.page.keyboard.press("l")
    page.until("the present", time=None)
    eventually("the agent as it is", lambda: moved() < 0.01)


def test_the_page_comes_back_after_a_restart(service: Server, open_page: Open) -> None:
    ada = Driver(service, "ada")
    ada.drive(STEPS)
    page = open_page(service)
    places = page.until_places(10)["places"]
    service.kill()
    page.until("the loss", connection="reconnecting")
    assert "Reconnecting" in page.text(".notice")
    service.start()
    page.until("the return", connection="live")
    eventually("the notice goes", lambda: not page.page.locator(".notice").is_visible())
    ada.drive(STEPS)
    page.until_places(places + 5)


def test_a_token_is_asked_for_and_stays_in_the_tab(
    make_service: MakeServer, open_page: Open
) -> None:
    service = make_service(["http.token=secret-of-the-house"], token="secret-of-the-house")
    Driver(service, "ada").drive(STEPS)
    page = open_page(service)
    for text in ("wrong", "secret-of-the-house"):
        eventually("the question", page.page.locator(".token input").is_visible)
        page.page.fill(".token input", text)
        page.page.click(".token button")
        page.page.wait_for_timeout(300)
    page.until_places(10)
    assert page.stats()["connection"] == "live"
    assert "secret" not in page.page.url
    assert page.page.evaluate("JSON.stringify(localStorage)").count("secret") == 0
    page.page.reload()
    page.until_places(10)


def test_dark_and_light_are_as_the_system_has_them_until_somebody_chooses(
    service: Server, open_page: Open
) -> None:
    Driver(service, "ada").drive(STEPS)
    dark = open_page(service, color_scheme="dark")
    light = open_page(service, color_scheme="light")
    for page in (dark, light):
        page.until_places(10)
        page.settle()
    assert brightness(dark.picture()) < 0.25 < 0.75 < brightness(light.picture())
    dark.page.keyboard.press("d")
    eventually("the light", lambda: brightness(dark.picture()) > 0.75)
    dark.page.reload()
    dark.until_places(10)
    assert brightness(dark.picture()) > 0.75, "the choice is kept"
    assert n_colours(light.scene()) > COLOURS
    assert dark.complaints + light.complaints == []


def test_a_phone_shows_scene_and_team_without_scrolling_sideways(
    service: Server, open_page: Open
) -> None:
    Driver(service, "ada").drive(STEPS)
    page = open_page(service, width=390, height=844, has_touch=True, is_mobile=True)
    page.until_places(10)
    page.settle()
    assert page.page.evaluate("document.documentElement.scrollWidth") <= 390
    box = page.page.locator("canvas.scene").bounding_box()
    assert box is not None and box["width"] >= 380 and box["height"] >= 300
    for selector in (".agents", ".timeline", ".health", ".space"):
        part = page.page.locator(selector).bounding_box()
        assert part is not None and part["y"] < 844, selector
    page.page.tap("[data-agent=ada]")
    page.until("the agent", selected={"kind": "agent", "name": "ada"})
    assert page.page.locator(".agent-panel").is_visible()
    assert page.complaints == []


def test_an_empty_space_says_what_to_do(service: Server, open_page: Open) -> None:
    service.client().create_space("bare")
    page = open_page(service, space="bare")
    eventually("the hint", lambda: "Nothing is remembered here yet" in page.text(".notice"))
    Driver(service, "ada", space="bare").drive(STEPS)
    page.until_places(10)
    eventually("the hint goes", lambda: not page.page.locator(".notice").is_visible())


def test_an_unknown_space_can_be_left_for_another(service: Server, open_page: Open) -> None:
    Driver(service, "ada").drive(STEPS)
    page = open_page(service, space="nowhere")
    eventually("the word", lambda: "There is no such space" in page.text(".notice"))
    page.page.select_option(".space", "default")
    page.until_places(10)


def test_nothing_comes_from_elsewhere(service: Server, open_page: Open) -> None:
    Driver(service, "ada").drive(STEPS)
    asked = []
    page = open_page(service)
    page.page.on("request", lambda request: asked.append(request.url))
    page.page.reload()
    page.until_places(10)
    assert asked and all(url.startswith(service.url + "/") for url in asked)
    with urllib.request.urlopen(service.url + "/") as answer:
        policy = answer.headers["content-security-policy"]
    assert "script-src 'self'" in policy and "unsafe" not in policy, json.dumps(policy)


def test_pages_that_follow_see_a_drive_to_its_end(service: Server, open_page: Open) -> None:
    ada = Driver(service, "ada")
    pages = [open_page(service, width=640, height=480) for _ in range(3)]
    with Driving(ada):
        for page in pages:
            page.until_places(8)
    revision = str(service.client().space("default").map_revision)
    for page in pages:
        eventually("the last revision", lambda: page.stats()["revision"] == revision)
