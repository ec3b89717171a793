"""Arguments that make no sense, as people type them: each is refused by name, before anything is
opened or sent."""

from __future__ import annotations

import datetime
import json
import pickle
from pathlib import Path
from typing import Any, Callable, Dict, List

import pytest

import cogmap
from cogmap.request import json_of
from stand_in import StandIn

#: An address at which nothing needs to answer.
NOWHERE = "http://127.0.0.1:9"
LEVEL = cogmap.Level("light", 1.0)
STEP = cogmap.Increment((0.1, 0, 0))


@pytest.mark.parametrize(
    "field, settings",
    [
        ("connect", {"connect": 7447}),
        ("connect", {"connect": []}),
        ("session", {"session": "tcp/127.0.0.1:7447"}),
        ("motion_noise", {"motion_noise": 0.1}),
        ("connect_timeout_s", {"connect_timeout_s": None}),
        ("connect_timeout_s", {"connect_timeout_s": float("inf")}),
        ("send_timeout_s", {"send_timeout_s": None}),
        ("match_timeout_s", {"match_timeout_s": -1}),
    ],
)
def test_a_robot_names_the_setting_that_makes_no_sense(
    field: str, settings: Dict[str, Any]
) -> None:
    with pytest.raises(cogmap.InvalidValue) as caught:
        cogmap.Robot("default", "ada", **settings)
    assert caught.value.field == field


@pytest.mark.parametrize(
    "field, call",
    [
        ("stamp_ns", lambda robot: robot.increment([0, 0, 0], stamp_ns=datetime.datetime.now())),
        ("stamp_ns", lambda robot: robot.increment([0, 0, 0], stamp_ns=1.5)),
        ("translation_m", lambda robot: robot.increment("123")),
        ("translation_m", lambda robot: robot.increment([10**400, 0, 0])),
        ("samples", lambda robot: robot.send(cogmap.Sample(1, STEP))),
        ("samples[1]", lambda robot: robot.send([cogmap.Sample(1, STEP), STEP])),
        ("timeout_s", lambda robot: robot.flush(float("inf"))),
        ("timeout_s", lambda robot: robot.estimate(-1)),
        ("timeout_s", lambda robot: robot.wait_for_service(None)),
    ],
)
def test_a_robot_names_the_argument_that_makes_no_sense(
    field: str, call: Callable[[cogmap.Robot], object], recwarn: pytest.WarningsRecorder
) -> None:
    with StandIn() as service, cogmap.Robot("lab", "ada", connect=service.endpoint) as robot:
        with pytest.raises(cogmap.InvalidValue) as caught:
            call(robot)
        assert caught.value.field == field
    assert not recwarn.list, "what is refused is no sample of another clock"


def _contact(**fields: Any) -> cogmap.Contact:
    return cogmap.Contact((0, 0, 0), **fields)


CALLS: List[Any] = [
    ("name", lambda client: client.space("")),
    ("name", lambda client: client.agent("default", 3)),
    ("percept", lambda client: client.recall("default", percept=0.9)),
    ("since_ns", lambda client: client.recall("default", since_ns=1.5)),
    ("motion", lambda client: client.predict("default", "ada", [1, 0, 0])),
    ("batch", lambda client: client.post_samples("default", "ada", [cogmap.Sample(0, STEP)])),
    ("cue", lambda client: client.sequence("default", 5)),
    ("code", lambda client: client.recall("default", code=5)),
    ("channels", lambda client: client.felt("default", (0, 0, 0), channels="light")),
    ("request", lambda client: client.block("default", 5)),
    ("place", lambda client: client.place("default", 1.5)),
    ("samples", lambda client: client.localize("default", cogmap.Sample(0, STEP))),
    ("samples[0]", lambda client: client.localize("default", [STEP])),
    ("contacts[0]", lambda client: client.teach_object("default", "cup", [[0, 0, 0]])),
    ("levels[0]", lambda client: _contact(levels=[("texture", 3)])),
    ("orientation", lambda client: client.identify("default", [_contact()], orientation="free")),
    ("seed", lambda client: client.create_space("lab", seed=object())),
    ("grid_spacing_m", lambda client: client.create_space("lab", grid_spacing_m=float("nan"))),
    ("timeout_s", lambda client: next(client.follow("default", timeout_s=0))),
    ("timeout_s", lambda client: cogmap.Client(NOWHERE, timeout_s=0)),
    ("retry_timeout_s", lambda client: cogmap.Client(NOWHERE, retry_timeout_s=-1)),
    ("url", lambda client: cogmap.Client([])),
    ("url", lambda client: cogmap.Client([NOWHERE, "nowhere"])),
    ("ca_file", lambda client: cogmap.Client(NOWHERE, ca_file="/nowhere/ca.pem")),
    ("ca_file", lambda client: cogmap.Client(NOWHERE, ca_file=__file__)),
    ("token", lambda client: cogmap.Client(NOWHERE, token="s3cr\u2026et")),
    ("token", lambda client: cogmap.Client(NOWHERE, token="s3cret\nX-Other: 1")),
    ("token", lambda client: cogmap.Client(NOWHERE, token=b"s3cret")),  # type: ignore[arg-type]
]


@pytest.mark.parametrize("field, call", CALLS)
def test_a_client_names_the_argument_that_makes_no_sense(
    field: str, call: Callable[[cogmap.Client], object]
) -> None:
    with pytest.raises(cogmap.InvalidValue) as caught:
        call(cogmap.Client(NOWHERE))
    assert caught.value.field == field
    assert "s3c" not in str(caught.value), "no token is in a message"


def test_a_token_may_end_with_the_line_break_of_its_file(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text("s3cret\n")
    client = cogmap.Client(NOWHERE, token=file.read_text())
    assert client._make_request("GET", "/", accept="*/*").get_header("Authorization") == (
        "Bearer s3cret"
    )


def test_numbers_of_numpy_are_numbers() -> None:
    numpy = pytest.importorskip("numpy")
    settings = {"seed": numpy.int64(7), "grid_spacing_m": numpy.float32(1.5), "x": numpy.ones(2)}
    assert json.loads(json_of("settings", settings)) == {
        "seed": 7,
        "grid_spacing_m": 1.5,
        "x": [1.0, 1.0],
    }
    with pytest.raises(cogmap.Unreachable):
        cogmap.Client(NOWHERE).recall("default", limit=numpy.int64(3), since_ns=numpy.int64(5))


def test_a_value_of_many_lines_is_told_in_one() -> None:
    numpy = pytest.importorskip("numpy")
    with pytest.raises(cogmap.InvalidValue) as caught:
        cogmap.Increment(numpy.zeros((3, 2)))
    assert "\n" not in str(caught.value)


ERRORS: List[cogmap.CogmapError] = [
    cogmap.CogmapError("text"),
    cogmap.InvalidValue("field", 1, "expected two"),
    cogmap.WindowFull(1, 2),
    cogmap.SessionSuperseded("ada", 1, 2),
    cogmap.ApiError(404, "/problems/unknown-space", "Unknown space", "there is none", {"a": 1}),
]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_errors_come_through_from_another_process(error: cogmap.CogmapError) -> None:
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is type(error) and str(copy) == str(error)
    assert vars(copy) == vars(error)
