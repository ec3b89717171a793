"""Whatever happens to the service, each sample is applied and kept once, in order."""

from __future__ import annotations

import itertools
import os
import random
from typing import List

import pytest

import cogmap
from conftest import MakeServer
from feeder import Feeder, Outcome, drive, journaled, numbered
from server import Server
from wait import LONG_S

AGENT = "ada"
SESSION = 7
#: Kills of the drill; more for a longer one.
KILLS = int(os.environ.get("COGMAP_DRILL_KILLS", "4"))
#: How long the service is stopped [s].
PAUSE_S = float(os.environ.get("COGMAP_DRILL_PAUSE_S", "3"))


def assert_all_there_once(server: Server, sent: int) -> None:
    detail = server.client().agent("default", AGENT)
    assert detail.watermark == cogmap.Watermark(SESSION, durable=sent, applied=sent)
    assert detail.lag_samples == 0
    # One record for the agent's enrolment, one for each sample.
    assert server.client().space("default").map_revision == sent + 1


def test_killed_at_random_instants_it_keeps_each_sample_once(make_service: MakeServer) -> None:
    chance = random.Random(1)
    # Checkpoints often enough that some kills fall into one.
    service = make_service(["engine.checkpoint_interval_s=0.2"])
    robot = service.robot(AGENT, SESSION, window_samples=512, send_timeout_s=LONG_S)
    with Feeder(robot, seed=1) as feeder:
        for _ in range(KILLS):
            feeder.await_told(feeder.told + chance.randrange(1, 1500))
            service.kill()
            told = feeder.told
            service.start()
            if told > 0:
                mark = service.client().agent("default", AGENT).watermark
                assert mark.durable >= told, "what was acknowledged is there"
        # The robot finds the service again by itself.
        feeder.await_told(feeder.told + 1000)
        sent = feeder.finish()
    assert_all_there_once(service, len(sent))
    drilled = Outcome.read(service, AGENT)
    service.terminate()
    assert journaled(service) == {(AGENT, SESSION): numbered(sent)}
    assert drilled == Outcome.undisturbed(make_service(), AGENT, SESSION, sent)


def test_stopped_for_a_while_it_goes_on_as_if_nothing_had_been(make_service: MakeServer) -> None:
    service = make_service()
    samples = drive(seed=2)
    sent: List[cogmap.Sample] = []

    def send(robot: cogmap.Robot, count: int) -> None:
        for sample in itertools.islice(samples, count):
            sent.append(sample)
            robot.send([sample])

    window = 512
    with service.robot(AGENT, SESSION, window_samples=window, send_timeout_s=PAUSE_S) as robot:
        send(robot, window)
        robot.flush(LONG_S)
        service.pause()
        # The stopped service acknowledges nothing: the window fills, waits, and says so.
        with pytest.raises(cogmap.WindowFull) as full:
            send(robot, window + 1)
        assert (full.value.accepted, robot.pending) == (0, window)
        service.resume()
        robot.flush(LONG_S)
        # All but the last were taken; that one gets the number that it would have had.
        assert robot.send([sent[-1]]) == range(2 * window, 2 * window + 1)
        robot.flush(LONG_S)
        send(robot, window)
        robot.flush(LONG_S)
    assert_all_there_once(service, len(sent))
    assert service.counter("cogmap_applied_samples_total") == len(sent)
    paused = Outcome.read(service, AGENT)
    service.terminate()
    assert journaled(service) == {(AGENT, SESSION): numbered(sent)}
    assert paused == Outcome.undisturbed(make_service(), AGENT, SESSION, sent)


def test_what_is_sent_to_a_dead_service_arrives_when_it_is_back(make_service: MakeServer) -> None:
    service = make_service()
    with service.robot(AGENT, SESSION) as robot:
        service.kill()
        samples = list(itertools.islice(drive(seed=3), 200))
        robot.send(samples)
        with pytest.raises(cogmap.Timeout):
            robot.flush(0.5)
        assert robot.pending == 200
        service.start()
        robot.flush(LONG_S)
    assert_all_there_once(service, 200)


def test_a_later_run_takes_over_and_the_earlier_one_is_told(service: Server) -> None:
    before, after = (list(itertools.islice(drive(seed), 300)) for seed in (4, 5))
    with service.robot(AGENT, SESSION) as earlier:
        earlier.send(before)
        earlier.flush(LONG_S)
        with service.robot(AGENT, SESSION + 1) as later:
            later.send(after)
            later.flush(LONG_S)
            # Both go on: from now on only the later one is heard.
            with pytest.raises(cogmap.SessionSuperseded) as told:
                for sample in drive(seed=6):
                    earlier.send([sample])
            assert (told.value.own, told.value.other) == (SESSION, SESSION + 1)
            with pytest.raises(cogmap.SessionSuperseded):
                earlier.flush()
            later.flush(LONG_S)
        assert service.client().agent("default", AGENT).watermark.session == SESSION + 1
    service.terminate()
    assert journaled(service) == {
        (AGENT, SESSION): numbered(before),
        (AGENT, SESSION + 1): numbered(after),
    }


@pytest.mark.parametrize("count", [1, 1000], ids=["fewer", "more"])
def test_a_second_run_with_the_same_session_number_is_told(service: Server, count: int) -> None:
    samples = list(itertools.islice(drive(seed=7), 300))
    with service.robot(AGENT, SESSION) as first:
        first.send(samples)
        first.flush(LONG_S)
    # For example a process that was started twice with a fixed number.
    with service.robot(AGENT, SESSION) as second:
        with pytest.raises(cogmap.SessionSuperseded, match="in use by another run"):
            second.send(itertools.islice(drive(seed=8), count))
            second.flush(LONG_S)
    assert_all_there_once(service, 300)
    service.terminate()
    assert journaled(service) == {(AGENT, SESSION): numbered(samples)}
