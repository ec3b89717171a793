"""What the service would refuse is refused when it is handed over, by field and value, and nothing
else is."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any, Callable, Dict, Tuple

import pytest

import cogmap
from cogmap.sampler import Sampler
from cogmap.wire import decode, encode_sample, from_wire, to_wire
from validity import Refused, accepted, refused

#: Classes by their names on the wire; a name can stand for two of them.
_TAGGED: Dict[str, type] = {
    "increment": cogmap.Increment,
    "velocity": cogmap.Velocity,
    "level": cogmap.Level,
    "descriptor": cogmap.Descriptor,
    "sighting": cogmap.Sighting,
    "start_pose": cogmap.StartPose,
    "marker": cogmap.Marker,
    "landmark": cogmap.LandmarkTarget,
    "agent": cogmap.AgentTarget,
    "own_sample": cogmap.OwnSampleTarget,
    "position": cogmap.Position,
    "range": cogmap.Range,
    "range_bearing": cogmap.RangeBearing,
    "pose": cogmap.RelativePose,
    "object": cogmap.ObjectMark,
    "learn": cogmap.LearnObject,
    "identify": cogmap.IdentifyObject,
    "end": cogmap.EndObject,
    "known": cogmap.NoTurn,
    "finite": cogmap.FiniteTurns,
}


def handed_over(value: Any) -> Any:
    """A body made as a program makes it, by the constructors of the messages."""
    if isinstance(value, list):
        return tuple(handed_over(item) for item in value)
    if not isinstance(value, dict):
        return value
    if len(value) == 1 and next(iter(value)) in _TAGGED:
        ((tag, content),) = value.items()
        cls = _TAGGED[tag]
        if getattr(cls, "NEWTYPE", False):
            return cls(handed_over(content))
        return cls(**{name: handed_over(item) for name, item in content.items()})
    fields = {name: handed_over(item) for name, item in value.items()}
    for cls in (cogmap.MotionNoise, cogmap.TouchNoise):
        if fields.keys() == {field.name for field in dataclasses.fields(cls)}:
            return cls(**fields)
    return fields


@pytest.mark.parametrize("case", refused(), ids=lambda case: f"{case.field}-{case.reason}")
def test_a_value_that_the_service_refuses_is_refused_by_name(case: Refused) -> None:
    with pytest.raises(cogmap.InvalidValue) as raised:
        handed_over(case.body)
    assert raised.value.field == case.field
    assert str(raised.value).startswith(f"{case.field}: expected ")
    assert isinstance(raised.value, ValueError) and isinstance(raised.value, cogmap.CogmapError)
    with pytest.raises(cogmap.WireError, match="expected"):
        from_wire(cogmap.Sample, {"stamp_ns": 0, "body": case.body})


@pytest.mark.parametrize("body", accepted(), ids=lambda body: next(iter(body)))
def test_a_value_at_the_limit_is_taken(body: Any) -> None:
    sample = cogmap.Sample(0, handed_over(body))
    assert from_wire(cogmap.Sample, json.loads(json.dumps(to_wire(sample)))) == sample
    assert decode(cogmap.Sample, encode_sample(sample)) == sample


class Recorder(Sampler):
    """Keeps what a robot would send."""

    def __init__(self) -> None:
        super().__init__(None)
        self.sent = 0

    def _send(self, body: cogmap.SampleBody, stamp_ns: Any) -> int:
        self.sent += 1
        return self.sent - 1


CALLS: Tuple[Tuple[Callable[[Recorder], object], str], ...] = (
    (
        lambda r: r.increment([0, math.nan, 0]),
        "translation_m[1]: expected a finite number, not nan",
    ),
    (
        lambda r: r.increment([1e9, 0, 0]),
        "translation_m[0]: expected -1e+08 to 1e+08, not 1000000000.0",
    ),
    (lambda r: r.increment([1, 2]), "translation_m: expected 3 numbers, not 2 of them"),
    (lambda r: r.increment(5), "translation_m: expected 3 numbers, not 5"),  # type: ignore[arg-type]
    (
        lambda r: r.increment("abc"),  # type: ignore[arg-type]
        "translation_m: expected 3 numbers, not 'abc'",
    ),
    (
        lambda r: r.start_pose([0, 0, 0], [0, 0, 0, 0]),
        "rotation_xyzw: expected a unit quaternion [x, y, z, w], "
        "not (0.0, 0.0, 0.0, 0.0), whose norm is 0",
    ),
    (
        lambda r: r.velocity([1, 0, 0], [0, 0, 0], -1),
        "duration_s: expected 0 to 3600, not -1",
    ),
    (
        lambda r: r.velocity([1, 0, 0], [0, 0, 0], "soon"),  # type: ignore[arg-type]
        "duration_s: expected a number, not 'soon'",
    ),
    (
        lambda r: r.level("front camera", 1),
        "channel: expected a name: 1 to 64 of A-Z a-z 0-9 _ . -, the first a letter or digit, "
        "not 'front camera'",
    ),
    (lambda r: r.marker(""), "label: expected 1 to 128 bytes of UTF-8, not '' of 0 bytes"),
    (lambda r: r.level("light", math.inf), "value: expected a finite number, not inf"),
    (
        lambda r: r.level("light", "1"),  # type: ignore[arg-type]
        "value: expected a number, not '1'",
    ),
    (lambda r: r.level("light", True), "value: expected a number, not True"),
    (
        lambda r: r.descriptor("view", [1.0] * 7),
        "vector: expected 8 to 4096 numbers, not 7 of them",
    ),
    (
        lambda r: r.descriptor("view", [math.nan] * 4096),
        "vector: expected finite numbers that have a direction, not a vector of norm nan",
    ),
    (
        lambda r: r.sighting("door", cogmap.Position((1, 0, 0), (0.1, 0.1, -0.1))),
        "sd_m[2]: expected 0 to 1e+08, not -0.1",
    ),
    (
        lambda r: r.learn_object("identify"),
        "name: expected a name that is not reserved, not 'identify'",
    ),
)


@pytest.mark.parametrize("call, message", CALLS, ids=[message for _, message in CALLS])
def test_the_error_names_the_field_and_shows_the_value(
    call: Callable[[Recorder], object], message: str
) -> None:
    recorder = Recorder()
    with pytest.raises(cogmap.InvalidValue) as raised:
        call(recorder)
    assert str(raised.value) == message
    assert recorder.sent == 0, "no sample was made"


def test_a_long_value_is_shown_in_short() -> None:
    with pytest.raises(cogmap.InvalidValue) as raised:
        cogmap.Descriptor("view", ["x"] * 4096)  # type: ignore[arg-type]
    assert len(str(raised.value)) < 200
    assert len(raised.value.value) == 4096  # type: ignore[arg-type]


def test_settings_of_a_robot_are_checked_by_name() -> None:
    for settings in ({"batch_samples": 0}, {"window_samples": 0}, {"batch_delay_s": math.nan}):
        (name,) = settings
        with pytest.raises(cogmap.InvalidValue, match=f"^{name}: "):
            cogmap.Robot("lab", "ada", connect="tcp/127.0.0.1:1", **settings)


def test_lists_have_their_bounds() -> None:
    sample, contact = cogmap.Sample(0, cogmap.Marker("x")), cogmap.Contact((0, 0, 0))
    client = cogmap.Client("http://127.0.0.1:1")
    for most, make in (
        (4096, lambda count: cogmap.SampleBatch(1, 0, (sample,) * count)),
        (4096, lambda count: cogmap.LocalizeQuery((sample,) * count)),
        (4096, lambda count: client.teach_object("lab", "cup", [contact] * count)),
        (256, lambda count: client.identify("lab", [contact] * count)),
    ):
        for count in (0, most + 1):
            with pytest.raises(
                cogmap.InvalidValue, match=f"expected 1 to {most} of them, not {count}"
            ):
                make(count)
