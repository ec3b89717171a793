"""Messages against the golden files of the protocol, and the edges of reading and writing."""

from __future__ import annotations

import json
from array import array
from pathlib import Path
from typing import Any, Dict, List

import cbor2
import pytest

import cogmap
from cogmap.query import PredictQuery, RecallQuery, WatermarkQuery
from cogmap.wire import CBOR, JSON, decode, encode, encode_batch, encode_sample, from_wire, to_wire

GOLDEN = Path(__file__).resolve().parents[3] / "proto" / "golden"

#: The message of a golden file, by the longest of these that its name begins with.
TYPES: Dict[str, type] = {
    "agent_at": cogmap.AgentAt,
    "agent_detail": cogmap.AgentDetail,
    "agent_object": cogmap.AgentObject,
    "agent_page": cogmap.AgentPage,
    "batch": cogmap.SampleBatch,
    "estimate": cogmap.Estimate,
    "event": cogmap.Event,
    "event_page": cogmap.EventPage,
    "event_record": cogmap.EventRecord,
    "grid_state": cogmap.GridState,
    "blockage": cogmap.Blockage,
    "blockage_list": cogmap.BlockageList,
    "blockage_request": cogmap.BlockageRequest,
    "felt_answer": cogmap.FeltAnswer,
    "felt_query": cogmap.FeltQuery,
    "follow_request": cogmap.FollowRequest,
    "followed_route": cogmap.FollowedRoute,
    "followed_route_page": cogmap.FollowedRoutePage,
    "identification": cogmap.Identification,
    "identify_query": cogmap.IdentifyQuery,
    "ingest_answer": cogmap.IngestAnswer,
    "channel_list": cogmap.ChannelList,
    "landmark_page": cogmap.LandmarkPage,
    "localization": cogmap.Localization,
    "localize_query": cogmap.LocalizeQuery,
    "missed_events": cogmap.MissedEvents,
    "object_detail": cogmap.ObjectDetail,
    "object_lesson": cogmap.ObjectLesson,
    "object_page": cogmap.ObjectPage,
    "place_page": cogmap.PlacePage,
    "place_percepts": cogmap.PlacePercepts,
    "predict_answer": cogmap.PredictAnswer,
    "predict_query": PredictQuery,
    "recall_answer": cogmap.RecallAnswer,
    "recall_query": RecallQuery,
    "route_answer": cogmap.RouteAnswer,
    "route_query": cogmap.RouteQuery,
    "sequence_answer": cogmap.SequenceAnswer,
    "sequence_query": cogmap.SequenceQuery,
    "space_list": cogmap.SpaceList,
    "space_settings": cogmap.SpaceSettings,
    "trajectory": cogmap.Trajectory,
    "trip_detail": cogmap.TripDetail,
    "trip_page": cogmap.TripPage,
    "watermark": cogmap.Watermark,
    "watermark_query": WatermarkQuery,
}

#: `problem` becomes an `ApiError`; the tests of the HTTP client hold it.
NAMES: List[str] = sorted(
    path.stem for path in GOLDEN.glob("*.cbor") if not path.stem.startswith("problem")
)


def type_of(name: str) -> Any:
    prefixes = [prefix for prefix in TYPES if name == prefix or name.startswith(prefix + "_")]
    assert prefixes, f"golden file {name}: this package has no message for it"
    return TYPES[max(prefixes, key=len)]


def test_the_golden_files_cover_every_message() -> None:
    assert {type_of(name) for name in NAMES} == set(TYPES.values())


#: Samples with every integer at its limit, but also with a coordinate that is refused.
EXTREMES = "batch_extremes"
NAMES.remove(EXTREMES)


@pytest.mark.parametrize("name", NAMES)
def test_golden_cbor_is_read_and_written_byte_for_byte(name: str) -> None:
    data = (GOLDEN / f"{name}.cbor").read_bytes()
    message = decode(type_of(name), data, CBOR)
    assert encode(message) == data


