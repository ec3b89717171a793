"""A robot against a stand-in for the service, through a real Zenoh router on loopback."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Callable, Iterator, List

import pytest

import cogmap
from stand_in import StandIn, free_port

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@pytest.fixture
def service() -> Iterator[StandIn]:
    with StandIn() as service:
        yield service


def ada(service: StandIn, **settings: object) -> cogmap.Robot:
    # The tests count what they send.
    settings.setdefault("ends_session", False)
    return cogmap.Robot("lab", "ada", connect=service.endpoint, **settings)  # type: ignore[arg-type]


def eventually(holds: Callable[[], bool], timeout_s: float = 20.0) -> bool:
    deadline = time.monotonic() + timeout_s
    while not holds():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.01)
    return True


def levels(samples: List[cogmap.Sample]) -> List[float]:
    return [sample.body.value for sample in samples if isinstance(sample.body, cogmap.Level)]


def test_a_robot_gets_its_first_estimate(service: StandIn) -> None:
    with ada(service) as robot:
        robot.start_pose([0, 0, 0])
        robot.velocity([0.5, 0, 0], [0, 0, 0.1], duration_s=0.1)
        robot.flush()
        assert robot.pending == 0
        estimate = robot.estimate()
        assert (estimate.session, estimate.seq) == (robot.session_id, 1)
        assert estimate.status is cogmap.Status.LOCALIZED
        watermark = robot.watermark
        assert watermark is not None and watermark.durable == 2
    assert [type(sample.body) for sample in service.journal] == [cogmap.StartPose, cogmap.Velocity]
    assert set(service.encodings) == {"application/cbor"}


def test_the_example_program_runs(service: StandIn) -> None:
    command = [sys.executable, str(EXAMPLES / "first_estimate.py"), "--space", "lab"]
    command += ["--connect", service.endpoint]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(
        "ada localized in lab: x 1.000 y 2.000 z 0.000 m, yaw 0.000 rad, "
    )
    assert done.stdout.count("\n") == 1


def test_every_kind_of_sample_arrives_as_it_was_given(service: StandIn) -> None:
    noise = cogmap.MotionNoise((0.1, 0.1, 0.1), (0.2, 0.2, 0.2))
    with ada(service, motion_noise=noise) as robot:
        assert robot.increment([1, 0, 0], stamp_ns=10) == 0
        assert robot.velocity([1, 0, 0], [0, 0, 1], 0.5, stamp_ns=20) == 1
        robot.level("touch", 3, normal=[0, 0, 1], stamp_ns=30)
        robot.descriptor("view", [1.0] * 8, stamp_ns=40)
        bearing = cogmap.RangeBearing(2.0, 0.5, range_sd_m=0.1, bearing_sd_rad=0.02)
        robot.sighting("door", bearing, stamp_ns=50)
        position = cogmap.Position((1.0, 2.0, 3.0), (0.1, 0.1, 0.1))
        robot.sighting(cogmap.AgentTarget("bob"), position, stamp_ns=60)
        pose = cogmap.RelativePose((1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), noise)
        robot.sighting(cogmap.OwnSampleTarget(1), pose, stamp_ns=70)
        robot.start_pose([0, 0, 0], stamp_ns=80)
        robot.marker("lunch", ends_trip=True, stamp_ns=90)
        made = [cogmap.Sample(100, cogmap.Level("touch", 1.0)) for _ in range(3)]
        assert robot.send(made) == range(9, 12)
        assert robot.send([]) == range(12, 12)
        robot.flush()
    assert [sample.body for sample in service.journal[:9]] == [
        cogmap.Increment((1.0, 0.0, 0.0), noise=noise),
        cogmap.Velocity((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.5, noise),
        cogmap.Level("touch", 3.0, normal=(0.0, 0.0, 1.0)),
        cogmap.Descriptor("view", (1.0,) * 8),
        cogmap.Sighting(cogmap.LandmarkTarget("door"), bearing),
        cogmap.Sighting(cogmap.AgentTarget("bob"), position),
        cogmap.Sighting(cogmap.OwnSampleTarget(1), pose),
        cogmap.StartPose((0.0, 0.0, 0.0)),
        cogmap.Marker("lunch", True),
    ]
    assert [sample.stamp_ns for sample in service.journal[:10]] == list(range(10, 101, 10))
    assert service.journal[9:] == made


def test_default_stamps_are_now_and_never_run_backwards(service: StandIn) -> None:
    with ada(service) as robot:
        before = time.time_ns()
        robot.marker("now")
        ahead = time.time_ns() + 10**12
        with pytest.warns(cogmap.ClockWarning):
            robot.marker("ahead", stamp_ns=ahead)
        robot.marker("after")
    stamps = [sample.stamp_ns for sample in service.journal]
    assert before <= stamps[0] <= ahead and stamps[2] == ahead


def test_a_lost_batch_is_sent_again_when_the_watermark_names_the_gap(service: StandIn) -> None:
    service.loses = lambda number: number == 1
    service.answers_queries = False
    with ada(service, batch_samples=10) as robot:
        for value in range(50):
            robot.level("n", value)
        robot.flush()
    assert levels(service.journal) == list(range(50))
    firsts = [batch.first_seq for batch in service.batches]
    assert firsts.count(10) == 2, "the lost batch came twice"
    assert firsts.count(0) == 1, "and what had arrived did not"


def test_a_flush_behind_a_gap_says_what_the_service_waits_for(service: StandIn) -> None:
    service.loses = lambda number: service.batches[number].first_seq == 0
    with ada(service, batch_samples=10) as robot:
        for value in range(20):
            robot.level("n", value)
        with pytest.raises(cogmap.Timeout, match="waits for samples 0 to 9, which are sent again"):
            robot.flush(0.5)
        service.loses = lambda number: False


def test_silence_brings_back_what_no_gap_can_name(service: StandIn) -> None:
    service.loses = lambda number: number < 2
    with ada(service, batch_samples=10) as robot:
        for value in range(20):
            robot.level("n", value)
        robot.flush()
    assert levels(service.journal) == list(range(20))
    assert service.queries >= 2, "the one before the first put, and one after a silence"


def test_a_lost_watermark_is_asked_for_and_nothing_is_sent_twice(service: StandIn) -> None:
    service.publishes_watermarks = False
    with ada(service, batch_samples=10) as robot:
        for value in range(10):
            robot.level("n", value)
        robot.flush()
    assert service.queries >= 2, "the one before the first put, and one after a silence"
    assert len(service.journal) == 10


def test_a_third_of_all_messages_may_be_lost(service: StandIn) -> None:
    service.loses = lambda number: number % 3 == 0
    with ada(service, batch_samples=7) as robot:
        for value in range(120):
            robot.level("n", value)
        robot.flush(60.0)
    assert levels(service.journal) == list(range(120))


def test_samples_wait_for_a_service_that_starts_later() -> None:
    service = StandIn()
    try:
        with ada(service, match_timeout_s=0.3) as robot:
            robot.level("n", 1)
            assert not robot.wait_for_service(0.05)
            with pytest.raises(cogmap.Timeout):
                robot.flush(1.0)
            assert robot.pending == 1
            service.listen()
            assert robot.wait_for_service(10.0)
            robot.flush(30.0)
        assert levels(service.journal) == [1]
    finally:
        service.close()


def test_a_restarted_router_and_service_get_everything() -> None:
    first = StandIn()
    first.listen()
    with ada(first) as robot:
        robot.level("n", 0)
        robot.flush()
        journal, session = list(first.journal), first.session
        first.close()
        for value in range(1, 40):
            robot.level("n", value)
        second = StandIn(first.port)
        second.journal, second.session = journal, session
        second.listen()
        try:
            robot.flush(60.0)
            assert levels(second.journal) == list(range(40))
        finally:
            robot.close()
            second.close()


def test_a_later_run_takes_over_and_the_earlier_one_is_told(service: StandIn) -> None:
    with ada(service, session_id=5) as early:
        early.marker("early")
        early.flush()
        with ada(service, session_id=6) as late:
            late.marker("late")
            late.flush()
        with pytest.raises(cogmap.SessionSuperseded) as raised:
            assert eventually(lambda: raises_superseded(early))
            early.marker("again")
        assert (raised.value.own, raised.value.other) == (5, 6)
    assert [sample.body for sample in service.journal] == [cogmap.Marker("late")]


def raises_superseded(robot: cogmap.Robot) -> bool:
    try:
        robot.estimate(0.0)
    except cogmap.SessionSuperseded:
        return True
    return False


def test_a_flush_under_way_ends_when_the_session_is_superseded(service: StandIn) -> None:
    service.publishes_watermarks = False
    service.answers_queries = False
    with ada(service, session_id=5) as robot:
        robot.marker("x")
        threading.Timer(0.3, service.publish, [cogmap.Watermark(9, 0, 0)]).start()
        with pytest.raises(cogmap.SessionSuperseded):
            robot.flush(30.0)


@pytest.mark.parametrize("count", [1, 10, 500])
def test_a_session_number_used_twice_is_noticed(service: StandIn, count: int) -> None:
    with ada(service, session_id=5) as robot:
        for _ in range(10):
            robot.marker("x")
    with ada(service, session_id=5) as robot:
        with pytest.raises(cogmap.SessionSuperseded, match="in use by another run"):
            # The answer to the robot's first question may come before the last of them.
            for _ in range(count):
                robot.marker("y")
            robot.flush()
    assert [sample.body for sample in service.journal] == [cogmap.Marker("x")] * 10
    assert all(cogmap.Marker("y") != s.body for batch in service.batches for s in batch.samples)


@pytest.mark.parametrize("beyond", [cogmap.Watermark(5, 0, 2), cogmap.Watermark(5, 2, 2)])
def test_what_this_run_never_sent_is_of_another_run(
    service: StandIn, beyond: cogmap.Watermark
) -> None:
    service.publishes_watermarks = False
    service.answers_queries = False
    with ada(service, session_id=5) as robot:
        robot.marker("x")
        threading.Timer(0.3, service.publish, [beyond]).start()
        with pytest.raises(cogmap.SessionSuperseded, match="in use by another run"):
            robot.flush(30.0)
        # A watermark that would fit acknowledges nothing any more.
        service.publish(cogmap.Watermark(5, 1, 1))
        with pytest.raises(cogmap.SessionSuperseded):
            robot.flush(0.5)
        assert robot.pending == 1


def test_a_first_answer_that_stays_away_holds_up_nobody(service: StandIn) -> None:
    service.delays_queries = True
    with ada(service) as robot:
        robot.marker("x")
        robot.flush()
    assert service.queries >= 1
    assert len(service.journal) == 1


def test_watermarks_of_earlier_runs_and_foreign_bytes_are_ignored(service: StandIn) -> None:
    service.publishes_watermarks = False
    service.answers_queries = False
    with ada(service, session_id=5) as robot:
        robot.marker("x")
        service.publish(cogmap.Watermark(4, 100, 100))
        service.publish_bytes(b"\xff\x00", "application/cbor")
        service.publish_bytes(b"{}", "application/json")
        service.publish_bytes(b"", "zenoh/bytes")
        with pytest.raises(cogmap.Timeout):
            robot.flush(0.5)
        assert robot.pending == 1
        service.publish(cogmap.Watermark(5, 1, 1))
        robot.flush()


def test_a_full_window_blocks_and_then_raises(service: StandIn) -> None:
    service.publishes_watermarks = False
    service.answers_queries = False
    robot = ada(service, window_samples=5, send_timeout_s=0.3)
    with pytest.raises(cogmap.WindowFull) as raised:
        robot.send(cogmap.Sample(0, cogmap.Marker(str(i))) for i in range(9))
    assert raised.value.accepted == 5
    with pytest.raises(cogmap.WindowFull):
        robot.marker("one more", stamp_ns=0)
    threading.Timer(0.1, service.publish, [cogmap.Watermark(robot.session_id, 3, 3)]).start()
    assert robot.marker("room again", stamp_ns=0) == 5
    with pytest.raises(cogmap.Timeout, match="3 samples"):
        robot.close(timeout_s=0.2)


def test_a_window_smaller_than_the_data_only_slows_the_robot_down(service: StandIn) -> None:
    with ada(service, window_samples=8, batch_samples=64, batch_delay_s=30.0) as robot:
        for value in range(100):
            robot.level("n", value)
    assert levels(service.journal) == list(range(100))


def test_refused_samples_are_surfaced_once(service: StandIn) -> None:
    refused = cogmap.Rejection(cogmap.SeqRange(0, 1), cogmap.SkipReason.TIME_BACKWARDS)
    service.rejected = (refused,)
    told: List[cogmap.Rejection] = []
    with ada(service) as robot:
        robot.on_rejection(told.append)
        for _ in range(3):
            robot.marker("x")
            robot.flush()
        assert robot.rejections == (refused,)
    assert told == [refused]


def test_estimates_reach_callbacks_and_a_failing_callback_harms_nobody(service: StandIn) -> None:
    seen: List[int] = []

    def fail(_: cogmap.Estimate) -> None:
        raise RuntimeError("mine")

    with ada(service) as robot:
        robot.on_estimate(fail)
        robot.on_estimate(lambda estimate: seen.append(estimate.seq))
        with pytest.raises(cogmap.Timeout):
            robot.estimate(0.05)
        for _ in range(3):
            robot.marker("x")
            robot.flush()
        # The answer to a query may say that the last sample is applied before its estimate is
        # published.
        eventually(lambda: len(seen) == 3)
    assert seen == [0, 1, 2]


def test_a_callback_that_would_wait_for_itself_is_told(service: StandIn) -> None:
    caught: List[BaseException] = []

    def flush(_: cogmap.Estimate) -> None:
        try:
            robot.flush()
        except cogmap.CalledFromCallback as error:
            caught.append(error)

    with ada(service) as robot:
        robot.on_estimate(flush)
        robot.marker("x")
        robot.flush()
        # The estimate may follow the acknowledgement, as above.
        eventually(lambda: len(caught) == 1)
    assert len(caught) == 1


def test_batches_of_large_samples_stay_below_the_limit_of_a_message(service: StandIn) -> None:
    with ada(service, batch_samples=4096) as robot:
        for _ in range(100):
            robot.descriptor("view", [0.1] * 4096)
        robot.flush(60.0)
    assert len(service.journal) == 100
    assert max(len(batch.samples) for batch in service.batches) < 50


def test_many_threads_share_a_robot(service: StandIn) -> None:
    numbers: List[int] = []

    def send() -> None:
        for _ in range(200):
            numbers.append(robot.level("n", 1, stamp_ns=0))

    with ada(service, batch_samples=8) as robot:
        threads = [threading.Thread(target=send) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert sorted(numbers) == list(range(800))
    assert len(service.journal) == 800


def test_stamps_of_the_clock_come_in_the_order_of_the_numbers(service: StandIn) -> None:
    each = 3000

    def send() -> None:
        for value in range(each):
            robot.level("n", value)

    interval_s = sys.getswitchinterval()
    # Threads take turns so often that one of them stops at every place where it might.
    sys.setswitchinterval(1e-5)
    try:
        with ada(service, window_samples=512) as robot:
            threads = [threading.Thread(target=send) for _ in range(3)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            robot.flush(60.0)
    finally:
        sys.setswitchinterval(interval_s)
    stamps = [sample.stamp_ns for sample in service.journal]
    assert len(stamps) == 3 * each
    assert stamps == sorted(stamps)


def test_robots_share_a_session_and_leave_it_open(service: StandIn) -> None:
    link = cogmap.open_session(service.endpoint)
    with cogmap.Robot("lab", "ada", session=link) as robot:
        robot.marker("x")
    assert not link.is_closed()
    with cogmap.Robot("lab", "ada", session=link) as robot:
        robot.marker("y")
    bodies = [sample.body for sample in service.journal]
    assert bodies == [cogmap.Marker("y"), cogmap.SessionEnd()]
    link.close()  # type: ignore[no-untyped-call]


def test_a_single_sample_batch_leaves_with_the_call(service: StandIn) -> None:
    link = cogmap.open_session(service.endpoint)
    at_once = {"batch_samples": 1, "batch_delay_s": 60.0, "ends_session": False}
    with cogmap.Robot("lab", "ada", session=link, **at_once) as robot:  # type: ignore[arg-type]
        assert robot.wait_for_service()
        for value in range(5):
            robot.level("n", value)
        assert eventually(lambda: len(service.batches) == 5)
    link.close()  # type: ignore[no-untyped-call]
    assert [len(batch.samples) for batch in service.batches] == [1] * 5


def test_closing_ends_the_session_with_a_last_sample_at_the_last_stamp(service: StandIn) -> None:
    with ada(service, ends_session=True):
        pass
    assert service.journal == [], "one that has sent nothing has no session to end"
    with ada(service, ends_session=True) as robot:
        robot.marker("x", stamp_ns=7)
    assert service.journal == [
        cogmap.Sample(7, cogmap.Marker("x")),
        cogmap.Sample(7, cogmap.SessionEnd()),
    ]


def test_a_closed_robot_says_so(service: StandIn) -> None:
    robot = ada(service)
    robot.close()
    robot.close()
    for call in (lambda: robot.marker("x"), robot.flush, robot.estimate):
        with pytest.raises(cogmap.Closed):
            call()


def test_an_error_in_the_block_is_not_hidden_by_the_close(service: StandIn) -> None:
    service.publishes_watermarks = False
    service.answers_queries = False
    with pytest.raises(ZeroDivisionError):
        with ada(service) as robot:
            robot.marker("x")
            raise ZeroDivisionError


def test_no_router_is_a_timeout() -> None:
    with pytest.raises(cogmap.Timeout):
        cogmap.Robot("lab", "ada", connect=f"tcp/127.0.0.1:{free_port()}", connect_timeout_s=0.3)


@pytest.mark.parametrize("space, agent", [("", "ada"), ("lab", "a/b"), ("lab", "*"), ("-x", "ada")])
def test_names_that_are_no_key_are_refused(space: str, agent: str) -> None:
    with pytest.raises(ValueError, match="expected a name: "):
        cogmap.Robot(space, agent)