@pytest.mark.parametrize("name", NAMES)
def test_golden_json_is_the_same_message(name: str) -> None:
    data = (GOLDEN / f"{name}.json").read_bytes()
    message = decode(type_of(name), data, JSON)
    assert encode(message) == (GOLDEN / f"{name}.cbor").read_bytes()


@pytest.mark.parametrize("name", [name for name in NAMES if name.startswith("batch")])
def test_a_batch_of_encoded_samples_is_the_golden_batch(name: str) -> None:
    data = (GOLDEN / f"{name}.cbor").read_bytes()
    batch = decode(cogmap.SampleBatch, data)
    samples = tuple(encode_sample(sample) for sample in batch.samples)
    assert encode_batch(batch.session, batch.first_seq, samples) == data


def test_a_batch_with_a_sample_that_is_refused_is_not_read() -> None:
    with pytest.raises(cogmap.WireError, match=r"offset_m\[2\]: expected -1e\+08 to 1e\+08"):
        decode(cogmap.SampleBatch, (GOLDEN / f"{EXTREMES}.cbor").read_bytes())


@pytest.mark.parametrize("stamp_ns", [-(2**63), -1, 2**63 - 1])
def test_integers_at_their_limits_keep_their_value(stamp_ns: int) -> None:
    batch = cogmap.SampleBatch(2**64 - 2, 2**64 - 5, (cogmap.Sample(stamp_ns, cogmap.Marker("x")),))
    assert decode(cogmap.SampleBatch, encode(batch)) == batch


SESSIONS = [0, 23, 24, 255, 256, 65535, 65536, 2**32 - 1, 2**32, 2**64 - 1]


@pytest.mark.parametrize("count", [1, 23, 24, 255, 256, 4096])
@pytest.mark.parametrize("session", SESSIONS)
def test_heads_of_every_size_are_cbor(count: int, session: int) -> None:
    sample = cogmap.Sample(-5, cogmap.Marker("x"))
    data = encode_batch(session, 7, (encode_sample(sample),) * count)
    assert decode(cogmap.SampleBatch, data) == cogmap.SampleBatch(session, 7, (sample,) * count)


def test_floats_keep_their_value() -> None:
    values = (0.0, -0.0, 0.1, 1.5, 65504.0, 65505.0, 1e-300, -1e300, 2.0**-24, 2.0**-149, 3.4e38)
    for value in values:
        level = cogmap.Sample(0, cogmap.Level("c", value))
        back = cbor2.loads(encode_sample(level))["body"]["level"]["value"]
        assert back == value and str(back) == str(value)


def test_arrays_and_integers_become_floats() -> None:
    velocity = cogmap.Velocity(array("d", [1, 2, 3]), [0, 0, 1], 1)  # type: ignore[arg-type]
    assert velocity == cogmap.Velocity((1.0, 2.0, 3.0), (0.0, 0.0, 1.0), 1.0)
    assert b"\x01" not in encode(velocity)[-40:], "no integer stands where a float belongs"


def test_numpy_arrays_are_taken() -> None:
    numpy = pytest.importorskip("numpy")
    pose = cogmap.StartPose(numpy.array([1, 2, 3]), numpy.array([0.0, 0, 0, 1], dtype="float32"))
    assert pose == cogmap.StartPose((1.0, 2.0, 3.0))
    descriptor = cogmap.Descriptor("view", numpy.full(8, 0.1))
    assert descriptor.vector == tuple(array("f", [0.1] * 8))
    stamped = cogmap.Sample(numpy.int64(5), cogmap.Marker("x"))
    assert cbor2.loads(encode_sample(stamped))["stamp_ns"] == 5
    assert cbor2.loads(encode(descriptor))["descriptor"]["vector"][0] == descriptor.vector[0]


@pytest.mark.parametrize(
    "make",
    [
        lambda: cogmap.StartPose([1, 2]),  # type: ignore[arg-type]
        lambda: cogmap.StartPose([1, 2, 3], [0, 0, 0]),  # type: ignore[arg-type]
        lambda: cogmap.StartPose(5),  # type: ignore[arg-type]
        lambda: cogmap.Descriptor("view", ["x"] * 8),  # type: ignore[arg-type]
        lambda: cogmap.Descriptor(3, (1.0,) * 8),  # type: ignore[arg-type]
        lambda: cogmap.Sample(2**63, cogmap.Marker("x")),
        lambda: cogmap.Sample(1.5, cogmap.Marker("x")),  # type: ignore[arg-type]
        lambda: cogmap.Sample(1, {"marker": {}}),  # type: ignore[arg-type]
        lambda: cogmap.Marker("\ud800"),
        lambda: cogmap.OwnSampleTarget(-1),
        lambda: cogmap.Increment((0, 0, 0), noise=0.1),  # type: ignore[arg-type]
        lambda: cogmap.Sighting("door", cogmap.Position((0, 0, 0), (1, 1, 1))),  # type: ignore[arg-type]
    ],
)
def test_what_cannot_be_a_sample_is_refused_at_once(make: Any) -> None:
    with pytest.raises(cogmap.InvalidValue):
        make()


def test_reading_is_lenient_where_the_protocol_grows() -> None:
    watermark = {"session": 1, "durable": 2, "applied": 3, "news": [1]}
    assert from_wire(cogmap.Watermark, watermark) == cogmap.Watermark(1, 2, 3)
    kind = {"dreamt": {"x": 1}}
    event = {"space": "s", "agent": "a", "map_revision": 1, "stamp_ns": 2, "kind": kind}
    read = from_wire(cogmap.Event, event)
    assert read.kind == cogmap.UnknownKind("dreamt", {"x": 1})
    assert to_wire(read) == event
    rejection = {"range": {"from": 1, "to": 2}, "reason": "bored"}
    assert from_wire(cogmap.Rejection, rejection).reason is cogmap.SkipReason.UNKNOWN


@pytest.mark.parametrize(
    "data, encoding",
    [
        (b"", CBOR),
        (b"\xff", CBOR),
        (b"\xa1", CBOR),
        (b"{", JSON),
        (b"[]", JSON),
        (b'{"session": 1, "applied": 3}', JSON),
        (b'{"session": true, "durable": 2, "applied": 3}', JSON),
        (b'{"session": 1, "durable": 2.5, "applied": 3}', JSON),
        (b'{"session": 1, "durable": 2, "applied": 3, "gap": [1, 2]}', JSON),
        (b"anything", "application/vnd.cogmap.postcard;v1"),
    ],
)
def test_foreign_bytes_are_a_wire_error(data: bytes, encoding: str) -> None:
    with pytest.raises(cogmap.WireError):
        decode(cogmap.Watermark, data, encoding)


def test_covariance_matrix_is_symmetric_and_in_row_order() -> None:
    estimate = decode(cogmap.Estimate, (GOLDEN / "estimate_lost.cbor").read_bytes())
    numbered = cogmap.Estimate(**{**vars(estimate), "covariance": tuple(map(float, range(21)))})
    matrix = numbered.covariance_matrix()
    assert tuple(matrix[0]) == (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)
    assert (matrix[1][1], matrix[5][5], matrix[5][0]) == (6.0, 20.0, 5.0)
    assert all(matrix[i][j] == matrix[j][i] for i in range(6) for j in range(6))


def test_the_json_of_a_message_is_plain_data() -> None:
    batch = cogmap.SampleBatch(1, 0, (cogmap.Sample(3, cogmap.Velocity((1, 0, 0), (0, 0, 0), 1)),))
    assert json.loads(json.dumps(to_wire(batch))) == {
        "session": 1,
        "first_seq": 0,
        "samples": [
            {
                "stamp_ns": 3,
                "body": {
                    "velocity": {
                        "linear_m_s": [1.0, 0.0, 0.0],
                        "angular_rad_s": [0.0, 0.0, 0.0],
                        "duration_s": 1.0,
                        "noise": None,
                    }
                },
            }
        ],
    }
